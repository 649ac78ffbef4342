"""Errors of dimensions as they are built: normal, at scrambled Sobol points."""

from __future__ import annotations

import numpy as np

from pkm_gym.core.types import FloatArray

FEWEST, MOST = 4, 16  # powers of two of samples


def sobol_points(power: int, columns: int, seed: int) -> FloatArray:
    """Return 2^power scrambled Sobol points (n, columns) of the open unit cube."""
    from scipy.stats import qmc

    points = qmc.Sobol(columns, scramble=True, rng=seed).random_base2(power)
    tiny = 0.5 / 2**32  # a point on the edge has an infinite error
    return np.asarray(np.clip(points, tiny, 1.0 - tiny))


def normal(unit: FloatArray) -> FloatArray:
    """Return errors of mean 0 and deviation 1 at points of the unit cube, of the same shape."""
    from scipy.special import ndtri

    return np.asarray(ndtri(unit))


def power_of(samples: int) -> int:
    """Return the power of two that a number of samples is.

    Raises:
        ValueError: for a number that is none, or too few or many.
    """
    power = int(samples).bit_length() - 1
    if samples != 2**power or not FEWEST <= power <= MOST:
        raise ValueError(
            f"samples is {samples}: it must be a power of 2 from {2**FEWEST} to {2**MOST:,}, for "
            "Sobol points are even only so"
        )
    return power
