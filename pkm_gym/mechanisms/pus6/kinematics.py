"""Geometry of the 6-PUS: one pose at a time, compiled.

Frame {B}: z up, x and y horizontal, the origin on the machine's axis at the platform's centre (the
tool's tip) at home. Slider i moves along z at the azimuth phi_Bi on the radius r_B; the S joint i
stands at the azimuth phi_Pi on the radius R of the platform; the rod of length L hangs from the
slider. A pose is (x, y, z, alpha, beta, gamma) with the rotation Rx(alpha) Ry(beta) Rz(gamma).
"""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.influence import Leg, Legs, inverse_row

THIRD = 2.0 * math.pi / 3.0

# What a layout holds: of each leg the S joint on the platform (3) and the screw (2).
PER_LEG = 5
Rotation = tuple[float, float, float, float, float, float, float, float, float]

CONVERGED = 1e-14  # of Newton's last correction, m and rad
ITERATIONS = 30
LARGEST_CORRECTION = 0.2  # m and rad: further, the start was too far away
SMALLEST_STEP = 1.0 / 1024.0  # of a path


@kernel
def lay_out(
    layout: FloatArray, R: float, r_B: float, phi_A: float, phi_C: float, tool: float
) -> None:
    """Fill ``layout`` (30,): of each leg the S joint in the platform (3) and the screw's x, y, m.

    The origin of the platform's frame is the tool's tip. The paper's azimuths, for phi_A = 15 and
    phi_C = 30 deg: screws 82.5, 97.5, 202.5 ..., joints 45, 135, 165, 255, 285, 15 deg.
    """
    half = 0.5 * phi_C
    for i in range(6):
        column = 0.5 * math.pi + THIRD * (i // 2)
        screw = column - 0.5 * phi_A if i % 2 == 0 else column + 0.5 * phi_A
        corner = math.pi / 6.0 + THIRD * ((i + 1) // 2)
        joint = corner + half if i % 2 == 0 else corner - half
        layout[PER_LEG * i] = R * math.cos(joint)
        layout[PER_LEG * i + 1] = R * math.sin(joint)
        layout[PER_LEG * i + 2] = tool
        layout[PER_LEG * i + 3] = r_B * math.cos(screw)
        layout[PER_LEG * i + 4] = r_B * math.sin(screw)


@formula
def home_drop(L: float, R: float, r_B: float, phi_A: float, phi_C: float) -> float:
    """Return h0, m: how far each slider is above its S joint at home; NaN out of reach."""
    apart = math.pi / 3.0 - 0.5 * (phi_A + phi_C)  # 37.5 deg for the paper's angles
    return math.sqrt(L * L - (r_B * r_B + R * R - 2.0 * r_B * R * math.cos(apart)))


@formula
def rotation(
    sin_a: float, cos_a: float, sin_b: float, cos_b: float, sin_g: float, cos_g: float
) -> Rotation:
    """Return Rx(alpha) Ry(beta) Rz(gamma), row by row."""
    return (
        cos_b * cos_g, -cos_b * sin_g, sin_b,
        cos_a * sin_g + sin_a * sin_b * cos_g, cos_a * cos_g - sin_a * sin_b * sin_g,
        -sin_a * cos_b,
        sin_a * sin_g - cos_a * sin_b * cos_g, sin_a * cos_g + cos_a * sin_b * sin_g,
        cos_a * cos_b,
    )  # fmt: skip


@formula
def leg(
    px: float,
    py: float,
    pz: float,
    ax: float,
    ay: float,
    x: float,
    y: float,
    r: Rotation,
    L2: float,
) -> Leg:
    """Return a leg's arm c_i and rod l_i, m; the rod's drop is NaN out of reach."""
    cx = r[0] * px + r[1] * py + r[2] * pz
    cy = r[3] * px + r[4] * py + r[5] * pz
    cz = r[6] * px + r[7] * py + r[8] * pz
    hx, hy = x + cx - ax, y + cy - ay
    return cx, cy, cz, hx, hy, -math.sqrt(L2 - hx * hx - hy * hy)


@formula
def legs_at(layout: FloatArray, x: float, y: float, r: Rotation, L2: float) -> Legs:
    """Return arms and rods of all legs of a ``layout`` (30,)."""
    p = layout
    return (
        leg(p[0], p[1], p[2], p[3], p[4], x, y, r, L2),
        leg(p[5], p[6], p[7], p[8], p[9], x, y, r, L2),
        leg(p[10], p[11], p[12], p[13], p[14], x, y, r, L2),
        leg(p[15], p[16], p[17], p[18], p[19], x, y, r, L2),
        leg(p[20], p[21], p[22], p[23], p[24], x, y, r, L2),
        leg(p[25], p[26], p[27], p[28], p[29], x, y, r, L2),
    )


@formula
def slider(leg: Leg) -> float:
    """Return the height of a slider over the platform's origin, m."""
    return leg[2] - leg[5]


@kernel
def rotation_of(pose: FloatArray) -> Rotation:
    """Return the rotation of a pose (6,), row by row."""
    a, b, g = pose[3], pose[4], pose[5]
    return rotation(math.sin(a), math.cos(a), math.sin(b), math.cos(b), math.sin(g), math.cos(g))


@kernel
def sliders(legs: Legs, z: float, home: float, q: FloatArray) -> None:
    """Fill q (6,), m: the sliders' heights over those of home, where they are at ``home``."""
    for i in range(6):
        q[i] = z + slider(legs[i]) - home


@kernel
def fill_inverse_row(leg: Leg, row: FloatArray) -> None:
    """Fill a leg's row (6,) of G^-1."""
    row[0], row[1], row[2], row[3], row[4] = inverse_row(leg)
    row[5] = 1.0


# Forward kinematics -------------------------------------------------------------------------------


@kernel
def correction(
    pose: FloatArray, q: FloatArray, layout: FloatArray, L2: float, home: float, row: FloatArray,
    matrix: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Correct a pose (6,) by one Newton step towards sliders q (6,): its size and det G^-1.

    ``row`` (6,) and ``matrix`` (6, 6) are scratch. Solves G^-1 (omega, v) = q - q(pose).
    """
    r = rotation_of(pose)
    legs = legs_at(layout, pose[0], pose[1], r, L2)
    for i in range(6):
        fill_inverse_row(legs[i], matrix[i])
        row[i] = q[i] - (pose[2] + slider(legs[i]) - home)
    if not math.isfinite(matrix.sum() + row.sum()):  # out of reach
        return math.inf, 0.0
    det = np.linalg.det(matrix)
    if not abs(det) > 0.0:
        return math.inf, 0.0
    step = np.linalg.solve(matrix, row)
    size = np.max(np.abs(step))
    if not size < LARGEST_CORRECTION:
        return math.inf, det
    wx, wy, wz = step[0], step[1], step[2]
    alpha, beta, gamma = euler_rates(pose, wx, wy, wz)
    pose[0] += step[3]
    pose[1] += step[4]
    pose[2] += step[5]
    pose[3] += alpha
    pose[4] += beta
    pose[5] += gamma
    return size, det


@kernel
def euler_rates(pose: FloatArray, wx: float, wy: float, wz: float) -> tuple[float, float, float]:
    """Return the rates of alpha, beta and gamma at a pose (6,) that turns with omega."""
    sin_a, cos_a = math.sin(pose[3]), math.cos(pose[3])
    across = cos_a * wz - sin_a * wy  # of omega, square to y' and in the plane of x and z'
    gamma = across / math.cos(pose[4])
    return wx - gamma * math.sin(pose[4]), cos_a * wy + sin_a * wz, gamma


@kernel
def follow(
    pose: FloatArray, start: FloatArray, end: FloatArray, layout: FloatArray, L2: float, home: float
) -> bool:
    """Follow the straight slider path from ``start`` (6,), where ``pose`` (6,) is, to ``end``.

    Returns whether it came there; a direct singularity bars the way.
    """
    row, matrix, trial = np.empty(6), np.empty((6, 6)), np.empty(6)
    target = np.empty(6)
    trial[:] = pose
    _, side = correction(trial, start, layout, L2, home, row, matrix)
    done, step = 0.0, 1.0
    while done < 1.0:
        t = min(1.0, done + step)
        for i in range(6):
            target[i] = start[i] + t * (end[i] - start[i])
        trial[:] = pose
        before, found = math.inf, False
        for _ in range(ITERATIONS):
            size, det = correction(trial, target, layout, L2, home, row, matrix)
            if not (det * side > 0.0 and size < before):
                found = before < 1e3 * CONVERGED and det * side > 0.0
                break
            before = size
            if size < CONVERGED:
                found = True
                break
        if found:
            pose[:] = trial
            done, step = t, 2.0 * step
        else:
            step *= 0.5
            if step < SMALLEST_STEP:
                return False
    return True


# Many poses ---------------------------------------------------------------------------------------


@batch_kernel
def inverse_kinematics_batch(
    poses: FloatArray, layout: FloatArray, L: float, home: float, joints: FloatArray
) -> None:
    """Fill ``joints`` (n, 6), m, from ``poses`` (n, 6); NaN out of reach."""
    for k in numba.prange(poses.shape[0]):
        legs = legs_at(layout, poses[k, 0], poses[k, 1], rotation_of(poses[k]), L * L)
        sliders(legs, poses[k, 2], home, joints[k])
        if math.isnan(joints[k].sum()):
            joints[k, :] = math.nan


@batch_kernel
def forward_kinematics_batch(
    joints: FloatArray,
    near: FloatArray,
    layout: FloatArray,
    L: float,
    home: float,
    poses: FloatArray,
) -> None:
    """Fill ``poses`` (n, 6) from ``joints`` (n, 6), m, along paths from the poses ``near`` (n, 6).

    NaN where a direct singularity bars the way.
    """
    for k in numba.prange(joints.shape[0]):
        start = np.empty(6)
        poses[k] = near[k]
        legs = legs_at(layout, near[k, 0], near[k, 1], rotation_of(near[k]), L * L)
        sliders(legs, near[k, 2], home, start)
        if not follow(poses[k], start, joints[k], layout, L * L, home):
            poses[k, :] = math.nan


@batch_kernel
def legs_batch(poses: FloatArray, layout: FloatArray, L: float, found: FloatArray) -> None:
    """Fill ``found`` (n, 6, 6) with each leg's arm and rod, m, at ``poses`` (n, 6)."""
    for k in numba.prange(poses.shape[0]):
        legs = legs_at(layout, poses[k, 0], poses[k, 1], rotation_of(poses[k]), L * L)
        for i in range(6):
            for j in range(6):
                found[k, i, j] = legs[i][j]
