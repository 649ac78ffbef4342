"""Eq. (19): bounds of the singular values that follow from least transmission angles, and back."""

from __future__ import annotations

import numpy as np

from pkm_gym.core.types import FloatArray


def singular_value_bounds(
    beta_low: FloatArray | float, alpha_low: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Return b_l and b_u (...), within which least angles keep the singular values of l1 J.

    They are theta_F and theta_T of the paper, rad, (...): beta is at least ``beta_low`` at the
    elbows, alpha at least ``alpha_low`` between the rods, both at most 90 deg. Angles within their
    limits keep the singular values within these bounds, not the other way round.

    Raises:
        ValueError: for an angle that isn't over 0 and at most pi/2.
    """
    beta, alpha = _angle("beta_low", beta_low), _angle("alpha_low", alpha_low)
    cosine = np.cos(alpha)
    return np.sqrt(1.0 - cosine) + 0.0 * beta, np.sqrt(1.0 + cosine) / np.sin(beta)


def least_angles(
    sigma_low: FloatArray | float, sigma_high: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Return theta_F and theta_T (...), rad, whose b_l and b_u are these bounds (...).

    Raises:
        ValueError: for bounds that no angles have: b_l must be over 0 and at most 1, b_u at
            least sqrt(2 - b_l^2).
    """
    low, high = np.asarray(sigma_low, dtype=float), np.asarray(sigma_high, dtype=float)
    least = np.sqrt(2.0 - np.clip(low, 0.0, 1.0) ** 2)
    if not ((low > 0.0) & (low <= 1.0)).all():
        raise ValueError(f"sigma_low is {_shown(low)}: it must be over 0 and at most 1")
    if not ((high >= least) & np.isfinite(high)).all():
        raise ValueError(
            f"sigma_high is {_shown(high)}: it must be finite and at least {_shown(least)}, "
            "sqrt(2 - sigma_low^2)"
        )
    return np.arcsin(least / high), np.arccos(1.0 - low**2)


def _angle(name: str, value: FloatArray | float) -> FloatArray:
    angle = np.asarray(value, dtype=float)
    if not ((angle > 0.0) & (angle <= 0.5 * np.pi)).all():
        raise ValueError(f"{name} is {_shown(angle)} rad: it must be over 0 and at most pi/2")
    return angle


def _shown(values: FloatArray) -> str:
    return ", ".join(f"{value:g}" for value in np.ravel(values))
