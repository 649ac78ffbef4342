"""Geometry of the Diamond: one pose at a time, compiled. Equations (1)-(8), (18) of the paper.

Frame: the origin midway between the drive axes, x to the right, y up, the platform below (y < 0).
Limb 1 has its drive at (+e, 0), limb 2 at (-e, 0); ``side`` is +1 and -1. Elbows point outwards,
the platform is the lower of the two circle intersections. Q is the quarter turn [[0, -1], [1, 0]].
"""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import dot2
from pkm_gym.core.types import FloatArray

# A pose nearer to the edge of a limb's annulus than this share of l1 counts as out of reach.
REACH_MARGIN = 1e-9


@formula
def limb(
    x: float, y: float, side: float, e: float, l1: float, l2: float
) -> tuple[float, float, float, float, float]:
    """Return the unit vectors u of the arm and w of the rod, and s = w^T Q u: ux, uy, wx, wy, s.

    Eq. (2) without angles. The arm's tip lies at ``l1 u = p d + side q Q d`` from its drive, d the
    vector from the drive to the platform; then ``s = -side q d^2 / (l1 l2)`` and |s| = sin beta.
    NaN out of reach.
    """
    dx, dy = x - side * e, y
    d2 = dx * dx + dy * dy
    inverse = 1.0 / d2
    p = 0.5 + 0.5 * (l1 * l1 - l2 * l2) * inverse
    q = side * math.sqrt(l1 * l1 * inverse - p * p)
    ax, ay = p * dx - q * dy, p * dy + q * dx
    s = q * d2 * (-1.0 / (l1 * l2))
    return ax / l1, ay / l1, (dx - ax) / l2, (dy - ay) / l2, s


@kernel
def reach_margins(
    e: float, l1: float, l2: float, H: float, b: float, h: float
) -> tuple[float, float]:
    """Return (inner, outer) margins of the workspace to the limbs' annuli, in units of l1.

    Exact: the nearest point of the rectangle to a drive and the farthest one; >= 0 is in reach.
    """
    nearest = math.hypot(max(0.0, e - 0.5 * b), H)
    farthest = math.hypot(0.5 * b + e, H + h)
    return (nearest - abs(l2 - l1)) / l1, (l1 + l2 - farthest) / l1


@kernel
def smallest_sine_beta(e: float, l1: float, l2: float, H: float, b: float, h: float) -> float:
    """Return the smallest sin beta over the workspace: exact, at its nearest or farthest point."""
    nearest2 = max(0.0, e - 0.5 * b) ** 2 + H * H
    farthest2 = (0.5 * b + e) ** 2 + (H + h) ** 2
    smallest = 1.0
    for d2 in (nearest2, farthest2):
        cos_beta = (l1 * l1 + l2 * l2 - d2) / (2.0 * l1 * l2)
        smallest = min(smallest, math.sqrt(max(0.0, 1.0 - cos_beta * cos_beta)))
    return smallest


@kernel
def arm_angle(x: float, y: float, side: float, e: float, l1: float, l2: float) -> float:
    """Return the arm angle theta_1i from +x, counter-clockwise, radians. Eq. (2).

    Limb 2 is the mirror image, pi - theta: neither angle jumps while the platform stays below.
    """
    ux, uy, _, _, _ = limb(x, y, side, e, l1, l2)
    angle = math.atan2(uy, side * ux)
    return angle if side > 0.0 else math.pi - angle


@kernel
def arm_angle_range(
    e: float, l1: float, l2: float, H: float, b: float, h: float
) -> tuple[float, float]:
    """Return the (smallest, largest) arm angle of limb 1 over the workspace, radians.

    The angle's gradient never vanishes, so its extremes lie on the rectangle's edge: at a corner,
    or where the rod stands at right angles to an edge. Exact; limb 2 is the mirror image.
    """
    low, high = math.inf, -math.inf
    for x in (-0.5 * b, 0.5 * b):
        for y in (-H, -H - h):
            low, high = _widened(low, high, x, y, e, l1, l2)
    for rod in (-l2, l2):
        for sign in (-1.0, 1.0):
            for y in (-H, -H - h):  # vertical rod: the elbow stands at y - rod
                x = e + sign * math.sqrt(max(0.0, l1 * l1 - (y - rod) ** 2))
                if abs(x) < 0.5 * b:
                    low, high = _widened(low, high, x, y, e, l1, l2)
            for x in (-0.5 * b, 0.5 * b):  # horizontal rod: the elbow stands at x - rod
                y = sign * math.sqrt(max(0.0, l1 * l1 - (x - rod - e) ** 2))
                if -H - h < y < -H:
                    low, high = _widened(low, high, x, y, e, l1, l2)
    return low, high


