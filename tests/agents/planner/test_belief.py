"""Beliefs: regression against its textbook form, cut tails against SciPy, known speakers."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from pkm_gym.agents.planner.belief import believe, expansion, slopes_of_terms, terms
from pkm_gym.agents.planner.evidence import Evidence

RNG = np.random.default_rng(4)


def test_terms_are_a_taylor_polynomial():
    hessian = RNG.normal(size=(3, 3))
    hessian += hessian.T
    slope, offset = RNG.normal(size=3), RNG.normal(size=3)
    coefficients = np.r_[0.7, slope, hessian[np.triu_indices(3)]]
    expected = 0.7 + slope @ offset + 0.5 * offset @ hessian @ offset
    assert terms(offset) @ coefficients == pytest.approx(expected)
    np.testing.assert_allclose(slopes_of_terms(offset) @ coefficients, slope + hessian @ offset)


def test_the_expansion_is_near_the_surrogate(surrogate):
    point, centre = RNG.uniform(-0.6, 0.6, 7), np.full(3, 0.4)
    coefficients = expansion(surrogate, point, centre)
    offsets = 1e-2 * RNG.normal(size=(6, 3))
    values = surrogate.pieces(point, centre + offsets).values[:, 1:]
    expected = np.einsum("nt,fkt->nfk", terms(offsets), coefficients[1:])
    np.testing.assert_allclose(values, expected, atol=1e-5)


def evidence(told, values, basis, variance=1.0, noise=1e-6) -> Evidence:
    n, t = basis.shape
    return Evidence(basis, told, values, np.full(t, variance), np.full(n, noise))


def test_a_piece_that_spoke_is_regressed_as_in_the_textbook():
    basis, told = terms(RNG.normal(size=(7, 2))), 0.5 * RNG.normal(size=7)
    mean, covariance = evidence(told, np.zeros((7, 1)), basis, noise=0.5).posterior(
        np.ones(7, dtype=bool), 0
    )
    precision = np.eye(6) + basis.T @ basis / 0.5
    np.testing.assert_allclose(covariance, np.linalg.inv(precision), atol=1e-9)
    np.testing.assert_allclose(mean, np.linalg.solve(precision, basis.T @ told / 0.5), atol=1e-9)


@pytest.mark.parametrize("limit", [-3.0, -0.5, 1.0])
def test_a_piece_that_was_silent_loses_its_upper_tail(limit):
    silent = evidence(np.array([limit]), np.zeros((1, 1)), np.ones((1, 1)), noise=0.0)
    mean, covariance = silent.posterior(np.zeros(1, dtype=bool), 0)
    cut = stats.truncnorm(-np.inf, limit)
    assert mean[0] == pytest.approx(cut.mean(), rel=1e-9)
    assert covariance[0, 0] == pytest.approx(cut.var(), rel=1e-6)


def test_a_surprise_widens_the_belief():
    basis = np.ones((1, 1))
    calm, alarmed = (
        evidence(np.array([told]), np.zeros((1, 1)), basis, noise=0.1).posterior(
            np.ones(1, dtype=bool), 0
        )[1][0, 0]
        for told in (0.5, 30.0)
    )
    assert alarmed > calm


def test_one_design_twice_is_no_singular_matter():
    basis = np.ones((2, 1))
    twice = Evidence(basis, np.array([9.0, 8.0]), np.zeros((2, 1)), np.array([1e9]), np.zeros(2))
    mean, covariance = twice.posterior(np.ones(2, dtype=bool), 0)
    assert mean[0] == pytest.approx(8.5, rel=1e-3)
    assert np.isfinite(covariance).all()


def test_the_speakers_are_found_though_the_surrogate_errs():
    """Two lines that cross; the surrogate has them shifted, so that it takes one for the other."""
    right = 0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        offsets = rng.uniform(-1.0, 1.0, (6, 1))
        slopes = np.array([[1.0, -1.0]])
        surrogate = offsets @ slopes
        truth = surrogate + rng.normal(0.0, 0.3, 2)
        told = truth.max(axis=1)
        variance = np.array([0.09, 1e-8, 1e-8])
        found = Evidence(terms(offsets), told, surrogate, variance, np.full(6, 1e-12)).speakers()
        right += (found == truth.argmax(axis=1)).all()
    assert right >= 38


def test_evaluations_correct_what_is_believed(surrogate):
    point, centre = np.zeros(7), np.full(3, 0.4)
    places = centre + 1e-3 * RNG.normal(size=(8, 3))
    told = surrogate.pieces(point, places).values.max(axis=2) + 2e-4
    belief = believe(surrogate, point, places, told, centre)
    values = np.einsum("nt,fkt->nfk", terms(places - centre), belief.mean)
    np.testing.assert_allclose(values.max(axis=2), told, atol=1e-6)
    assert belief.seen.any(axis=1).all()
    assert belief.covariance[0, 0, 0, 0] < 1e-3 * surrogate.errors[0] ** 2


def test_what_was_not_told_changes_nothing(surrogate):
    point, centre = np.zeros(7), np.full(3, 0.4)
    before = believe(surrogate, point, np.empty((0, 3)), np.empty((0, 4)), centre)
    after = believe(surrogate, point, centre[None] + 0.01, np.full((1, 4), np.nan), centre)
    np.testing.assert_array_equal(before.covariance, after.covariance)
    np.testing.assert_array_equal(before.mean, after.mean)
