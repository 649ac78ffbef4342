"""The dexterity of a leg over a rectangle of theta and varphi: means, extremes, and what they mean.

The condition number has a kink at theta = 45 deg, where the columns of J stand square to each
other: a Gauss rule is split there.
"""

from __future__ import annotations

import math

import numpy as np

from pkm_gym.core.compile import formula, kernel
from pkm_gym.core.sampling import gauss_jacobi
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.kinematics import (
    Links,
    condition_number,
    crank_angles,
    cylinder_gap,
    cylinders,
    largest_singular_value,
)

KINK = 0.25 * math.pi
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
SHRINKS = 24  # of an interval of theta, to 1e-5 of its length
HALVES = 10  # of an interval of varphi
ASIDE = 1e-4  # of the swing: how far off a slope is felt


# Samples ------------------------------------------------------------------------------------------


def sample_rule(sampling: str, nodes: int, points: int) -> tuple[FloatArray, FloatArray]:
    """Return a sample of the rectangle as rows of factors, so that one rule serves all tasks.

    Returns:
        of theta: array (n, 6); a node is its first three factors times (theta_min, 45 deg,
        theta_max), its weight the last three times the same.
        of varphi: array (k, 2); a node in units of the swing, and its weight.
    """
    if sampling == "gauss":
        t, w = gauss_jacobi(nodes)
        zero = np.zeros_like(t)
        below = np.stack([1.0 - t, t, zero, -w, w, zero], axis=-1)
        above = np.stack([zero, 1.0 - t, t, zero, -w, w], axis=-1)
        return np.concatenate([below, above]), np.stack([2.0 * t - 1.0, w], axis=-1)
    steps = np.arange(points)
    t = steps / (points - 1.0) if sampling == "grid" else (steps + 0.5) / points
    w, zero = np.full(points, 1.0 / points), np.zeros(points)
    return np.stack([1.0 - t, zero, t, -w, zero, w], axis=-1), np.stack([2.0 * t - 1.0, w], axis=-1)


# One design ---------------------------------------------------------------------------------------


@kernel
def condition_moments(
    theta_min: float,
    theta_max: float,
    swing: float,
    links: Links,
    by_area: bool,
    across: FloatArray,
    along: FloatArray,
    sample: FloatArray,
) -> tuple[float, float, float]:
    """Return mean, standard deviation and least value of the sampled condition number.

    Eqs (18), (19) and (21), the second as the deviation that its text describes. ``across`` (n, 6)
    and ``along`` (k, 2) are a ``sample_rule``, ``sample`` (3, k) is scratch.
    """
    l1, ob, theta_b, l5, l6, phi, gamma = links
    sin_a, cos_a = math.sin(phi + theta_b), math.cos(phi + theta_b)
    sin_d, cos_d = math.sin(gamma), math.cos(gamma)
    square2, twice2 = l1 * l1 + ob * ob, 2.0 * l1 * ob
    square4, twice4 = l5 * l5 + l6 * l6, 2.0 * l5 * l6
    sin_v, cos_v, eta = sample[0], sample[1], sample[2]
    for j in range(along.shape[0]):
        sin_v[j], cos_v[j] = math.sin(swing * along[j, 0]), math.cos(swing * along[j, 0])
    total, squares, area, least = 0.0, 0.0, 0.0, math.inf
    for i in range(across.shape[0]):
        a, b, c, u, v, w = across[i]
        theta = a * theta_min + b * KINK + c * theta_max
        sin_t, cos_t = math.sin(theta), math.cos(theta)
        sin_2t, cos_2t = 2.0 * sin_t * cos_t, 1.0 - 2.0 * sin_t * sin_t
        weight = u * theta_min + v * KINK + w * theta_max
        if by_area:
            weight *= sin_2t
        for j in range(along.shape[0]):
            sin_s, cos_s = sin_t * cos_v[j] + cos_t * sin_v[j], cos_t * cos_v[j] - sin_t * sin_v[j]
            sin_m, cos_m = sin_t * cos_v[j] - cos_t * sin_v[j], cos_t * cos_v[j] + sin_t * sin_v[j]
            sine2 = sin_a * sin_s - cos_a * cos_s  # of theta_1 - theta_B
            cosine2 = -(sin_a * cos_s + cos_a * sin_s)
            sine4 = -(cos_m * cos_d + sin_m * sin_d)  # of theta_5
            cosine4 = sin_m * cos_d - cos_m * sin_d
            p = (twice2 * sine2) ** 2 * (square4 - twice4 * cosine4)  # p / q = (k2 / k4)^2
            q = (twice4 * sine4) ** 2 * (square2 - twice2 * cosine2)
            pq = p * q
            root = math.sqrt((p - q) ** 2 + 4.0 * pq * cos_2t * cos_2t)
            eta[j] = (p + q + root) / (2.0 * math.sqrt(pq) * sin_2t)
        area += weight
        for j in range(along.shape[0]):
            share = weight * along[j, 1]
            total += share * eta[j]
            squares += share * eta[j] * eta[j]
            least = min(least, eta[j])
    mean = total / area
    return mean, math.sqrt(max(0.0, squares / area - mean * mean)), least