@kernel
def _widened(
    low: float, high: float, x: float, y: float, e: float, l1: float, l2: float
) -> tuple[float, float]:
    angle = arm_angle(x, y, 1.0, e, l1, l2)
    return min(low, angle), max(high, angle)


@kernel
def platform(theta1: float, theta2: float, e: float, l1: float, l2: float) -> tuple[float, float]:
    """Return x, y of the lower assembly mode (sin alpha > 0); NaN where the rods do not meet."""
    x1, y1 = e + l1 * math.cos(theta1), l1 * math.sin(theta1)
    x2, y2 = -e + l1 * math.cos(theta2), l1 * math.sin(theta2)
    gap_x, gap_y = x1 - x2, y1 - y2
    gap2 = gap_x * gap_x + gap_y * gap_y
    drop = math.sqrt(l2 * l2 / gap2 - 0.25)
    return 0.5 * (x1 + x2) + drop * gap_y, 0.5 * (y1 + y2) - drop * gap_x


@kernel
def inverse_jacobian(
    x: float, y: float, e: float, l1: float, l2: float
) -> tuple[float, float, float, float]:
    """Return J of eq. (4) row by row, 1/m: joint rates = J @ velocity, row_i = w_i^T / (l1 s_i)."""
    _, _, w1x, w1y, s1 = limb(x, y, 1.0, e, l1, l2)
    _, _, w2x, w2y, s2 = limb(x, y, -1.0, e, l1, l2)
    return w1x / (l1 * s1), w1y / (l1 * s1), w2x / (l1 * s2), w2y / (l1 * s2)


@formula
def limb_hessian(
    x: float, y: float, side: float, e: float, l1: float, l2: float
) -> tuple[float, float, float]:
    """Return K_i of the arm acceleration f_i = v^T K_i v, symmetric: xx, xy, yy, 1/m^2.

    Eq. (7) with l1/l2 where the paper prints l2/l1, and 1/s^3 once.
    """
    ux, uy, wx, wy, s = limb(x, y, side, e, l1, l2)
    scale = 1.0 / (l1 * l1 * s * s * s)
    rod = dot2(wx, wy, ux, uy) * scale
    arm = (l1 / l2) * scale
    return (
        rod * wx * wx + arm * ux * ux,
        rod * wx * wy + arm * ux * uy,
        rod * wy * wy + arm * uy * uy,
    )


@batch_kernel
def inverse_kinematics_batch(
    poses: FloatArray, e: float, l1: float, l2: float, joints: FloatArray
) -> None:
    """Fill ``joints`` (n, 2), radians, from ``poses`` (n, 2), metres."""
    for i in numba.prange(poses.shape[0]):
        x, y = poses[i]
        joints[i, 0] = arm_angle(x, y, 1.0, e, l1, l2)
        joints[i, 1] = arm_angle(x, y, -1.0, e, l1, l2)


@batch_kernel
def forward_kinematics_batch(
    joints: FloatArray, e: float, l1: float, l2: float, poses: FloatArray
) -> None:
    """Fill ``poses`` (n, 2), metres, from ``joints`` (n, 2), radians."""
    for i in numba.prange(joints.shape[0]):
        poses[i, 0], poses[i, 1] = platform(joints[i, 0], joints[i, 1], e, l1, l2)


@batch_kernel
def inverse_jacobian_batch(
    poses: FloatArray, e: float, l1: float, l2: float, jacobians: FloatArray
) -> None:
    """Fill ``jacobians`` (n, 2, 2), 1/m, from ``poses`` (n, 2), metres."""
    for i in numba.prange(poses.shape[0]):
        j11, j12, j21, j22 = inverse_jacobian(poses[i, 0], poses[i, 1], e, l1, l2)
        jacobians[i, 0, 0], jacobians[i, 0, 1] = j11, j12
        jacobians[i, 1, 0], jacobians[i, 1, 1] = j21, j22


@batch_kernel
def hessian_batch(poses: FloatArray, e: float, l1: float, l2: float, hessians: FloatArray) -> None:
    """Fill ``hessians`` (n, 2, 2, 2), 1/m^2: the arm accelerations' quadratic form in velocity."""
    for i in numba.prange(poses.shape[0]):
        for k in range(2):
            side = 1.0 - 2.0 * k
            xx, xy, yy = limb_hessian(poses[i, 0], poses[i, 1], side, e, l1, l2)
            hessians[i, k, 0, 0] = xx
            hessians[i, k, 0, 1] = hessians[i, k, 1, 0] = xy
            hessians[i, k, 1, 1] = yy
