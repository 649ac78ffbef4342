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

# The most poses at corners and edges of the joint box that are looked at together.
SAMPLES = 10


@kernel
def corners(
    a: float, b: float, q_c: float, lam: float, length: float, spin: float, lanes: Lanes
) -> tuple[float, float, float, float, float, float]:
    """Return what the corners of the joint box say; legs from q_c (1 - lam) to q_c (1 + lam).

    The four corners that symmetry leaves, each reached by the straight joint path from home. The
    extremes over the box lie there, but for the R joint's.

    Returns:
        the mean share of the paths followed; and over the corners the smallest det J, fold margin
        and local conditioning index, the largest parasitic offset, the smallest S cosine, where
        all are reached.
    """
    low, high = q_c * (1.0 - lam), q_c * (1.0 + lam)
    share = offset = 0.0
    det = fold = lci = s_cos = math.inf
    for raised in range(4):
        leg = lanes.legs[raised]
        leg.q1 = high if raised > 2 else low
        leg.q2 = high if raised > 1 else low
        leg.q3 = high if raised > 0 else low
    solve(lanes, 4, q_c, a, b)
    conditioning_of(lanes, 4, a, b, length, spin)
    for k in range(4):
        pose, local = lanes.poses[k], lanes.local[k]
        share += 0.25 * pose.done
        det, lci = min(det, local.det), min(lci, local.lci)
        fold = min(fold, fold_margin(pose.hx, pose.hy, pose.s, b))
        offset = max(offset, parasitic(pose.hx, pose.hy, b))
    projections_of(lanes, 4, a, b)
    for k in range(4):
        s_cos = min(s_cos, lanes.joints[k].s_cos)
    return share, det, fold, lci, offset, s_cos


@kernel
def _sines_on_edges(
    at: FloatArray, a: float, b: float, q_c: float, lam: float, lanes: Lanes, sines: FloatArray
) -> None:
    """Fill ``sines`` (2, n): the smallest R sine at ``at`` (2, n), -1 to 1, of the box's two edges.

    The edges are (-1, -1, t) and (-1, t, 1).
    """
    n = at.shape[1]
    low, high = q_c * (1.0 - lam), q_c * (1.0 + lam)
    for k in range(n):
        one, other = lanes.legs[k], lanes.legs[n + k]
        one.q1, one.q2, one.q3 = low, low, q_c * (1.0 + lam * at[0, k])
        other.q1, other.q2, other.q3 = low, q_c * (1.0 + lam * at[1, k]), high
    solve(lanes, 2 * n, q_c, a, b)
    projections_of(lanes, 2 * n, a, b)
    for k in range(n):
        sines[0, k], sines[1, k] = lanes.joints[k].r_sin, lanes.joints[n + k].r_sin


@kernel
def smallest_revolute_sine(a: float, b: float, q_c: float, lam: float, lanes: Lanes) -> float:
    """Return the smallest sine of the R joints over the box: it lies on one of two edges.

    Five samples an edge, and one more at the vertex of the parabola through the lowest three.
    """
    at, sines = np.empty((2, 5)), np.empty((2, 5))
    for k in range(5):
        at[:, k] = 0.5 * k - 1.0
    _sines_on_edges(at, a, b, q_c, lam, lanes, sines)
    smallest = math.inf
    for edge in range(2):
        lowest, vertex = lowest_of_five(sines[edge])
        smallest = min(smallest, sines[edge, lowest])
        at[edge, 0] = 0.5 * vertex - 1.0
    _sines_on_edges(at[:, :1], a, b, q_c, lam, lanes, sines)
    return min(smallest, sines[0, 0], sines[1, 0])


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
