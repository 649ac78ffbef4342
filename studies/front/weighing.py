"""The design that a way to weigh objectives prefers, searched for in the whole box."""

from __future__ import annotations

from collections.abc import Mapping
from typing import cast

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.evolution import evolve
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.scalar import Pca, Scalarisation, Tolerance, Weighted, pca, tolerance, weighted
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.front.front import Front, losses_of, signs_of

PENALTY = 1e3  # on a unit of broken limits, in the width of the numbers that are known
UNDEFINED = 1e9  # what counts where an objective is


def weighted_sum(front: Front, weights: Mapping[str, float] | None = None) -> Weighted:
    """Return the weighted sum over what objectives vary by; one that is left out has weight 0.

    Raises:
        ValueError: for an unknown objective, a negative weight, or none > 0.
    """
    given = weights or {o.name: 1.0 for o in front.problem.objectives}
    return weighted(_best_known(front), _in_order(front.problem, "weight", given, 0.0))


def tolerance_weighted(front: Front, tolerances: Mapping[str, float] | None = None) -> Tolerance:
    """Return the length in tolerances from the best that is known of each objective.

    A tolerance is half of what the objective varies by if none is given.

    Raises:
        ValueError: for an unknown objective, one that is missing, or a tolerance that isn't > 0.
    """
    if not tolerances:
        return tolerance(_best_known(front))
    given = _in_order(front.problem, "tolerance", tolerances, np.nan)
    if missing := [o.name for o in front.problem.objectives if o.name not in tolerances]:
        raise ValueError(f"the tolerances lack {', '.join(missing)}")
    return tolerance(_best_known(front), given)


def principal_components(front: Front) -> Pca:
    """Return the composite of all feasible designs that the studies have found.

    Raises:
        ValueError: for fewer than two of them, or an objective that doesn't vary among them.
    """
    problem = front.problem
    names = tuple(objective.name for objective in problem.objectives)
    return pca(front.feasible, names, signs_of(problem), "feasible designs of the studies")


def preferred(front: Front, way: Scalarisation, *, seed: int = 0) -> Evaluation:
    """Return the evaluation of the feasible design that a way prefers, one design.

    The whole box is searched by an evolution, as for a single objective's optimum; the answer is
    never worse than the front's best.
    """
    numbers = way(front.feasible)
    weighed = _Weighed(front.problem, way, float(np.ptp(numbers)) or 1.0)
    task = front.problem.pack(None)[None]
    searched = evolve(cast("DesignProblem", weighed), task, np.random.default_rng(seed))
    start = front.found.designs[np.argmin(way(front.losses))]
    both = front.problem.evaluate(np.stack([start, searched.designs[0]]))
    number = np.where(both.feasible, way(losses_of(both)), np.inf)
    best = int(np.argmin(number))
    return front.problem.evaluate(both.designs[best : best + 1])


class _Weighed:
    """A problem whose log merit is a way's number, in the width of those that are known."""

    def __init__(self, problem: DesignProblem, way: Scalarisation, width: float) -> None:
        self.low, self.high, self.variables = problem.low, problem.high, problem.variables
        self.penalty_weight = problem.penalty_weight
        self._problem, self._way, self._width = problem, way, width

    def evaluate(self, designs: FloatArray, tasks: FloatArray) -> Evaluation:
        """Evaluate designs (n, d): the number where it is defined, and a penalty on limits."""
        evaluation = self._problem.evaluate(designs, tasks)
        number = self._way(losses_of(evaluation)) / self._width
        broken = np.maximum(evaluation.constraints, 0.0).sum(axis=1)
        known = np.isfinite(number)
        merit = np.where(known, np.minimum(number + PENALTY * broken, UNDEFINED), UNDEFINED)
        merit = np.where(known, merit, merit + evaluation.log_merit)
        return evaluation.told(evaluation.objectives[:, 0], evaluation.constraints, merit)


def _best_known(front: Front) -> FloatArray:
    """Return the losses (n, k) of the front and of each objective's own optimum."""
    problem = front.problem
    designs = [problem.design(row.design) for row in front.optima.values() if row is not None]
    optima = [losses_of(problem.evaluate(np.array(designs)))] if designs else []
    return np.concatenate([front.losses, *optima])


def _in_order(
    problem: DesignProblem, what: str, given: Mapping[str, float], usual: float
) -> FloatArray:
    names = [objective.name for objective in problem.objectives]
    check_known(f"objective of a {what}", given, names)
    return np.array([float(given.get(name, usual)) for name in names])
