"""How a designer is taken in among the shipped ones, and what it must reproduce."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pkm_gym.agents.designers.designer import Designer
from pkm_gym.agents.designers.files import read_designer, write_designer
from pkm_gym.agents.designers.library import ZOO, designer_path
from pkm_gym.agents.runs.files import CONFIG
from pkm_gym.benchmark.splits import load_split
from pkm_gym.mechanisms import lasting

AT = (1, 4, 8, 12, 24)  # evaluations whose median regret is recorded
KEPT = 8  # tasks whose first designs are recorded
MEASURED = 64  # tasks whose regrets are recorded
SPLIT = "val"


def take_in(folder: Path) -> Path:
    """Write the best agent of a run among the shipped ones, with what it must reproduce."""
    path = designer_path(str(folder))
    designer, origin = read_designer(path)
    if lasting(designer.problem) != designer.problem.name:
        raise ValueError(
            f"{designer.problem.name} is a mechanism from outside: give its designer's folder as "
            "--model, it isn't shipped"
        )
    name = origin.env_id.rpartition("/")[2].rpartition("-v")[0]
    target = ZOO / f"{name}{CONFIG}"
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
