"""Indices of the Diamond at one pose."""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula
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


@batch_kernel
def torque_index_batch(
    poses: FloatArray, e: float, l1: float, l2: float, I_A: float, m: float, tau: FloatArray
) -> None:
    """Fill ``tau`` (n,), N m per m/s^2, from ``poses`` (n, 2)."""
    eta = m * l1 * l1 / I_A
    for i in numba.prange(poses.shape[0]):
        torque = local_indices(poses[i, 0], poses[i, 1], e, l1, l2, eta)[3]
        tau[i] = math.sqrt(torque) * I_A / l1
