"""Indices of the 3-SPR: at one pose, and over its joint box."""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import det3, dot3, squared_singular_values3
from pkm_gym.core.sampling import lowest_of_five
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.kinematics import (
    COS,
    SIN,
    fold_margin,
    follow,
    level,
    turned,
)
from pkm_gym.mechanisms.spr3.velocity import angular_velocity, jacobian_row, leg_direction

# A part of the joint box thinner than this share of it counts for nothing.
SMALLEST_PART = 1e-9


@kernel
def homogeneous(code: int, a: float, b: float, D: float) -> tuple[float, float]:
    """Return (length, spin) of a Jacobian, by its place in ``JACOBIANS``: see ``conditioning``.

    "velocity": of O_A. "tilt-a", "tilt-b", "tilt-D": (length omega, w . v) with that length.
    "points": the velocities of the three A_i along w; their norm is sqrt(3) times that of
    (a / sqrt(2) omega, w . v) without omega's part along w.
    """
    if code == 0:
        return 0.0, 1.0
    if code == 4:
        return a * math.sqrt(0.5), 0.0
    return (a, b, D)[code - 1], 1.0


@formula
def conditioning(
    hx: float, hy: float, s: float, a: float, b: float, length: float, spin: float
) -> tuple[float, float]:
    """Return det J and the local conditioning index, smallest over largest singular value.

    J maps the velocity of O_A to the leg rates. With ``length`` > 0 (m) the index is that of the
    Jacobian of (length omega, w . v) instead; ``spin`` 0 leaves omega's part along w out.
    """
    ux, uy, uz, vx, vy, vz = angular_velocity(hx, hy, s, b)
    ax, ay, az = jacobian_row(hx, hy, s, a, b, COS[0], SIN[0], ux, uy, vx, vy)
    bx, by, bz = jacobian_row(hx, hy, s, a, b, COS[1], SIN[1], ux, uy, vx, vy)
    cx, cy, cz = jacobian_row(hx, hy, s, a, b, COS[2], SIN[2], ux, uy, vx, vy)
    det = det3(ax, ay, az, bx, by, bz, cx, cy, cz)
    scaled = det
    if length > 0.0:  # |(length omega, w . v)|^2 = |T v|^2, T upper triangular: rows times T^-1
        uz, vz = spin * uz, spin * vz
        t11 = length * math.sqrt(dot3(ux, uy, uz, ux, uy, uz))
        t12 = length * length * dot3(ux, uy, uz, vx, vy, vz) / t11
        t22 = math.sqrt(length * length * dot3(vx, vy, vz, vx, vy, vz) - t12 * t12)
        ax, bx, cx = ax / t11, bx / t11, cx / t11
        ay, by, cy = (ay - t12 * ax) / t22, (by - t12 * bx) / t22, (cy - t12 * cx) / t22
        scaled = det / (t11 * t22)
    largest, _, smallest = squared_singular_values3(
        dot3(ax, ay, az, ax, ay, az), dot3(bx, by, bz, bx, by, bz), dot3(cx, cy, cz, cx, cy, cz),
        dot3(ax, ay, az, bx, by, bz), dot3(ax, ay, az, cx, cy, cz), dot3(bx, by, bz, cx, cy, cz),
        scaled * scaled,
    )  # fmt: skip
    return det, math.sqrt(smallest / largest)


@formula
def joint_projections(
    hx: float, hy: float, s: float, a: float, b: float, cos: float, sin: float
) -> tuple[float, float]:
    """Return the cosine of the S joint's and the sine of the R joint's angle of a limb.

    S: from the base's normal to the leg. R: from the platform's plane to the leg.
    """
    wx, wy, wz = turned(hx, hy, 0.0, 0.0, 1.0)
    along, up, _ = leg_direction(hx, hy, s, a, b, cos, sin)
    return up * wz - along * (cos * wx + sin * wy), up


@formula
def smallest_projections(hx: float, hy: float, s: float, a: float, b: float) -> tuple[float, float]:
    """Return the smallest S cosine and the smallest R sine of the three limbs."""
    s1, r1 = joint_projections(hx, hy, s, a, b, COS[0], SIN[0])
    s2, r2 = joint_projections(hx, hy, s, a, b, COS[1], SIN[1])
    s3, r3 = joint_projections(hx, hy, s, a, b, COS[2], SIN[2])
    return min(s1, s2, s3), min(r1, r2, r3)


@formula
def parasitic(hx: float, hy: float, b: float) -> float:
    """Return p = (b/2)(1 - cos tilt), m: the distance of the platform's normal from O_B."""
    h2 = hx * hx + hy * hy
    return b * h2 / (1.0 + h2)


@kernel
def corners(
    a: float, b: float, q_c: float, lam: float, length: float, spin: float
) -> tuple[float, float, float, float, float, float]:
    """Return what the corners of the joint box say; legs from q_c (1 - lam) to q_c (1 + lam).

    The four corners that symmetry leaves, each reached by the straight joint path from home. The
    extremes over the box lie there, but for the R joint's.

    Returns:
        the mean share of the paths followed; and over the corners reached the smallest det J, fold
        margin and local conditioning index, the largest parasitic offset, the smallest S cosine.
    """
    s0 = level(q_c, a, b)
    low, high = q_c * (1.0 - lam), q_c * (1.0 + lam)
    share = offset = 0.0
    det = fold = lci = s_cos = math.inf
    for raised in range(4):
        q1 = high if raised > 2 else low
        q2 = high if raised > 1 else low
        q3 = high if raised > 0 else low
        hx, hy, s, done = follow(0.0, 0.0, s0, q_c, q_c, q_c, q1, q2, q3, a, b)
        share += 0.25 * done
        if done == 1.0:
            det_here, lci_here = conditioning(hx, hy, s, a, b, length, spin)
            s_here, _ = smallest_projections(hx, hy, s, a, b)
            det, lci = min(det, det_here), min(lci, lci_here)
            fold = min(fold, fold_margin(hx, hy, s, b))
            offset = max(offset, parasitic(hx, hy, b))
            s_cos = min(s_cos, s_here)
    return share, det, fold, lci, offset, s_cos


