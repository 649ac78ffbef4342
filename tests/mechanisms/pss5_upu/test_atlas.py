"""The space model of the 5-PSS/UPU, and the composites of our own designs."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.mechanisms.pss5_upu.atlas import (
    CORNERS,
    own_composites,
    space_grid,
    to_plane,
    to_shares,
    values_of,
)


@pytest.fixture(scope="module")
def evaluation():
    return pkm_gym.make_problem("pss5_upu").evaluate(space_grid())


def test_the_plane_is_isometric_to_the_space_model_but_for_one_factor(rng):
    """Distances in X, Y are sqrt(2/3) of those in n1, n2, n3: a projection, not a distortion."""
    shares = rng.uniform(0.1, 1.5, (50, 2))
    whole = np.column_stack([3.0 - shares.sum(axis=1), shares])
    apart = np.linalg.norm(np.diff(whole, axis=0), axis=1)
    flat = np.linalg.norm(np.diff(to_plane(shares), axis=0), axis=1)
    np.testing.assert_allclose(flat / apart, np.sqrt(2.0 / 3.0), rtol=1e-12)
    np.testing.assert_allclose(to_shares(to_plane(shares)), shares, rtol=1e-12)


def test_the_corners_are_where_a_length_vanishes_or_two_are_equal():
    n2, n3 = to_shares(CORNERS).T
    np.testing.assert_allclose(n2, [1.5, 3.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(n3, [0.0, 0.0, 3.0], atol=1e-12)
    np.testing.assert_allclose(3.0 - n2 - n3, [1.5, 0.0, 0.0], atol=1e-12)


def test_the_grid_is_ours_and_fills_the_triangle():
    assert pkm_gym.make_problem("pss5_upu").grid() is None
    designs = space_grid()
    n1, (n2, n3) = 3.0 - designs.sum(axis=1), designs.T
    assert len(designs) == 1441
    assert (np.minimum(n1, n3) > 0.1 - 1e-9).all()
    assert (n1 < n2).all()
    X, Y = to_plane(designs).T
    np.testing.assert_allclose(X / 0.03, np.round(X / 0.03), atol=1e-9)
    np.testing.assert_allclose(Y / 0.05, np.round(Y / 0.05), atol=1e-9)
    assert [X.min(), X.max()] == pytest.approx([1.74, 3.27])
    assert [Y.min(), Y.max()] == pytest.approx([0.1, 2.75])


def test_our_own_atlas_would_punish_two_indices(evaluation):
    feasible, reachable = own_composites(evaluation)
    np.testing.assert_allclose(feasible.weights, [1.75, -1.49, -1.84, 1.77], atol=5e-3)
    np.testing.assert_allclose(reachable.weights, [1.85, -1.69, -1.91, 1.86], atol=5e-3)
    for found in (feasible, reachable):
        assert found.kept == 1
        assert found.correlation[0, 3] > 0.995
        assert found.correlation[[0, 0, 1, 2], [1, 2, 3, 3]].max() < -0.5
        told = "\n".join(found.warnings)
        assert "component 1 is a coin toss" in told
        assert "punishes K_w" in told
        assert "punishes K_lambda" in told
    assert "(231 rows)" in feasible.population
    assert "(679 rows)" in reachable.population


def test_the_feasible_designs_are_some_of_the_reachable_ones(evaluation):
    reached = np.isfinite(values_of(evaluation)).all(axis=1)
    assert (reached == (evaluation.unreached == 0.0)).all()
    assert reached[evaluation.feasible].all()
    assert evaluation.feasible.sum() < reached.sum() < len(evaluation)
