"""Opponents that know the training tasks and their optima, but run no model of their own."""

from __future__ import annotations

from pathlib import Path

from pkm_gym.benchmark.evaluator import Evaluator
from pkm_gym.benchmark.ladder import Ladder
from pkm_gym.benchmark.methods import Search, method
from pkm_gym.benchmark.optima import KnownOptima
from pkm_gym.benchmark.scratch import descend
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem

RUNGS = 12
RUNGS_BEFORE = 6  # of COBYQA
RADII = (0.002, 0.02, 0.2)  # of COBYQA's trust regions at first, shares of the range


def parts_of_the_ladder(_name: str) -> list[Path]:
    """Return the files that the ladder's results depend on."""
    names = ("interpolation.py", "ladder.py", "optima.py")
    return [Path(__file__).with_name(name) for name in names]


@method(knowledge="transfer")
def neighbours(problem: DesignProblem, pool: Pool) -> Search:
    """Evaluate the optimal designs of the nearest training tasks, the nearest first."""
    optima = KnownOptima(problem, pool)

    def search(evaluator: Evaluator) -> None:
        for design in optima.nearest(evaluator.task, evaluator.budget):
            evaluator.evaluate(design)

    return search


@method(knowledge="transfer", files=parts_of_the_ladder)
def interpolated(problem: DesignProblem, pool: Pool) -> Search:
    """Evaluate the interpolated optimum, then that of a task with corrected limits, and so on."""
    ladder = Ladder(problem, pool)

    def search(evaluator: Evaluator) -> None:
        ladder.climb(evaluator, RUNGS)

    return search


@method(knowledge="transfer", files=parts_of_the_ladder)
def interpolated_cobyqa(problem: DesignProblem, pool: Pool) -> Search:
    """Climb a few rungs of the ladder, then go on with COBYQA from the best of them.

    When it has converged it starts again where it is, with a larger trust region.
    """
    ladder = Ladder(problem, pool)

    def search(evaluator: Evaluator) -> None:
        ladder.climb(evaluator, RUNGS_BEFORE)
        for radius in RADII:
            descend(evaluator, evaluator.answer, radius)

    return search
