"""An evaluated design in numbers, words and a picture."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from math import isclose, isfinite
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import Value
from pkm_gym.core.rows import Dimension
from pkm_gym.core.statics import Holding
from pkm_gym.core.task import Task
from pkm_gym.core.units import shown
from pkm_gym.studies.cli.arguments import GivenDesign
from pkm_gym.studies.cli.terminal import (
    BAD,
    FAINT,
    GOOD,
    HEAD,
    Sheet,
    listing,
    section,
    table,
)
from pkm_gym.studies.report.records import asked, design_units, units_asked
from pkm_gym.studies.report.rows import is_judged

BOUNDLESS = 1_000  # characters, more than any line has


@dataclass(frozen=True)
class Report:
    """An evaluated design and all that is said of it."""

    given: GivenDesign
    evaluation: Evaluation
    title: str = "a design of your own"
    holding: tuple[Holding, ...] = ()

    @property
    def problem(self) -> DesignProblem:
        """The problem of the design."""
        return self.given.problem

    @property
    def derived(self) -> dict[str, Dimension]:
        """The derived dimensions, none where the design makes no machine."""
        return self.problem.derived(self.given.design, self.given.task)

    @property
    def cycle(self) -> dict[str, Dimension]:
        """The cycle that dynamic indices are over, none without such."""
        return self.problem.cycle(self.given.task)

    @property
    def indices(self) -> dict[str, float]:
        """The indices in SI, NaN where undefined."""
        return {name: float(values[0]) for name, values in self.evaluation.indices.items()}

    @property
    def constraints(self) -> dict[str, float]:
        """The constraints, broken where > 0."""
        values = map(float, self.evaluation.constraints[0])
        return dict(zip(self.problem.constraint_names, values, strict=True))

    @property
    def feasible(self) -> bool:
        """Whether every limit holds."""
        return bool(self.evaluation.feasible[0])

    @property
    def notes(self) -> tuple[str, ...]:
        """How the design was completed, and the problem's standing warnings."""
        return self.given.notes + self.evaluation.notes

    @property
    def is_printed(self) -> bool:
        """Whether it is the paper's design and task; the default ones where there is no paper."""
        paper = (*self.problem.printed_design(), *self.problem.task_type().pack())
        own = (*self.given.design, *self.given.task.pack())
        return bool(np.allclose(own, paper, rtol=1e-9, atol=0.0))

    @property
    def printed(self) -> dict[str, tuple[Value, float]]:
        """The paper's numbers for this design, each beside ours, where the verdict holds.

        With other options (another inertia, say) our number differs from the one that was judged.
        """
        if not self.is_printed:
            return {}
        ours = {name: value for name, (value, _) in self.derived.items()} | self.indices
        return {
            value.name: (value, ours[value.name])
            for value in self.problem.reference.values.values()
            if value.printed is not None
            and value.kind in ("index", "dimension")
            and is_judged(self.problem, value, ours[value.name])
        }


def draw(report: Report, path: Path) -> None:
    """Write the picture of a design."""
    from pkm_gym.plots import design_figure, save

    save(design_figure(report.problem, report.given.design, report.given.task), path)


def content(report: Report) -> dict[str, Any]:
    """Return what ``--json`` prints: SI units, null where undefined."""
    problem, evaluation = report.problem, report.evaluation
    return {
        **asked(problem, report.given.task),
        "design": problem.named(report.given.design),
        "derived": {name: value for name, (value, _) in report.derived.items()},
        "cycle": {name: value for name, (value, _) in report.cycle.items()},
        "indices": report.indices,
        "constraints": report.constraints,
        "feasible": report.feasible,
        "merit": float(evaluation.merit[0]),
        "explain": evaluation.explain(0).splitlines(),
        "notes": list(report.notes),
        "holding": [asdict(one) for one in report.holding],
        "paper": {
            name: {"printed": value.printed, "verdict": value.verdict}
            for name, (value, _) in report.printed.items()
        },
        "units": {
            **units_asked(problem),
            **design_units(problem),
            "cycle": {name: unit for name, (_, unit) in report.cycle.items()},
            "indices": {index.name: index.unit for index in problem.index_table},
        },
    }


