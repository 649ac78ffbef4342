"""A front as a table for people, and as rows for programs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.scalar import Scalarisation, spread
from pkm_gym.core.units import converted, show
from pkm_gym.studies.cli.terminal import FAINT
from pkm_gym.studies.front.front import SAME, Front, losses_of
from pkm_gym.studies.front.weighing import preferred
from pkm_gym.studies.report.records import asked, design_units, units_asked
from pkm_gym.studies.report.rows import (
    Row,
    asks_the_papers_task,
    design_columns,
    row_of,
    sheets,
    told_dimensions,
    told_variables,
)

ROWS = 12  # of the front, as people read it


@dataclass(frozen=True, eq=False)
class Marked:
    """A design that is shown beside the front.

    Attributes:
        name: what it is.
        kind: "paper", "optimum" or "preferred".
        evaluation: of it alone.
    """

    name: str
    kind: str
    evaluation: Evaluation


def marked(front: Front, ways: list[Scalarisation]) -> list[Marked]:
    """Return the paper's design, the optimum of each objective, and what the ways prefer."""
    problem = front.problem
    designs = []
    if asks_the_papers_task(problem):
        designs.append(("paper, our model", "paper", problem.printed_design()))
    for name, row in front.optima.items():
        if row is not None:
            designs.append((f"optimum of {name}", "optimum", problem.design(row.design)))
    known = [Marked(name, kind, problem.evaluate(one[None])) for name, kind, one in designs]
    return known + [Marked(way.name, "preferred", preferred(front, way)) for way in ways]


def show_front(screen: Console, front: Front, marks: list[Marked], rows: int = ROWS) -> None:
    """Print the front, a few of its designs far from each other, and the designs beside it."""
    problem = front.problem
    chosen = spread(front.losses, rows)
    shown = [(f"trial {front.trials[i][1]}", front.found, int(i)) for i in chosen]
    shown += [(mark.name, mark.evaluation, 0) for mark in marks]
    told = [row_of(name, evaluation, i, None) for name, evaluation, i in shown]
    values = [["", *(row.name for row in told)]]
    for k, objective in enumerate(problem.objectives):
        numbers = (_value(e.objectives[i, k], objective.unit) for _, e, i in shown)
        values.append([objective.name, *numbers])
    values.append(["feasible", *(row.feasible for row in told)])
    screen.print(*sheets([*values, *design_columns(problem, told)], len(values)))
    if units := _units(problem, told):
        screen.print(units, style=FAINT)
    many = len(front.found)
    some = "" if many == len(chosen) else f", {len(chosen)} of them shown, far from each other"
    screen.print(
        f"front: {many} distinct designs of {len(front.feasible):,} feasible ones in "
        f"{front.finished:,} trials{some}"
    )
    screen.print(_volume(front))
    if note := _agreement(front):
        screen.print(note)


def _value(value: float, unit: str) -> str:
    return f"{converted(float(value), unit)[0]:.5g}" if np.isfinite(value) else ""


def _units(problem: DesignProblem, told: list[Row]) -> str:
    """Return which numbers have which unit."""
    units: dict[str, list[str]] = {}
    items = [(o.name, o.unit) for o in problem.objectives]
    for name, unit in [*items, *((v.name, v.unit) for v in told_variables(problem))]:
        units.setdefault(converted(0.0, unit)[1], []).append(name)
    for name, (unit, *_) in told_dimensions(problem, told).items():
        units.setdefault(unit, []).append(name)
    return "; ".join(f"{', '.join(names)} in {unit}" for unit, names in units.items() if unit)


def _volume(front: Front) -> str:
    point = ", ".join(
        f"{o.name} = {show(front.reference[o.name], o.unit)}" for o in front.problem.objectives
    )
    share = f", {front.share:.4f} of the box up to the optima" if np.isfinite(front.share) else ""
    return f"hypervolume: {front.hypervolume:.6g}{share}; reference point: {point}"


def _agreement(front: Front) -> str:
    """Say that the objectives don't compete where the optimum of one is as good in all."""
    problem = front.problem
    designs = [problem.design(row.design) for row in front.optima.values() if row is not None]
    if not designs:
        return ""
    losses = losses_of(problem.evaluate(np.array(designs)))
    best = losses.min(axis=0)
    if not (losses <= best + SAME * abs(best)).all(axis=1).any():
        return ""
    names = " and ".join(objective.name for objective in problem.objectives)
    return f"{names} don't compete here: one design is the optimum of each"


def content(front: Front, marks: list[Marked]) -> dict[str, Any]:
    """Return what is handed to programs: every design of the front and those beside it, SI."""
    problem = front.problem
    objectives = {o.name: o.unit for o in problem.objectives}
    indices = {index.name: index.unit for index in problem.index_table}
    found = [_row("front", *one, front.found, i) for i, one in enumerate(front.trials)]
    return {
        **asked(problem),
        "trials": front.finished,
        "feasible": len(front.feasible),
        "reference_point": dict(front.reference),
        "hypervolume": front.hypervolume,
        "share": front.share,
        "units": {
            **units_asked(problem),
            "reference_point": objectives,
            "objectives": objectives,
            **design_units(problem),
            "indices": indices,
        },
        "rows": [*found, *(_row(mark.name, "", None, mark.evaluation, 0) for mark in marks)],
    }


def _row(
    name: str, study: str, trial: int | None, evaluation: Evaluation, i: int
) -> dict[str, Any]:
    problem, design = evaluation.problem, evaluation.designs[i]
    objectives = zip(problem.objectives, evaluation.objectives[i], strict=True)
    return {
        "what": name,
        "study": study,
        "trial": trial,
        "feasible": bool(evaluation.feasible[i]),
        "objectives": {objective.name: value for objective, value in objectives},
        "design": problem.named(design),
        "derived": {name: value for name, (value, _) in problem.derived(design).items()},
        "indices": {name: values[i] for name, values in evaluation.indices.items()},
    }
