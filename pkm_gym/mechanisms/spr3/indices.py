"""Indices of the 3-SPR at one pose, and at many in lockstep."""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import det3, dot3, squared_singular_values3
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.kinematics import (
    COS,
    SIN,
    fold_margin,
    turned,
)
from pkm_gym.mechanisms.spr3.lockstep import Lanes, filled
from pkm_gym.mechanisms.spr3.velocity import angular_velocity, jacobian_row, leg_direction


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
def conditioning_of(
    lanes: Lanes, count: int, a: float, b: float, length: float, spin: float
) -> None:
    """Fill ``lanes.local`` from the first ``count`` poses: see ``conditioning``."""
    poses, local = lanes.poses, lanes.local
    if length > 0.0:
        for k in range(filled(count)):
            pose, here = poses[k], local[k]
            here.det, here.lci = conditioning(pose.hx, pose.hy, pose.s, a, b, length, spin)
    else:
        for k in range(filled(count)):
            pose, here = poses[k], local[k]
            here.det, here.lci = conditioning(pose.hx, pose.hy, pose.s, a, b, 0.0, 1.0)


@kernel
def projections_of(lanes: Lanes, count: int, a: float, b: float) -> None:
    """Fill ``lanes.joints`` from the first ``count`` poses: see ``smallest_projections``."""
    poses, joints = lanes.poses, lanes.joints
    for k in range(filled(count)):
        pose, here = poses[k], joints[k]
        here.s_cos, here.r_sin = smallest_projections(pose.hx, pose.hy, pose.s, a, b)


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
