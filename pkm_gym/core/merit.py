"""Feasibility, merit, and which design is the answer.

The log merit of a design is ``log(value / scale(task)) + w * sum(max(0, constraint))``, capped at
6; where nothing can be evaluated it rises from 6 to 7 with the violation of the reach. For an index
that is maximised the fraction is turned over. ``w`` exceeds the multipliers of the constraints, so
the constrained optimum minimises the merit: the penalty is exact.
"""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.types import BoolArray, FloatArray

# A constraint is its scaled violation minus this, and feasible when <= 0. Merit, Optuna and the
# certified optima share this one boundary.
TOLERANCE = 1e-6

CAP = 6.0
WORST = 7.0


@kernel
def log_merit(ratio: float, penalty: float, violation: float) -> float:
    """Return the log merit: ``ratio`` is value/scale, ``violation`` > 0 where it is undefined."""
    if violation > 0.0:
        return CAP + (WORST - CAP) * min(1.0, violation / (1.0 + violation))
    value = math.log(ratio) + penalty
    return min(CAP, value)


@batch_kernel
def score(
    values: FloatArray,
    scales: FloatArray,
    minimise: bool,
    weight: float,
    constraints: FloatArray,
    violations: FloatArray,
    log_merits: FloatArray,
    feasible: BoolArray,
) -> None:
    """Turn scaled violations (n, c) into constraints in place, and fill log merit and feasible.

    ``values`` (n,) is the first objective, ``scales`` (n,) or (1,), ``violations`` (n,) > 0 where
    the indices are undefined: there every other constraint is 1 + the violation.
    """
    for i in numba.prange(constraints.shape[0]):
        penalty = 0.0
        inside = True
        for j in range(constraints.shape[1]):
            constraints[i, j] -= TOLERANCE
            penalty += max(0.0, constraints[i, j])
            inside = inside and constraints[i, j] <= 0.0
        scale = scales[own_row(i, scales.shape[0])]
        ratio = values[i] / scale if minimise else scale / values[i]
        log_merits[i] = log_merit(ratio, weight * penalty, violations[i])
        feasible[i] = inside


def precedence(
    values: FloatArray, feasible: BoolArray, log_merit: FloatArray, sign: float
) -> tuple[BoolArray, FloatArray]:
    """Return by what designs rank, the smaller first: whether infeasible, then a number.

    The feasible ones go by their objective ``values`` (n,), times ``sign``; the others by their
    ``log_merit`` (n,). An exact penalty may rank a slightly infeasible design first, so the lowest
    merit alone is never the answer.
    """
    return ~feasible, np.where(feasible, sign * values, log_merit)


def ranking(
    values: FloatArray, feasible: BoolArray, log_merit: FloatArray, sign: float
) -> npt.NDArray[np.intp]:
    """Return the order (n,) of designs, the answer first: see ``precedence``."""
    infeasible, number = precedence(values, feasible, log_merit, sign)
    return np.lexsort((number, infeasible))


def answer(values: FloatArray, feasible: BoolArray, log_merit: FloatArray, sign: float) -> int:
    """Return which of n designs a search answers with: see ``precedence``.

    Raises:
        ValueError: if there is no design at all.
    """
    if len(values) == 0:
        raise ValueError("there is no design to choose from: evaluate at least one")
    return int(ranking(values, feasible, log_merit, sign)[0])
