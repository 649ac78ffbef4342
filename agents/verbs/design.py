"""``pkm-gym design``: a trained designer answers a task with dimensions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.text import Text

from pkm_gym.agents.designers.designer import Designer, Designs
from pkm_gym.agents.designers.library import designer_for, load_designer
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Dimension
from pkm_gym.core.solve import polish
from pkm_gym.core.task import Task
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import converted
from pkm_gym.studies.cli.arguments import GivenDesign, problem_from
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    JsonOption,
    Name,
    ObjectiveOption,
    PictureOption,
    SetOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import BAD, FAINT, section, table
from pkm_gym.studies.report.answer import hand_over
from pkm_gym.studies.report.design import Report, content, draw, show_report

UNSOLVED = 1


@dataclass(frozen=True)
class AnsweredTask:
    """What a designer did for one task, and what a local polish of its answer finds.

    Attributes:
        designer: who answered.
        designs: what it evaluated.
        polished: array (d,), the local optimum near its answer.
    """

    designer: Designer
    designs: Designs
    polished: FloatArray

    @property
    def problem(self) -> DesignProblem:
        """The problem that the designer was trained for."""
        return self.designer.problem

    @property
    def design(self) -> FloatArray:
        """Array (d,), the answer."""
        answer: FloatArray = self.designs.answer.designs[0]
        return answer

    @property
    def move(self) -> float:
        """How far the polish moved the answer, the largest share of a variable's range."""
        span = self.problem.high - self.problem.low
        return float(np.max(np.abs(self.polished - self.design) / span))

    @property
    def gain(self) -> float:
        """By how much the polish lowered the log merit."""
        both = np.array([self.design, self.polished])
        before, after = self.problem.evaluate(both, self.designs.tasks).log_merit
        return float(before - after)


def command(
    name: Name,
    set_: SetOption = None,
    objective: ObjectiveOption = None,
    design: DesignFileOption = None,
    budget: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help="Evaluations it may use; as many as it was trained with if not said.",
            show_default=False,
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="NAME|FILE|FOLDER",
            help="Another designer: see `pkm-gym zoo`, or the folder of a training run.",
            show_default=False,
        ),
    ] = None,
    picture: PictureOption = None,
    as_json: JsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Have a trained designer answer a task with dimensions, in a handful of evaluations.

    The exit code is 1 where it finds no feasible design.

    Example: pkm-gym design diamond --set task.b=1.0 task.payload=1.5kg
    """
    out = Output(as_json, csv)
    problem = problem_from(name, set_, objective=objective, file=design, family=True)
    designer = load_designer(model) if model else designer_for(problem)
    if designer.problem.hash() != problem.hash():
        raise ValueError(f"{model!r} is a designer of another problem than {name} as it is set")
    answered = answer(designer, problem.task, budget)
    report = _report(answered, problem.task)
    folder = task_folder(problem)
    if picture is None and not as_json:
        picture = folder / "design.png"
    if picture is not None:
        draw(report, picture)
    show_report(out.screen, report)
    _show(out.screen, answered)
    if not as_json:
        out.screen.print(f"\npicture: {picture}", soft_wrap=True)
        hand_over(out.screen, report.evaluation, folder / "design.toml")
    out.give(content(report) | _content(answered))
    if not report.feasible:
        raise typer.Exit(UNSOLVED)


def answer(designer: Designer, task: Task, budget: int | None = None) -> AnsweredTask:
    """Return a designer's answer to a task, and the local optimum near it."""
    designs = designer.design(task, budget)
    polished = polish(designer.problem, designs.answer.designs, designs.tasks)[0]
    return AnsweredTask(designer, designs, polished)


def _report(answered: AnsweredTask, task: Task) -> Report:
    """Return the report of the answer, with all indices that the mechanism has."""
    problem = answered.problem.with_task(task, **answered.problem.declared.reporting)
    count = answered.designs.designs.shape[1]
    given = GivenDesign(problem, answered.design, task, _outside(task))
    evaluation = problem.evaluate(answered.design[None], task)
    title = f"the answer of a trained designer after {count} evaluations"
    if not evaluation.feasible[0]:
        title = f"none of the {count} designs that a trained designer tried is feasible"
    return Report(given, evaluation, title)


def _outside(task: Task) -> tuple[str, ...]:
    """Say which fields lie outside what a designer is trained on."""
    outside = [
        item.name
        for item in task.variables()
        if not item.low <= getattr(task, item.name) <= item.high
    ]
    if not outside:
        return ()
    return (f"it was not trained on such {', '.join(outside)}: the answer may be far from optimal",)


def _show(screen: Console, answered: AnsweredTask) -> None:
    problem, designs = answered.problem, answered.designs
    sizes = [_sizes(problem, design, designs.tasks[0]) for design in designs.designs[0]]
    units = {name: unit for row in sizes for name, (_, unit) in row.items()}
    heads = [f"{name} {converted(0.0, unit)[1]}".rstrip() for name, unit in units.items()]
    own = len(problem.variables)  # the others are what they make
    shown = ("evaluation", *heads[:own], "merit", "feasible", *heads[own:])
    rows = table(*shown, numbers=[*heads, "merit"])
    for i, row in enumerate(sizes):
        feasible = Text("yes") if designs.feasible[0, i] else Text("no", style=BAD)
        cells = [_number(*row[name]) if name in row else "" for name in units]
        merit = f"{designs.merit[0, i]:.6f}"
        rows.add_row(f"{i + 1}", *cells[:own], merit, feasible, *cells[own:])
    screen.print(section("Its session"))
    screen.print(rows)
    screen.print(
        f"a local polish moved the answer by {answered.move:.2g} of the range and improved "
        f"{problem.objectives[0].name} by {100.0 * answered.gain:.2g} %",
        style=FAINT,
    )


def _sizes(problem: DesignProblem, design: FloatArray, task: FloatArray) -> dict[str, Dimension]:
    """Return a design's searched variables, and the lengths and angles that its ratios make."""
    own = zip(problem.variables, design.tolist(), strict=True)
    variables = {v.name: Dimension(x, v.unit) for v, x in own}
    derived = problem.derived(design, problem.unpack(task))
    return variables | {name: one for name, one in derived.items() if one.unit}


def _number(value: float, unit: str) -> str:
    number, read = converted(value, unit)
    return f"{number:.4f}" if read else f"{number:.6f}"


def _content(answered: AnsweredTask) -> dict[str, Any]:
    designs = answered.designs
    return {
        "session": {
            "designs": designs.designs[0],
            "merit": designs.merit[0],
            "feasible": designs.feasible[0],
        },
        "polish": {"move": answered.move, "log_merit_gain": answered.gain},
    }
