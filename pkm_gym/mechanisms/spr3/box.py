"""Indices of the 3-SPR over its joint box: corners, edges and means, the poses in lockstep."""

from __future__ import annotations

import math

import numpy as np

from pkm_gym.core.compile import kernel
from pkm_gym.core.sampling import lowest_of_five
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.indices import conditioning_of, parasitic, projections_of
from pkm_gym.mechanisms.spr3.kinematics import fold_margin
from pkm_gym.mechanisms.spr3.lockstep import Lanes, solve

# A part of the joint box thinner than this share of it counts for nothing.
SMALLEST_PART = 1e-9

# Points of the joint box in units of lam q_c around q_c: the corners that symmetry leaves, and
# samples of the two edges (-1, -1, t) and (-1, t, 1) between these. Kernels take them as arguments:
# a loop whose few rounds are known beforehand isn't vectorised.
CORNERS = np.array([(-1.0, -1.0, -1.0), (-1.0, -1.0, 1.0), (-1.0, 1.0, 1.0), (1.0, 1.0, 1.0)])
BETWEEN = (-0.5, 0.0, 0.5)
EDGES = np.array([(-1.0, -1.0, t) for t in BETWEEN] + [(-1.0, t, 1.0) for t in BETWEEN])


@kernel
def _solve_at(at: FloatArray, a: float, b: float, q_c: float, lam: float, lanes: Lanes) -> None:
    """Fill the lanes' poses and joints at points ``at`` (n, 3) of the box."""
    count = at.shape[0]
    for k in range(count):
        leg = lanes.legs[k]
        leg.q1 = q_c * (1.0 + lam * at[k, 0])
        leg.q2 = q_c * (1.0 + lam * at[k, 1])
        leg.q3 = q_c * (1.0 + lam * at[k, 2])
    solve(lanes, count, q_c, a, b)
    projections_of(lanes, count, a, b)


@kernel
def corners(
    a: float,
    b: float,
    q_c: float,
    lam: float,
    length: float,
    spin: float,
    at: FloatArray,
    lanes: Lanes,
    sines: FloatArray,
) -> tuple[float, float, float, float, float, float]:
    """Return what the corners of the joint box say; legs from q_c (1 - lam) to q_c (1 + lam).

    ``at`` are ``CORNERS``, each reached by the straight joint path from home. The extremes over the
    box lie there, but for the R joint's: its sines there are kept at the ends of ``sines`` (2, 5),
    for ``smallest_revolute_sine``.

    Returns:
        the mean share of the paths followed; and over the corners the smallest det J, fold margin
        and local conditioning index, the largest parasitic offset, the smallest S cosine, where
        all are reached.
    """
    share = offset = 0.0
    det = fold = lci = s_cos = math.inf
    count = at.shape[0]
    _solve_at(at, a, b, q_c, lam, lanes)
    conditioning_of(lanes, count, a, b, length, spin)
    for k in range(count):
        pose, local = lanes.poses[k], lanes.local[k]
        share += pose.done / count
        det, lci = min(det, local.det), min(lci, local.lci)
        fold = min(fold, fold_margin(pose.hx, pose.hy, pose.s, b))
        offset = max(offset, parasitic(pose.hx, pose.hy, b))
        s_cos = min(s_cos, lanes.joints[k].s_cos)
    for edge in range(2):
        sines[edge, 0] = lanes.joints[edge].r_sin
        sines[edge, 4] = lanes.joints[edge + 1].r_sin
    return share, det, fold, lci, offset, s_cos


@kernel
def smallest_revolute_sine(
    a: float,
    b: float,
    q_c: float,
    lam: float,
    at: FloatArray,
    lanes: Lanes,
    sines: FloatArray,
) -> float:
    """Return the smallest sine of the R joints over the box: it lies on one of two edges.

    ``at`` are ``EDGES``, three samples of each, and ``corners`` has kept those at their ends; one
    more is taken at the vertex of the parabola through the lowest three.
    """
    _solve_at(at, a, b, q_c, lam, lanes)
    again = np.zeros_like(at)  # the others stay at home
    for edge in range(2):
        for k in range(3):
            sines[edge, k + 1] = lanes.joints[3 * edge + k].r_sin
        again[3 * edge] = at[3 * edge]
        again[3 * edge, 2 - edge] = 0.5 * lowest_of_five(sines[edge])[1] - 1.0
    _solve_at(again, a, b, q_c, lam, lanes)
    return min(sines.min(), lanes.joints[0].r_sin, lanes.joints[3].r_sin)


@kernel
def isotropic_leg(a: float, b: float) -> float:
    """Return the length of three equal legs at which J is isotropic, m: z = b / sqrt(2)."""
    return math.sqrt((b - a) * (b - a) + 0.5 * b * b)


@kernel
def box_means(
    a: float,
    b: float,
    q_c: float,
    lam: float,
    length: float,
    spin: float,
    nodes: FloatArray,
    weights: FloatArray,
    lanes: Lanes,
) -> tuple[float, float, float, float]:
    """Return the share of the nodes reached, smallest det J, volume, mean conditioning index.

    The volume of the workspace is the integral of 1 / det J over the joint box, and the index is
    weighted with it. ``nodes`` (k, 3) and ``weights`` (k,) are those of ``symmetric_cube``, reached
    by straight joint paths from home. The index has a cusp at the isotropic pose: where the box
    holds it, it is cut there in two.
    """
    cut = 1.0
    if length == 0.0:
        cut = min(1.0, max(-1.0, (isotropic_leg(a, b) / q_c - 1.0) / lam))
    below = _part_means(a, b, q_c, lam, length, spin, nodes, weights, lanes, -1.0, cut)
    above = _part_means(a, b, q_c, lam, length, spin, nodes, weights, lanes, cut, 1.0)
    volume = below[2] + above[2]
    return (
        min(below[0], above[0]),
        min(below[1], above[1]),
        volume * (2.0 * q_c * lam) ** 3,
        (below[3] + above[3]) / volume,
    )


@kernel
def _part_means(
    a: float,
    b: float,
    q_c: float,
    lam: float,
    length: float,
    spin: float,
    nodes: FloatArray,
    weights: FloatArray,
    lanes: Lanes,
    start: float,
    end: float,
) -> tuple[float, float, float, float]:
    """Return the same over the part of the cube that stands on its diagonal from start to end."""
    smallest, volume, mean = math.inf, 0.0, 0.0
    half, middle = 0.5 * (end - start), 0.5 * (end + start)
    if half < SMALLEST_PART:
        return 1.0, smallest, volume, mean
    count = nodes.shape[0]
    for k in range(count):
        leg = lanes.legs[k]
        center = 0.5 * (nodes[k, 0] + nodes[k, 2])
        radius = 0.5 * (nodes[k, 2] - nodes[k, 0])
        shift = 1.0 + lam * ((1.0 - radius) * middle + (half - 1.0) * center)
        leg.q1 = q_c * (shift + lam * nodes[k, 0])
        leg.q2 = q_c * (shift + lam * nodes[k, 1])
        leg.q3 = q_c * (shift + lam * nodes[k, 2])
    solve(lanes, count, q_c, a, b)
    conditioning_of(lanes, count, a, b, length, spin)
    for k in range(count):
        if lanes.poses[k].done < 1.0:
            return k / count, smallest, volume, mean
        det, lci = lanes.local[k].det, lanes.local[k].lci
        part = half * weights[k] / abs(det)
        smallest = min(smallest, det)
        volume += part
        mean += part * lci
    return 1.0, smallest, volume, mean
