"""Compiled performance indices of a Jacobian."""

from __future__ import annotations

import math

from pkm_gym.core.compile import formula


@formula
def squared_torque_index(eta: float, sin2_alpha: float, sin2_beta: float) -> float:
    """Return the largest squared dimensionless drive torque over all unit accelerations.

    The norm of the drive's row of ``eta J^-T + J`` for a planar two-limb mechanism with the
    transmission angles alpha (between the limbs) and beta (in the limb), eta = m l1^2 / I_A:
    ``eta^2 sin^2 beta / sin^2 alpha + 2 eta + 1 / sin^2 beta``.
    """
    return eta * eta * sin2_beta / sin2_alpha + 2.0 * eta + 1.0 / sin2_beta


@formula
def angle_of_sine(sine: float) -> float:
    """Return asin of a sine that rounding may have carried past 1, radians."""
    return math.asin(min(1.0, max(-1.0, sine)))
