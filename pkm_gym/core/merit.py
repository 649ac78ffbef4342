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


def answer(values: FloatArray, feasible: BoolArray, merit: FloatArray, *, minimise: bool) -> int:
    """Return which of n designs a search answers with.

    The best feasible one by its objective ``values`` (n,); where none is feasible, the one of
    lowest ``merit`` (n,). An exact penalty may rank a slightly infeasible design first, so the
    lowest merit alone is never the answer.

    Raises:
        ValueError: if there is no design at all.
    """
    if len(values) == 0:
        raise ValueError("there is no design to choose from: evaluate at least one")
    if not feasible.any():
        return int(np.argmin(merit))
    worst = np.inf if minimise else -np.inf
    kept = np.where(feasible, values, worst)
    return int(np.argmin(kept) if minimise else np.argmax(kept))