@kernel
def _sine_on_edge(t: float, mixed: bool, a: float, b: float, q_c: float, lam: float) -> float:
    """Return the smallest R sine at t from -1 to 1 of the box's edge (-1, -1, t) or (-1, t, 1)."""
    q1 = q_c * (1.0 - lam)
    q2 = q_c * (1.0 + lam * t) if mixed else q1
    q3 = q_c * (1.0 + lam) if mixed else q_c * (1.0 + lam * t)
    hx, hy, s, _ = follow(0.0, 0.0, level(q_c, a, b), q_c, q_c, q_c, q1, q2, q3, a, b)
    return smallest_projections(hx, hy, s, a, b)[1]


@kernel
def smallest_revolute_sine(a: float, b: float, q_c: float, lam: float) -> float:
    """Return the smallest sine of the R joints over the box: it lies on one of two edges.

    Five samples an edge, and one more at the vertex of the parabola through the lowest three.
    """
    smallest = math.inf
    samples = np.empty(5)
    for mixed in (False, True):
        for k in range(5):
            samples[k] = _sine_on_edge(0.5 * k - 1.0, mixed, a, b, q_c, lam)
        at, vertex = lowest_of_five(samples)
        again = _sine_on_edge(0.5 * vertex - 1.0, mixed, a, b, q_c, lam)
        smallest = min(smallest, samples[at], again)
    return smallest


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
) -> tuple[float, float, float, float]:
    """Return the share of the nodes reached, smallest det J, volume, mean conditioning index.

    The volume of the workspace is the integral of 1 / det J over the joint box, and the index is
    weighted with it. ``nodes`` (k, 3) and ``weights`` (k,) are those of ``symmetric_cube``, visited
    one after the other by straight paths within the box. The index has a cusp at the isotropic
    pose: where the box holds it, it is cut there in two.
    """
    cut = 1.0
    if length == 0.0:
        cut = min(1.0, max(-1.0, (isotropic_leg(a, b) / q_c - 1.0) / lam))
    below = _part_means(a, b, q_c, lam, length, spin, nodes, weights, -1.0, cut)
    above = _part_means(a, b, q_c, lam, length, spin, nodes, weights, cut, 1.0)
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
    start: float,
    end: float,
) -> tuple[float, float, float, float]:
    """Return the same over the part of the cube that stands on its diagonal from start to end."""
    smallest, volume, mean = math.inf, 0.0, 0.0
    half, middle = 0.5 * (end - start), 0.5 * (end + start)
    if half < SMALLEST_PART:
        return 1.0, smallest, volume, mean
    hx, hy, s = 0.0, 0.0, level(q_c, a, b)
    p1 = p2 = p3 = q_c
    for k in range(nodes.shape[0]):
        center = 0.5 * (nodes[k, 0] + nodes[k, 2])
        radius = 0.5 * (nodes[k, 2] - nodes[k, 0])
        shift = 1.0 + lam * ((1.0 - radius) * middle + (half - 1.0) * center)
        q1 = q_c * (shift + lam * nodes[k, 0])
        q2 = q_c * (shift + lam * nodes[k, 1])
        q3 = q_c * (shift + lam * nodes[k, 2])
        hx, hy, s, done = follow(hx, hy, s, p1, p2, p3, q1, q2, q3, a, b)
        p1, p2, p3 = q1, q2, q3
        if done < 1.0:
            return k / nodes.shape[0], smallest, volume, mean
        det, lci = conditioning(hx, hy, s, a, b, length, spin)
        part = half * weights[k] / abs(det)
        smallest = min(smallest, det)
        volume += part
        mean += part * lci
    return 1.0, smallest, volume, mean


LOCAL = ("lci", "det", "fold", "parasitic", "tilt", "s_angle", "r_angle")


@batch_kernel
def local_indices_batch(
    poses: FloatArray, a: float, b: float, length: float, spin: float, out: FloatArray
) -> None:
    """Fill ``out`` (n, 7), named by ``LOCAL``, from ``poses`` (n, 3); joint angles: the worst."""
    for k in numba.prange(poses.shape[0]):
        hx, hy, s = poses[k]
        out[k, 1], out[k, 0] = conditioning(hx, hy, s, a, b, length, spin)
        out[k, 2] = fold_margin(hx, hy, s, b)
        out[k, 3] = parasitic(hx, hy, b)
        out[k, 4] = 2.0 * math.atan(math.hypot(hx, hy))
        s_cos, r_sin = smallest_projections(hx, hy, s, a, b)
        out[k, 5] = math.acos(min(1.0, max(-1.0, s_cos)))
        out[k, 6] = math.asin(min(1.0, max(-1.0, r_sin)))


@batch_kernel
def joint_angles_batch(poses: FloatArray, a: float, b: float, angles: FloatArray) -> None:
    """Fill ``angles`` (n, 2, 3), rad: the S joints' and the R joints', limb by limb."""
    for k in numba.prange(poses.shape[0]):
        hx, hy, s = poses[k]
        for i in range(3):
            s_cos, r_sin = joint_projections(hx, hy, s, a, b, COS[i], SIN[i])
            angles[k, 0, i] = math.acos(min(1.0, max(-1.0, s_cos)))
            angles[k, 1, i] = math.asin(min(1.0, max(-1.0, r_sin)))
