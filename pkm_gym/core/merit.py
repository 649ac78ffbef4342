"""Feasibility, merit, and which design is the answer.

The log merit of a design is ``log(value / scale(task)) + w * sum(max(0, constraint))``, capped at
6; where nothing can be evaluated it rises from 6 to 7 with the violation of the reach. For an index
that is maximised the fraction is turned over. ``w`` exceeds the multipliers of the constraints, so
the constrained optimum minimises the merit: the penalty is exact.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np
import numpy.typing as npt

from pkm_gym.core.compile import batch_kernel, formula, kernel, own_row
from pkm_gym.core.limit import INDEX, LIMIT, OWN
from pkm_gym.core.types import BoolArray, FloatArray

# A constraint is its scaled violation minus this, and feasible when <= 0. Merit, Optuna and the
# certified optima share this one boundary.
TOLERANCE = 1e-6

CAP = 6.0
WORST = 7.0

# Beyond it a violation is not counted, so that a constraint is always finite.
LARGEST = 1e30

# How far out of reach a design counts that makes no machine: its log merit is the worst.
NO_MACHINE = 1e30


@kernel
def log_merit(ratio: float, penalty: float, violation: float) -> float:
    """Return the log merit: ``ratio`` is value/scale, ``violation`` > 0 where it is undefined."""
    if violation > 0.0:
        return CAP + (WORST - CAP) * min(1.0, violation / (1.0 + violation))
    if not ratio > 0.0:
        return CAP
    return min(CAP, math.log(ratio) + penalty)


@kernel
def write(row: FloatArray, values: tuple[float, ...]) -> None:
    """Fill a row (k,) with the values of a NamedTuple."""
    for k in range(len(values)):
        row[k] = values[k]


@formula
def violation_of(limit: Any, value: float, tasks: FloatArray, row: int) -> float:
    """Return by how much a value breaks a ``Limit``'s record on a packed task, > 0 where broken."""
    bound = limit.bound
    if limit.field >= 0.0:
        bound = tasks[row, int(limit.field)]
    if limit.factor >= 0.0:
        bound = bound * tasks[row, int(limit.factor)] ** limit.power
    if limit.relative > 0.0:
        return limit.sign * (value / bound - 1.0)
    return limit.sign * (value - bound)


@formula
def task_factor(tasks: FloatArray, row: int, powers: FloatArray, rates: FloatArray) -> float:
    """Return what a packed task multiplies the scale with; see ``judge``."""
    factor = 1.0
    for k in range(powers.shape[0]):
        if powers[k] != 0.0:
            factor *= tasks[row, k] ** powers[k]
        if rates[k] != 0.0:
            factor *= math.exp(rates[k] * tasks[row, k])
    return factor


@batch_kernel
def judge(
    designs: FloatArray,
    tasks: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
    scales: FloatArray,
    powers: FloatArray,
    rates: FloatArray,
    limits: FloatArray,
    objective: int,
    sign: float,
    offset: float,
    weight: float,
    constraints: FloatArray,
    defined: BoolArray,
    log_merits: FloatArray,
    feasible: BoolArray,
) -> None:
    """Turn what n designs measure into constraints, feasibility and log merit.

    ``table`` (n, indices), ``own`` (n, own limits), ``unreached`` (n,) and ``scales`` (n,) are what
    the mechanism's kernel filled; each scale is multiplied with the task's fields to the ``powers``
    (m,), and with the exponential of them times the ``rates`` (m,). ``limits`` (c, 8) are records
    of ``limit.LIMIT``, ``objective`` is a column of the table, ``sign`` +1 or -1. Where the first
    of the own limits, the dimensions, is broken, nothing else is defined; what is NaN counts as
    1 + ``unreached``.
    """
    limit_rows = limits.view(LIMIT)
    for i in numba.prange(constraints.shape[0]):
        row = own_row(i, tasks.shape[0])
        impossible = own[i, 0] > 0.0
        missing = 1.0 + (own[i, 0] if impossible else unreached[i])
        if impossible:
            unreached[i] = NO_MACHINE
        penalty = 0.0
        inside = True
        for j in range(constraints.shape[1]):
            limit = limit_rows[j, 0]
            column = int(limit.column)
            if limit.source == OWN:
                value = own[i, column]
            elif limit.source == INDEX:
                value = violation_of(limit, table[i, column], tasks, row)
            else:
                value = violation_of(limit, designs[i, column], tasks, row)
            known = not (math.isnan(value) or (impossible and j > 0))
            if not known:
                value = missing
            elif abs(value) > LARGEST:
                value = math.copysign(LARGEST, value)
            defined[i, j] = known
            constraints[i, j] = value - TOLERANCE
            penalty += max(0.0, constraints[i, j])
            inside = inside and constraints[i, j] <= 0.0
        value = offset + table[i, objective]
        scale = scales[i] * task_factor(tasks, row, powers, rates)
        ratio = value / scale if sign > 0.0 else scale / value
        log_merits[i] = log_merit(ratio, weight * penalty, unreached[i])
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
