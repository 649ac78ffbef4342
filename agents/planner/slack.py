"""Slack: SLSQP on a merit, with constraints that may be broken at a price."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize

from pkm_gym.core.types import FloatArray

SLACK = 10.0  # price of a broken constraint, in log merit
ITERATIONS = 60


class Local(NamedTuple):
    """What is expected at a place (d,): constraints are kept where they aren't positive.

    Attributes:
        merit: log merit.
        slope: array (d,).
        constraints: array (q,).
        slopes: array (q, d).
    """

    merit: float
    slope: FloatArray
    constraints: FloatArray
    slopes: FloatArray


def least(
    expected: Callable[[FloatArray], Local],
    start: FloatArray,
    low: FloatArray,
    high: FloatArray,
    *,
    slack: float,
    precision: float,
) -> tuple[FloatArray, float]:
    """Return the place (d,) between bounds (d,) where the merit is least, and the price there.

    Constraints that can't be kept are broken as little as possible, which has its price.

    Args:
        expected: place (d,) -> what is expected there.
        start: array (d,), where the descent starts.
        low: array (d,).
        high: array (d,).
        slack: by how much constraints may be broken at the start.
        precision: of the price.
    """
    d, seen = len(start), dict[bytes, Local]()

    def at(x: FloatArray) -> Local:
        key = x[:d].tobytes()
        if key not in seen:
            seen.clear()
            seen[key] = expected(x[:d])
        return seen[key]

    def price(x: FloatArray) -> tuple[float, FloatArray]:
        local = at(x)
        return local.merit + SLACK * x[d], np.r_[local.slope, SLACK]

    def room(x: FloatArray) -> FloatArray:
        return np.asarray(x[d] - at(x).constraints)

    def room_slopes(x: FloatArray) -> FloatArray:
        slopes = at(x).slopes
        return np.c_[-slopes, np.ones(len(slopes))]

    settings: dict[str, Any] = {
        "jac": True,
        "method": "SLSQP",
        "bounds": [*zip(low, high, strict=True), (0.0, None)],
        "constraints": {"type": "ineq", "fun": room, "jac": room_slopes},
        "options": {"ftol": precision, "maxiter": ITERATIONS},
    }
    found = minimize(price, np.r_[start, slack], **settings)
    return np.clip(found.x[:d], low, high), float(found.fun)
