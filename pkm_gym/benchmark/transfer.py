"""Opponents that know the training tasks and their optima, but run no model of their own."""

from __future__ import annotations

import numpy as np

from pkm_gym.benchmark.evaluator import Evaluator
from pkm_gym.benchmark.interpolation import Interpolation
from pkm_gym.benchmark.methods import Search, method
from pkm_gym.benchmark.scratch import descend
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

# By how much of a constraint the active limits are first tightened, and the share of it that is
# left at each further rung.
MARGIN, SHRINK = 1e-3, 0.4

RUNGS = 12
RUNGS_BEFORE = 6  # of COBYQA
RADII = (0.002, 0.02, 0.2)  # of COBYQA's trust regions at first, shares of the range


@method(knowledge="transfer")
def neighbours(problem: DesignProblem, pool: Pool) -> Search:
    """Evaluate the optimal designs of the nearest training tasks, the nearest first."""
    interpolation = Interpolation(problem, pool)

    def search(evaluator: Evaluator) -> None:
        for design in interpolation.nearest(evaluator.task, evaluator.budget):
            evaluator.evaluate(design)

    return search


@method(knowledge="transfer")
def interpolated(problem: DesignProblem, pool: Pool) -> Search:
    """Evaluate the interpolated optimum, then that of a task with corrected limits, and so on."""
    interpolation = Interpolation(problem, pool)

    def search(evaluator: Evaluator) -> None:
        climb(interpolation, evaluator, RUNGS)

    return search


@method(knowledge="transfer")
def interpolated_cobyqa(problem: DesignProblem, pool: Pool) -> Search:
    """Climb a few rungs of the ladder, then go on with COBYQA from the best of them.

    When it has converged it starts again where it is, with a larger trust region.
    """
    interpolation = Interpolation(problem, pool)

    def search(evaluator: Evaluator) -> None:
        climb(interpolation, evaluator, RUNGS_BEFORE)
        for radius in RADII:
            descend(evaluator, answer(evaluator), radius)

    return search


def climb(interpolation: Interpolation, evaluator: Evaluator, rungs: int) -> None:
    """Evaluate a ladder of interpolated optima.

    What an evaluation says of the active constraints is laid on their limits: where one is broken
    by 1e-3, the optimum of a task is tried whose limit is that much tighter; where one is not
    reached, of a task whose limit is looser. A limit that is broken unforeseen changes the branch.
    """
    task = evaluator.task
    branch = interpolation.branch(task)
    place = interpolation.tightened(task, branch, MARGIN)
    tried = [branch]
    margin = MARGIN
    for _ in range(rungs):
        constraints = evaluator.evaluate(interpolation.design(branch, place)).constraints[0]
        broken = set(np.flatnonzero(constraints > margin).tolist())
        if branch is not interpolation.plain and not broken <= set(branch.active):
            branch = interpolation.branch(task, among=broken)
            branch = interpolation.plain if branch in tried else branch
            tried.append(branch)
            place = interpolation.tightened(task, branch, MARGIN)
            continue
        margin *= SHRINK
        for j in broken.union(branch.active):
            field = interpolation.limit_of(j)
            if field is not None:
                place[field] += (constraints[j] + margin) / interpolation.slope(task, field, j)


def answer(evaluator: Evaluator) -> FloatArray:
    """Return the best feasible design (d,) so far; without one that of lowest merit."""
    merit = np.where(evaluator.feasible, evaluator.log_merit, np.inf)
    best = merit if evaluator.feasible.any() else evaluator.log_merit
    return evaluator.designs[int(best.argmin())]
