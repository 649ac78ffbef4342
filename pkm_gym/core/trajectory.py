"""The 3-4-5 polynomial and what is built from it: paths, and a feed with ramps."""

from __future__ import annotations

import math

import numpy as np

from pkm_gym.core.compile import formula, kernel
from pkm_gym.core.types import FloatArray


@kernel
def polynomial_345(rho: float) -> tuple[float, float, float]:
    """Return s, s', s'' of ``s = 10 rho^3 - 15 rho^4 + 6 rho^5``, at rest outside 0 <= rho <= 1."""
    if rho <= 0.0:
        return 0.0, 0.0, 0.0
    if rho >= 1.0:
        return 1.0, 0.0, 0.0
    s = rho * rho * rho * (10.0 - 15.0 * rho + 6.0 * rho * rho)
    rate = 30.0 * rho * rho * (1.0 - rho) * (1.0 - rho)
    bend = 60.0 * rho * (1.0 - rho) * (1.0 - 2.0 * rho)
    return s, rate, bend


@formula
def pick_and_place_durations(
    width: float, lift: float, time: float, overlap: float
) -> tuple[float, float]:
    """Return the durations (lift, traverse) of a cycle of total ``time``, seconds.

    Durations go with the square roots of the lengths, so that both moves reach the same
    acceleration; ``overlap`` is the share of the lift during which the traverse already runs.
    """
    k = math.sqrt(lift / width)
    traverse = time / (1.0 + 2.0 * k * (1.0 - overlap))
    return k * traverse, traverse


@formula
def pick_and_place(
    t: float, width: float, lift: float, time: float, overlap: float
) -> tuple[float, float, float, float, float, float]:
    """Return x, y, vx, vy, ax, ay at time ``t`` of an up-across-down cycle.

    Three overlapped 3-4-5 moves, from (-width/2, 0) over y = lift to (width/2, 0).
    """
    rise, traverse = pick_and_place_durations(width, lift, time, overlap)
    across, across_v, across_a = polynomial_345((t - (1.0 - overlap) * rise) / traverse)
    up, up_v, up_a = polynomial_345(t / rise)
    down, down_v, down_a = polynomial_345((t - time + rise) / rise)
    return (
        width * (across - 0.5),
        lift * (up - down),
        width * across_v / traverse,
        lift * (up_v - down_v) / rise,
        width * across_a / traverse**2,
        lift * (up_a - down_a) / rise**2,
    )


PEAK_SPEED = 1.875  # of a 3-4-5 move of unit length in unit time
PEAK_ACCELERATION = 10.0 / math.sqrt(3.0)


@kernel
def duration_345(length: float, speed: float, acceleration: float) -> float:
    """Return the time of a rest-to-rest 3-4-5 move that keeps to a speed and an acceleration, s."""
    return max(PEAK_SPEED * length / speed, math.sqrt(PEAK_ACCELERATION * length / acceleration))


@kernel
def cruise_durations(length: float, speed: float, acceleration: float) -> tuple[float, float]:
    """Return the times, s, of a 3-4-5 move's halves together and of the cruise between them.

    The halves reach the acceleration, the cruise has the speed; a length too short for both limits
    has no cruise.
    """
    halves = PEAK_ACCELERATION * speed / (PEAK_SPEED * acceleration)
    cruise = length / speed - halves / PEAK_SPEED
    if cruise <= 0.0:
        return duration_345(length, speed, acceleration), 0.0
    return halves, cruise


@formula
def cruise_345(t: float, halves: float, cruise: float) -> tuple[float, float]:
    """Return the share of the length and its rate, 1/s, of a move with those durations."""
    more = PEAK_SPEED * cruise / halves  # of the length that the halves cover
    if 0.5 * halves < t < 0.5 * halves + cruise:
        share, rate = 0.5 + PEAK_SPEED * (t / halves - 0.5), PEAK_SPEED
    elif t <= 0.5 * halves:
        share, rate, _ = polynomial_345(t / halves)
    else:
        share, rate, _ = polynomial_345((t - cruise) / halves)
        share += more
    return share / (1.0 + more), rate / (halves * (1.0 + more))


@kernel
def polyline_345(
    t: float,
    corners: FloatArray,
    durations: FloatArray,
    cruises: FloatArray,
    position: FloatArray,
    velocity: FloatArray,
) -> None:
    """Fill position (k,) and velocity (k,) at time ``t`` of 3-4-5 moves from corner to corner.

    ``corners`` is (n, k), ``durations`` and ``cruises`` (n - 1,), see ``cruise_durations``; at rest
    at every corner.
    """
    position[:] = corners[0]
    velocity[:] = 0.0
    for i in range(durations.shape[0]):
        share, rate = cruise_345(t, durations[i], cruises[i])
        for j in range(position.shape[0]):
            side = corners[i + 1, j] - corners[i, j]
            position[j] += share * side
            velocity[j] += rate * side
        t -= durations[i] + cruises[i]


# A steady feed -----------------------------------------------------------------------------------


def ramped(times: FloatArray, duration: float, ramp: float) -> tuple[FloatArray, FloatArray]:
    """Return the way (n,), s, and the speed (n,) of a unit feed with smooth ramps at both ends.

    From rest to rest in ``duration``, s, of which each ``ramp``, s, covers half its time: the whole
    way is duration - ramp.
    """
    rise = np.clip(times / ramp, 0.0, 1.0)
    fall = np.clip((duration - times) / ramp, 0.0, 1.0)
    steady = np.clip(times - ramp, 0.0, duration - 2.0 * ramp)
    way = ramp * (_ramp_way(rise) + 0.5 - _ramp_way(fall)) + steady
    return way, np.minimum(_ramp_speed(rise), _ramp_speed(fall))


def _ramp_speed(share: FloatArray) -> FloatArray:
    """Return the 3-4-5 polynomial at shares (n,) of a ramp."""
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def _ramp_way(share: FloatArray) -> FloatArray:
    """Return its integral, 1/2 at the end."""
    return share**4 * (2.5 - 3.0 * share + share**2)
