"""How a designer gets a name among those that are known, and what it must reproduce."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pkm_gym.agents.designers.designer import Designer
from pkm_gym.agents.designers.files import read_designer, write_designer
from pkm_gym.agents.designers.library import designer_path, known, own_folder
from pkm_gym.agents.designers.scoring import AT
from pkm_gym.agents.runs.files import CONFIG
from pkm_gym.benchmark.splits import load_split
from pkm_gym.mechanisms import lasting

KEPT = 8  # tasks whose first designs are recorded
MEASURED = 64  # tasks whose regrets are recorded
SPLIT = "val"
NAME = re.compile(r"[A-Za-z0-9_-]+")


def take_in(folder: Path, name: str | None = None, to: Path | None = None) -> Path:
    """Write the best agent of a run among the user's own, with what it must reproduce.

    Args:
        folder: of the run.
        name: of the designer; that of its environment if not given.
        to: the folder to write to instead, such as that of the shipped ones.

    Raises:
        ValueError: for no run, a mechanism from outside, or a name that is taken: nothing is
            overwritten.
    """
    path = designer_path(str(folder))
    designer, origin = read_designer(path)
    if lasting(designer.problem) != designer.problem.name:
        raise ValueError(
            f"{designer.problem.name} is a mechanism from outside: give its designer's folder as "
            "--model, it isn't shipped"
        )
    name = name or origin.env_id.rpartition("/")[2].rpartition("-v")[0]
    if not NAME.fullmatch(name):
        raise ValueError(f"a designer's name has letters, digits, - and _ only: {name!r}")
    taken = known().get(name)
    target = (to or own_folder()) / f"{name}{CONFIG}"
    if target.exists() or (taken and to is None):
        raise ValueError(
            f"there is a designer {name!r} already, {taken or target}: give another --name"
        )
    write_designer(
        designer,
        target,
        replace(origin, recorded=recorded(designer)),
        designer.problem.declared.family,
    )
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
