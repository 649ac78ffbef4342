"""How bad a feasible design of a task can be: from there on count those that aren't feasible.

A declared ``worst`` holds for every legal task and all options, so it lies far from the designs of
most. A study is of one task: its own worst is measured, on designs drawn in its box.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pkm_gym.core.calibration import SCALE
from pkm_gym.core.types import FloatArray

if TYPE_CHECKING:
    from pkm_gym.core.declaration import Objective
    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.task import Task

DRAWN, MOST = 512, 2048  # designs at a time, and in all
ENOUGH = 64  # feasible ones, from which their width is known
SEED = 0


class Worst(NamedTuple):
    """Values that no feasible design reaches, and the widths in which violations count."""

    values: FloatArray  # (k,), in the objectives' units
    widths: FloatArray  # (k,), > 0


def declared_worst(problem: DesignProblem) -> Worst:
    """Return what is declared for every legal task; a violation counts as it is."""
    values = np.array([objective.worst for objective in problem.objectives])
    return Worst(values, np.full(len(values), float(len(problem.constraint_names))))


@lru_cache(maxsize=4)
def worst_of(problem: DesignProblem, task: Task) -> Worst:
    """Return the worst of a task: the worst feasible value drawn, and their width beyond it.

    Never farther than what is declared. Where few designs are feasible, the width is that value
    itself at least; where none is, the objective's scale stands for one, if it is known.
    """
    feasible = _feasible(problem, task)
    far = declared_worst(problem)
    for k, objective in enumerate(problem.objectives):
        values = feasible[np.isfinite(feasible[:, k]), k]
        if not len(values):
            if objective.scale == SCALE:
                continue
            values = np.array([_scale(problem, objective, task)])
        worst = values.max() if objective.sign > 0.0 else values.min()
        width = float(np.ptp(values)) if len(values) >= ENOUGH else 0.0
        width = width or max(float(np.ptp(values)), abs(float(worst))) or 1.0
        nearer = min if objective.sign > 0.0 else max
        far.values[k] = nearer(far.values[k], float(worst) + objective.sign * width)
        far.widths[k] = width
    return far


def _feasible(problem: DesignProblem, task: Task) -> FloatArray:
    """Return the objectives (n, k) of feasible designs, as many as it takes or can be had."""
    generator, found = np.random.default_rng(SEED), []
    for _ in range(MOST // DRAWN):
        unit = generator.random((DRAWN, len(problem.variables)))
        evaluation = problem.evaluate(problem.low + (problem.high - problem.low) * unit, task)
        found.append(evaluation.objectives[evaluation.feasible])
        if sum(map(len, found)) >= ENOUGH:
            break
    return np.concatenate(found)


def _scale(problem: DesignProblem, objective: Objective, task: Task) -> float:
    """Return about what an objective is at a task's optimum."""
    row = dict(zip(problem.task_type.names(), problem.pack(task).tolist(), strict=True))
    factor = np.prod([row[name] ** power for name, power in objective.powers.items()])
    return float(
        objective.scale * factor * np.exp(sum(r * row[n] for n, r in objective.rates.items()))
    )
