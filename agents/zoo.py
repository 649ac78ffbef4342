"""``pkm-gym zoo``: the trained designers that are shipped, and how a new one is taken in."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from pkm_gym.agents.designer import Designer
from pkm_gym.agents.files import CONFIG, read_designer, write_designer
from pkm_gym.agents.library import ZOO, designer_path, shipped
from pkm_gym.benchmark.splits import load_split
from pkm_gym.studies.terminal import FAINT, console, table

AT = (1, 4, 8, 12, 24)  # evaluations whose median regret is recorded
KEPT = 8  # tasks whose first designs are recorded
MEASURED = 64  # tasks whose regrets are recorded
SPLIT = "val"


def command(
    add: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER", help="Ship the best agent of this training run.", show_default=False
        ),
    ] = None,
) -> None:
    """List the trained designers that are shipped: what they were trained with, how good they are.

    The regrets are those of the first 64 of the benchmark's validation tasks; only feasible designs
    count.
    """
    screen = console()
    if add is not None:
        screen.print(f"taken in: {take_in(add)}", soft_wrap=True)
    heads = [f"k = {k}" for k in AT]
    numbers = ["steps", *heads]
    rows = table("designer", "problem", *numbers, numbers=numbers)
    for name, path in shipped().items():
        designer, origin = read_designer(path)
        regrets = origin.recorded["regrets"]
        medians = [f"{100.0 * regrets[str(k)]:.1g}" if str(k) in regrets else "" for k in AT]
        rows.add_row(name, designer.problem.name, f"{origin.steps / 1e6:.1f} M", *medians)
    screen.print(rows)
    screen.print("k = 1, 4, ...: median regret in per cent after k evaluations", style=FAINT)


def take_in(folder: Path) -> Path:
    """Write the best agent of a run among the shipped ones, with what it must reproduce."""
    path = designer_path(str(folder))
    designer, origin = read_designer(path)
    name = origin.env_id.rpartition("/")[2].rpartition("-v")[0]
    target = ZOO / f"{name}{CONFIG}"
    write_designer(designer, target, replace(origin, recorded=recorded(designer)), {})
    return target


def recorded(designer: Designer) -> dict[str, Any]:
    """Return what a shipped designer must reproduce: first designs, and median regrets."""
    problem, split = load_split(designer.problem.name, SPLIT)
    rows = np.flatnonzero(split.solvable)[:MEASURED]
    tasks = split.tasks[rows]
    optima = problem.evaluate(split.designs[rows], tasks).log_merit
    designs = designer.design(tasks)
    regrets = designs.regrets(optima)
    medians = np.quantile(regrets, 0.5, axis=0, method="higher")
    return {
        "tasks": tasks[:KEPT].tolist(),
        "designs": designs.designs[:KEPT, 0].tolist(),
        "regrets": {f"{k}": float(medians[k - 1]) for k in AT if k <= len(medians)},
    }