@formula
def condition_at(theta: float, varphi: float, links: Links) -> float:
    """Return the condition number of J at a pose."""
    _, k2, _, k4 = cylinders(theta + varphi, theta - varphi, links)
    return condition_number(k2, k4, theta)


@kernel
def least_condition(
    theta_min: float, theta_max: float, swing: float, links: Links, along: FloatArray
) -> float:
    """Return the smallest condition number over the rectangle, eq. (21).

    1 where |k2| - |k4| changes sign on the line theta = 45 deg; else the least on the edges
    varphi = +-swing, or between them where it falls inwards from one (cranks of unlike lengths).
    """
    signs = 0.0
    for j in range(along.shape[0] + 2):
        inner = min(max(j - 1, 0), along.shape[0] - 1)
        at = -1.0 if j == 0 else (1.0 if j == along.shape[0] + 1 else along[inner, 0])
        _, k2, _, k4 = cylinders(KINK + at * swing, KINK - at * swing, links)
        sign = 1.0 if abs(k2) > abs(k4) else -1.0
        if j > 0 and sign != signs:
            return 1.0
        signs = sign
    low, high = -swing, swing
    theta, left = least_at(theta_min, theta_max, low, links)
    inwards = condition_at(theta, low + ASIDE * swing, links) < left
    theta, right = least_at(theta_min, theta_max, high, links)
    inwards = inwards or condition_at(theta, high - ASIDE * swing, links) < right
    least = min(left, right)
    for _ in range(HALVES if inwards else 0):
        varphi = 0.5 * (low + high)
        theta, here = least_at(theta_min, theta_max, varphi, links)
        least = min(least, here)
        if condition_at(theta, varphi + ASIDE * swing, links) < here:
            low = varphi
        else:
            high = varphi
    return least


@kernel
def least_at(
    theta_min: float, theta_max: float, varphi: float, links: Links
) -> tuple[float, float]:
    """Return the theta of the smallest condition number at one varphi, and that number.

    By the golden section.
    """
    low, high = theta_min, theta_max
    first, second = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    at_first = condition_at(first, varphi, links)
    at_second = condition_at(second, varphi, links)
    for _ in range(SHRINKS):
        if at_first < at_second:
            high, second, at_second = second, first, at_first
            first = high - GOLDEN * (high - low)
            at_first = condition_at(first, varphi, links)
        else:
            low, first, at_first = first, second, at_second
            second = low + GOLDEN * (high - low)
            at_second = condition_at(second, varphi, links)
    return (first, at_first) if at_first < at_second else (second, at_second)


@kernel
def worst_force(
    theta_min: float, theta_max: float, swing: float, side: float, links: Links
) -> float:
    """Return the largest sigma_max(J) over the rectangle: at one of its corners."""
    worst = 0.0
    for theta in (theta_min, theta_max):
        for varphi in (-swing, swing):
            _, k2, _, k4 = cylinders(theta + varphi, theta - varphi, links)
            worst = max(worst, largest_singular_value(k2, k4, theta, side))
    return worst


