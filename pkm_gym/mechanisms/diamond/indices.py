"""Indices of the Diamond: at one pose, and their extremes over the workspace."""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.indices import squared_torque_index
from pkm_gym.core.planar import conditioning
from pkm_gym.core.types import FloatArray


@formula
def local_indices(
    x: float, y: float, e: float, l1: float, l2: float, eta: float
) -> tuple[float, float, float, float]:
    """Return sigma_max^2, sigma_min^2 (eq. 18), sin alpha, (tau l1 / I_A)^2 (eq. 12).

    The torque is the larger one of the two limbs.
    """
    larger, smaller, sin_alpha, sin2_1, sin2_2 = conditioning(x, y, e, l1, l2)
    sin2_alpha = sin_alpha * sin_alpha
    torque = max(
        squared_torque_index(eta, sin2_alpha, sin2_1),
        squared_torque_index(eta, sin2_alpha, sin2_2),
    )
    return larger, smaller, sin_alpha, torque


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
            larger, smaller, sine, tau = local_indices(0.5 * b * x_nodes[k], y, e, l1, l2, eta)
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
def torque_index_batch(
    poses: FloatArray, e: float, l1: float, l2: float, I_A: float, m: float, tau: FloatArray
) -> None:
    """Fill ``tau`` (n,), N m per m/s^2, from ``poses`` (n, 2)."""
    eta = m * l1 * l1 / I_A
    for i in numba.prange(poses.shape[0]):
        torque = local_indices(poses[i, 0], poses[i, 1], e, l1, l2, eta)[3]
        tau[i] = math.sqrt(torque) * I_A / l1
