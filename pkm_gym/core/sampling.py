"""Samples of a workspace."""

from __future__ import annotations

import numpy as np

from pkm_gym.core.types import FloatArray


def unit_nodes(count: int) -> FloatArray:
    """Return ``count`` equally spaced nodes of [0, 1], both ends included."""
    return np.linspace(0.0, 1.0, count)


def rectangle(
    low: tuple[float, float], high: tuple[float, float], columns: int, rows: int
) -> FloatArray:
    """Return a tensor grid over a rectangle: array (rows, columns, 2), y along the first axis."""
    x = np.linspace(low[0], high[0], columns)
    y = np.linspace(low[1], high[1], rows)
    return np.stack(np.meshgrid(x, y), axis=-1)