@kernel
def smallest_gap(theta_min: float, theta_max: float, swing: float, links: Links) -> float:
    """Return the smallest distance of the cylinders over the rectangle, m: at a corner of it."""
    gap = math.inf
    for theta in (theta_min, theta_max):
        for varphi in (-swing, swing):
            gap = min(gap, cylinder_gap(theta + varphi, theta - varphi, links))
    return gap


@kernel
def crank_ranges(
    theta_min: float, theta_max: float, swing: float, links: Links
) -> tuple[float, float, float, float]:
    """Return the least and largest angle from OB to OA, and from OC to OD, over the rectangle."""
    _, _, theta_b, _, _, phi, gamma = links
    low, high = theta_min - swing, theta_max + swing
    a_max, d_min = crank_angles(low, low, theta_b, phi, gamma)
    a_min, d_max = crank_angles(high, high, theta_b, phi, gamma)
    return a_min, a_max, d_min, d_max


# What |k2| = |k4| everywhere would give -----------------------------------------------------------


@kernel
def reference_moments(theta_min: float, theta_max: float, by_area: bool) -> tuple[float, float]:
    """Return mean and standard deviation of max(tan theta, cot theta), in closed form.

    The condition number where |k2| = |k4|: a yardstick, no bound.
    """
    low = _below(theta_min, by_area)
    kink_below, kink_above = _below(KINK, by_area), _above(KINK, by_area)
    high = _above(theta_max, by_area)
    if by_area:
        area = 0.5 * (math.cos(2.0 * theta_min) - math.cos(2.0 * theta_max))
    else:
        area = theta_max - theta_min
    mean = (kink_below[0] - low[0] + high[0] - kink_above[0]) / area
    square = (kink_below[1] - low[1] + high[1] - kink_above[1]) / area
    return mean, math.sqrt(square - mean * mean)


@kernel
def _below(theta: float, by_area: bool) -> tuple[float, float]:
    """Return the antiderivatives of cot and cot^2, times sin(2 theta) if by area."""
    sine, cosine = math.sin(theta), math.cos(theta)
    if by_area:
        return theta + sine * cosine, 2.0 * math.log(sine) - sine * sine
    return math.log(sine), -cosine / sine - theta


@kernel
def _above(theta: float, by_area: bool) -> tuple[float, float]:
    """Return the antiderivatives of tan and tan^2, times sin(2 theta) if by area."""
    sine, cosine = math.sin(theta), math.cos(theta)
    if by_area:
        return theta - sine * cosine, -2.0 * math.log(cosine) + cosine * cosine
    return -math.log(cosine), sine / cosine - theta


# The paper's objective ----------------------------------------------------------------------------


@formula
def tolerance_weighted(
    eta_P: float,
    eta_FC: float,
    eta_DL: float,
    mu: FloatArray,
) -> float:
    """Return lambda, eq. (22)."""
    return math.sqrt((mu[0] * eta_P) ** 2 + (mu[1] * eta_FC) ** 2 + (mu[2] * eta_DL) ** 2)


def tolerance_weights(
    ranges: tuple[tuple[float, float], ...], powers: tuple[int, ...] = (1, 1, 2)
) -> tuple[float, ...]:
    """Return the weights mu of eqs (23)-(25): 1 / ((max - min) / 2) to a power.

    The paper prints the square of all three; its numbers are the square of mu_3 alone, the
    ``powers`` by default.

    Args:
        ranges: (min, max) of eta_P, eta_FC and eta_DL over the sweeps.
        powers: of each.

    Raises:
        ValueError: for a range that is none.
    """
    for low, high in ranges:
        if not low < high:
            raise ValueError(f"the range ({low:g}, {high:g}) is empty: its maximum must be larger")
    return tuple(
        (2.0 / (high - low)) ** power for (low, high), power in zip(ranges, powers, strict=True)
    )
