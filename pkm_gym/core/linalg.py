"""Compiled algebra of fixed size, written on scalars so that loops over poses vectorise."""

from __future__ import annotations

import math

from pkm_gym.core.compile import formula


@formula
def dot2(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the scalar product of two plane vectors."""
    return ax * bx + ay * by


@formula
def cross2(ax: float, ay: float, bx: float, by: float) -> float:
    """Return ``b^T Q a``, Q the quarter turn: the sine from a to b, for unit vectors."""
    return ax * by - ay * bx


@formula
def squared_singular_values(aa: float, bb: float, ab: float, det2: float) -> tuple[float, float]:
    """Return the squared singular values (larger, smaller) of a matrix with rows a and b.

    ``aa``, ``bb``, ``ab`` are the scalar products of the rows and ``det2`` the squared determinant.
    The smaller one is det2 over the larger: their difference would cancel.
    """
    larger = 0.5 * (aa + bb + math.sqrt((aa - bb) * (aa - bb) + 4.0 * ab * ab))
    return larger, det2 / larger
