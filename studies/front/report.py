"""A front as a table for people, and as rows for programs."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.files import whole_file
from pkm_gym.core.scalar import Scalarisation, spread
from pkm_gym.core.units import converted, show, shown
from pkm_gym.studies.cli.terminal import FAINT, table
from pkm_gym.studies.front.front import SAME, Front, losses_of
from pkm_gym.studies.front.weighing import preferred
from pkm_gym.studies.report.rows import asks_the_papers_task, told_variables

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
    names = [objective.name for objective in problem.objectives]
    variables = [variable.name for variable in told_variables(problem)]
    sheet = table("", *names, "feasible", *variables, numbers=[*names, "feasible", *variables])
    chosen = spread(front.losses, rows)
    for i in chosen:
        sheet.add_row(f"trial {front.trials[i][1]}", *_cells(front.found, i))
    for mark in marks:
        sheet.add_row(mark.name, *_cells(mark.evaluation, 0))
    screen.print(sheet)
    if units := _units(front):
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


def _cells(evaluation: Evaluation, i: int) -> Iterator[str]:
    problem = evaluation.problem
    for objective, value in zip(problem.objectives, evaluation.objectives[i].tolist(), strict=True):
        number = converted(value, objective.unit)[0]
        yield f"{number:.5g}" if np.isfinite(value) else ""
    yield "yes" if evaluation.feasible[i] else "no"
    design = problem.named(evaluation.designs[i])
    for variable in told_variables(problem):
        value = design[variable.name]
        yield shown(value, variable.unit)[0] if variable.unit else f"{value:.4f}"


def _units(front: Front) -> str:
    """Return which numbers have which unit."""
    problem = front.problem
    units: dict[str, list[str]] = {}
    items = [(o.name, o.unit) for o in problem.objectives]
    items += [(v.name, v.unit) for v in told_variables(problem)]
    for name, unit in items:
        units.setdefault(converted(0.0, unit)[1], []).append(name)
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


def write_csv(path: Path, front: Front, marks: list[Marked]) -> Path:
    """Write every design of the front and those beside it, all digits, SI units in the heads."""
    rows = list(_rows(front, marks))
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    return path


def content(front: Front, marks: list[Marked]) -> dict[str, Any]:
    """Return a front as JSON holds it, in SI units."""
    problem = front.problem
    share = front.share
    return {
        "problem": problem.name,
        "objectives": {
            o.name: {"direction": o.direction, "unit": o.unit} for o in problem.objectives
        },
        "trials": front.finished,
        "feasible": len(front.feasible),
        "reference_point": dict(front.reference),
        "hypervolume": front.hypervolume,
        "share": share if np.isfinite(share) else None,
        "designs": [
            {key.partition(" [")[0]: value for key, value in row.items()}
            for row in _rows(front, marks)
        ],
    }


def _rows(front: Front, marks: list[Marked]) -> Iterator[dict[str, Any]]:
    for i, (study, trial) in enumerate(front.trials):
        yield _row("front", study, trial, front.found, i)
    for mark in marks:
        yield _row(mark.name, "", "", mark.evaluation, 0)


def _row(name: str, study: str, trial: Any, evaluation: Evaluation, i: int) -> dict[str, Any]:
    problem = evaluation.problem
    values = {k: float(x[i]) for k, x in evaluation.indices.items()}
    first = {o.name: values.pop(o.name) for o in problem.objectives}
    numbers = {**first, **problem.named(evaluation.designs[i]), **values}
    units = {name: problem.unit(name) for name in numbers}
    named = {f"{k} [{units[k]}]" if units[k] else k: x for k, x in numbers.items()}
    return {
        "what": name, "study": study, "trial": trial, "feasible": bool(evaluation.feasible[i]),
        **{k: x if np.isfinite(x) else None for k, x in named.items()},
    }  # fmt: skip