def show_report(screen: Console, report: Report) -> None:
    """Print all that is said of a design."""
    problem, evaluation = report.problem, report.evaluation
    whose = "the design that the paper prints" if problem.reference else "the default design"
    what = whose if report.is_printed else report.title
    screen.print(Text.assemble((problem.name, HEAD), f": {what}"))
    for note in report.notes:
        screen.print(note, style=FAINT)
    screen.print()
    screen.print(_numbers(screen, report))
    screen.print(section("Indices"))
    screen.print(_indices(report))
    screen.print(section("Limits"))
    screen.print(_limits(report))
    screen.print()
    for line in evaluation.explain(0).splitlines():
        screen.print(line, style=GOOD if report.feasible else BAD)
    of = f"of {problem.objectives[0].name}: smaller is better, about 1 at the task's optimum"
    screen.print(Text.assemble(f"merit {evaluation.merit[0]:.5g} ", (of, FAINT)))
    if report.holding:
        screen.print(section("What the drives hold of the load, over the workspace"))
        screen.print(_holding(report.holding))
    if report.printed:
        screen.print(section("What the paper prints"))
        screen.print(*_paper(report), sep="\n")


def _numbers(screen: Console, report: Report) -> RenderableType:
    """Return variables, derived dimensions and the task's other-than-default fields.

    They stand abreast where they fit.
    """
    named = report.problem.named(report.given.design)
    variables = {v.name: (named[v.name], v.unit) for v in report.problem.all_variables}
    changed = changed_task(report.problem, report.given.task)
    beside = {name: value for name, value in changed.items() if name not in report.cycle}
    parts: dict[str, Mapping[str, tuple[float, str]]] = {
        "design": variables,
        "dimensions": report.derived,
        "task, beside defaults": beside,
        "cycle": report.cycle,
    }
    blocks = [
        Group(Text(title, style=FAINT), listing(values))
        for title, values in parts.items()
        if values
    ]
    abreast = Table.grid(padding=(0, 5))
    abreast.add_row(*blocks)
    unbounded = screen.options.update(width=BOUNDLESS)
    fits = Measurement.get(screen, unbounded, abreast).maximum <= screen.width
    return abreast if fits else Group(*blocks)


def changed_task(problem: DesignProblem, task: Task) -> dict[str, Dimension]:
    """Return the fields of a task that aren't by default, and lengths and times beside ratios."""

    def all_of(one: Task) -> dict[str, Dimension]:
        fields = {v.name: Dimension(getattr(one, v.name), v.unit) for v in one.variables()}
        return fields | problem.declared.products_of(one)

    usual = all_of(problem.task_type())
    return {k: x for k, x in all_of(task).items() if not isclose(x.value, usual[k].value)}


def _indices(report: Report) -> Sheet:
    rows = table("index", "value", "unit", "what it is", numbers=["value"])
    for index in report.problem.index_table:
        rows.add_row(index.name, *shown(report.indices[index.name], index.unit), index.doc)
    return rows


def _limits(report: Report) -> Sheet:
    """Return each limit's margin in words, dimensionless as the constraints are."""
    rows = table("limit", "verdict", "margin", numbers=["margin"])
    defined = dict(zip(report.constraints, report.evaluation.defined[0], strict=True))
    for name, value in report.constraints.items():
        if not defined[name]:
            rows.add_row(name, Text("undefined", style=FAINT), "")
        elif value > 0.0:
            rows.add_row(name, Text("broken", style=BAD), _margin(value))
        else:
            rows.add_row(name, Text("holds", style=GOOD), _margin(value))
    return rows


def _holding(holding: Iterable[Holding]) -> Sheet:
    heads = ("drive", "largest", "in the middle", "unit", "the largest")
    rows = table(*heads, numbers=heads[1:3])
    for one in holding:
        sizes = (one.largest, one.middle)
        numbers = [shown(x, one.unit)[0] if isfinite(x) else "no bound" for x in sizes]
        rows.add_row(one.joint, *numbers, one.unit, Text(one.place, style=FAINT))
    return rows


def _paper(report: Report) -> Iterator[RenderableType]:
    """Yield the table of printed numbers beside ours, and what there is to say of each."""
    rows = table("number", "printed", "ours", "unit", "verdict", numbers=["printed", "ours"])
    for name, (value, ours) in report.printed.items():
        (printed, unit), (computed, _) = (
            shown(value.printed or 0.0, value.unit),
            shown(ours, value.unit),
        )
        rows.add_row(name, printed, computed, unit, value.verdict)
    yield rows
    for name, (value, _) in report.printed.items():
        if value.note:
            yield Text(f"{name}: {value.note}", style=FAINT)


def _margin(constraint: float) -> str:
    margin = abs(constraint)
    return f"{margin:.4f}" if margin >= 1e-4 else f"{margin:.1e}"
