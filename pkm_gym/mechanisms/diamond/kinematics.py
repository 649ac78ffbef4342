"""Geometry of the Diamond beyond ``core.planar``, which holds eqs (1)-(4) and (18) of the paper.

The range of the arm angles over the workspace, and the Hessian of eq. (7).
"""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import dot2
from pkm_gym.core.planar import arm_angle, limb
from pkm_gym.core.types import FloatArray


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
def hessian_batch(poses: FloatArray, e: float, l1: float, l2: float, hessians: FloatArray) -> None:
    """Fill ``hessians`` (n, 2, 2, 2), 1/m^2: the arm accelerations' quadratic form in velocity."""
    for i in numba.prange(poses.shape[0]):
        for k in range(2):
            side = 1.0 - 2.0 * k
            xx, xy, yy = limb_hessian(poses[i, 0], poses[i, 1], side, e, l1, l2)
            hessians[i, k, 0, 0] = xx
            hessians[i, k, 0, 1] = hessians[i, k, 1, 0] = xy
            hessians[i, k, 1, 1] = yy
