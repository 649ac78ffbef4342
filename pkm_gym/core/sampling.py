"""Samples of a workspace."""

from __future__ import annotations

import numpy as np

from pkm_gym.core.compile import kernel
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


def gauss_jacobi(count: int, alpha: int = 0, beta: int = 0) -> tuple[FloatArray, FloatArray]:
    """Return nodes of [0, 1] and weights for means with the density (1 - t)^alpha t^beta.

    Exact for polynomials up to the degree 2 count - 1; Gauss-Legendre as it comes. The weights add
    up to 1.
    """
    from scipy.special import roots_jacobi

    nodes, weights = roots_jacobi(count, alpha, beta)
    return 0.5 * (nodes + 1.0), weights / weights.sum()


def gauss_lobatto(count: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes of [0, 1], both ends among them, and weights for means.

    Exact for polynomials up to the degree 2 count - 3, so that one sample serves a mean and the
    extremes. The weights add up to 1.
    """
    from scipy.special import eval_legendre, roots_jacobi

    inner = roots_jacobi(count - 2, 1, 1)[0] if count > 2 else np.empty(0)
    nodes = np.concatenate([[-1.0], inner, [1.0]])
    weights = 1.0 / eval_legendre(count - 1, nodes) ** 2
    return 0.5 * (nodes + 1.0), weights / weights.sum()


def symmetric_cube(count: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes (count^3, 3) and weights for means over [-1, 1]^3 of symmetric functions.

    A function that no exchange of its arguments changes needs only the sixth part of the cube with
    x <= y <= z, a tetrahedron: the rule collapses onto the cube's diagonal, so that a ridge or a
    cone along it (equal singular values) costs no accuracy. The weights add up to 1.
    """
    from_diagonal, radial = gauss_jacobi(count, 1, 1)
    along, weights = gauss_jacobi(count)
    r, t, u = (x[..., None] for x in np.meshgrid(from_diagonal, along, along, indexing="ij"))
    on_diagonal = (2.0 * t - 1.0) * np.ones(3)
    opposite = np.concatenate([-np.ones_like(u), 2.0 * u - 1.0, np.ones_like(u)], axis=-1)
    nodes = (1.0 - r) * on_diagonal + r * opposite
    product = np.einsum("i,j,k->ijk", radial, weights, weights)
    return nodes.reshape(-1, 3), product.ravel()


def triangular_cylinder(count: int) -> tuple[FloatArray, FloatArray]:
    """Return nodes (count^3, 3) and weights for means over the cylinder r <= 1, |z| <= 1.

    For functions with the symmetry of a triangle, on a sixth of the circle: Gauss in radius and
    height, the midpoint rule in azimuth. A cone along the axis costs no accuracy. The weights add
    up to 1.
    """
    radii, radial = gauss_jacobi(count, 0, 1)
    heights, weights = gauss_jacobi(count)
    azimuths = np.pi / 3.0 * (np.arange(count) + 0.5) / count
    r, z, azimuth = np.meshgrid(radii, 2.0 * heights - 1.0, azimuths, indexing="ij")
    nodes = np.stack([r * np.cos(azimuth), r * np.sin(azimuth), z], axis=-1)
    product = np.einsum("i,j,k->ijk", radial, weights, np.full(count, 1.0 / count))
    return nodes.reshape(-1, 3), product.ravel()


@kernel
def lowest_of_five(samples: FloatArray) -> tuple[int, float]:
    """Return where the lowest of five equally spaced samples (5,) stands, and where to look again.

    The second is the vertex of the parabola through the lowest and its neighbours, in steps from
    the first sample, within the samples.
    """
    at = int(np.argmin(samples))
    middle = min(3, max(1, at))
    before, here, after = samples[middle - 1], samples[middle], samples[middle + 1]
    bend = before - 2.0 * here + after
    if not bend > 0.0:
        return at, float(at)
    return at, min(4.0, max(0.0, middle + 0.5 * (before - after) / bend))
