"""Rules for means: what they are exact for."""

from __future__ import annotations

import pytest

from pkm_gym.core.sampling import gauss_jacobi, gauss_lobatto


@pytest.mark.parametrize("count", [2, 3, 5, 8])
def test_gauss_lobatto_has_both_ends_and_its_degree(count: int) -> None:
    nodes, weights = gauss_lobatto(count)
    assert (nodes[0], nodes[-1], len(nodes)) == (0.0, 1.0, count)
    assert (weights > 0.0).all()
    for degree in range(2 * count - 2):
        assert weights @ nodes**degree == pytest.approx(1.0 / (degree + 1), rel=1e-12)
    degree = 2 * count - 2
    assert abs(weights @ nodes**degree * (degree + 1) - 1.0) > 1e-11


@pytest.mark.parametrize("count", [2, 5, 12])
def test_gauss_legendre_has_its_degree(count: int) -> None:
    nodes, weights = gauss_jacobi(count)
    for degree in range(2 * count):
        assert weights @ nodes**degree == pytest.approx(1.0 / (degree + 1), rel=1e-12)
