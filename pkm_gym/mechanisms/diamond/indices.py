"""Indices of the Diamond: at one pose, and their extremes over the workspace."""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.indices import squared_torque_index
from pkm_gym.core.linalg import cross2, dot2, squared_singular_values
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.kinematics import limb


@formula
def local_indices(
    x: float, y: float, e: float, l1: float, l2: float, eta: float
) -> tuple[float, float, float, float, float]:
    """Return sigma_max^2, sigma_min^2 (eq. 18), sin alpha, |sin beta|, (tau l1 / I_A)^2 (eq. 12).

    The singular values are those of the dimensionless Jbar = l1 J, whose rows are w_i^T / s_i;
    sin beta is the smaller and the torque the larger one of the two limbs.
    """
    _, _, w1x, w1y, s1 = limb(x, y, 1.0, e, l1, l2)
    _, _, w2x, w2y, s2 = limb(x, y, -1.0, e, l1, l2)
    sin_alpha = cross2(w1x, w1y, w2x, w2y)
    cos_alpha = dot2(w1x, w1y, w2x, w2y)
    sin2_alpha = sin_alpha * sin_alpha
    sin2_1, sin2_2 = s1 * s1, s2 * s2
    row1, row2 = 1.0 / sin2_1, 1.0 / sin2_2
    larger, smaller = squared_singular_values(
        row1, row2, cos_alpha * s1 * s2 * row1 * row2, sin2_alpha * row1 * row2
    )
    torque = max(
        squared_torque_index(eta, sin2_alpha, sin2_1),
        squared_torque_index(eta, sin2_alpha, sin2_2),
    )
    return larger, smaller, sin_alpha, math.sqrt(min(sin2_1, sin2_2)), torque


@kernel
def workspace_indices(
    e: float,
    l1: float,
    l2: float,
    H: float,
    b: float,
    h: float,
    eta: float,
    x_nodes: FloatArray,
    y_nodes: FloatArray,
    scratch: FloatArray,
) -> tuple[float, float, float, float, float]:
    """Return sigma_max, sigma_min, largest condition number, smallest sin alpha, tau_G l1 / I_A.

    Sampled on the right half of the workspace: both limbs are measured and the left half is its
    mirror image. ``x_nodes`` and ``y_nodes`` lie in [0, 1]; ``scratch`` is (4, len(x_nodes)).
    """
    sigma_max = condition = torque = 0.0
    sigma_min = sin_alpha = math.inf
    for row in range(y_nodes.shape[0]):
        y = -H - h * y_nodes[row]
        for k in range(x_nodes.shape[0]):
            larger, smaller, sine, _, tau = local_indices(0.5 * b * x_nodes[k], y, e, l1, l2, eta)
            scratch[0, k] = larger
            scratch[1, k] = smaller
            scratch[2, k] = sine
            scratch[3, k] = tau
        for k in range(x_nodes.shape[0]):
            sigma_max = max(sigma_max, scratch[0, k])
            sigma_min = min(sigma_min, scratch[1, k])
            condition = max(condition, scratch[0, k] / scratch[1, k])
            sin_alpha = min(sin_alpha, scratch[2, k])
            torque = max(torque, scratch[3, k])
    return (
        math.sqrt(sigma_max),
        math.sqrt(sigma_min),
        math.sqrt(condition),
        sin_alpha,
        math.sqrt(torque),
    )


@batch_kernel
def local_indices_batch(
    poses: FloatArray, e: float, l1: float, l2: float, I_A: float, m: float, out: FloatArray
) -> None:
    """Fill ``out`` (n, 5) from ``poses`` (n, 2): sigma_max, sigma_min, sin alpha, sin beta, tau."""
    eta = m * l1 * l1 / I_A
    for i in numba.prange(poses.shape[0]):
        larger, smaller, sin_alpha, sin_beta, torque = local_indices(
            poses[i, 0], poses[i, 1], e, l1, l2, eta
        )
        out[i, 0] = math.sqrt(larger)
        out[i, 1] = math.sqrt(smaller)
        out[i, 2] = sin_alpha
        out[i, 3] = sin_beta
        out[i, 4] = math.sqrt(torque) * I_A / l1
