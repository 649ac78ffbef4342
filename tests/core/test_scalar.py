"""Several objectives as one number: the front by brute force, the ways to weigh against numpy."""

from __future__ import annotations

import numpy as np
import pytest

from pkm_gym.core.scalar import non_dominated, pca, spread, tolerance, weighted

NAMES = ("a", "b", "c")


def dominated(losses):
    """Return which rows another row beats, pair by pair."""
    k = range(len(losses[0]))
    return [
        any(all(x[i] <= y[i] for i in k) and any(x[i] < y[i] for i in k) for x in losses)
        for y in losses
    ]


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_the_front_is_what_no_other_row_beats(rng, k):
    losses = rng.integers(0, 6, (60, k)).astype(float)  # with ties and equal rows
    np.testing.assert_array_equal(non_dominated(losses), ~np.array(dominated(losses.tolist())))


def test_equal_rows_stay_on_the_front_together():
    np.testing.assert_array_equal(
        non_dominated(np.array([[1.0, 2.0], [1.0, 2.0], [1.0, 3.0]])), [True, True, False]
    )


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_front_of_what_is_not_finite_is_refused(bad):
    with pytest.raises(ValueError, match="a front is of finite numbers"):
        non_dominated(np.array([[1.0, bad]]))


def test_a_spread_holds_the_best_of_each_and_lies_far_apart(rng):
    x = np.sort(rng.random(200))
    losses = np.column_stack([x, 5.0 * (1.0 - x) ** 2])
    chosen = spread(losses, 5)
    assert chosen == sorted(set(chosen))
    assert {0, 199} <= set(chosen)
    places = (losses - losses.min(0)) / np.ptp(losses, 0)
    apart = [np.linalg.norm(places[i] - places[j]) for i in chosen for j in chosen if i < j]
    assert min(apart) > 0.5 * np.sqrt(2) / 5
    assert spread(losses[:3], 9) == [0, 1, 2]


def test_a_weighted_sum_counts_in_what_the_front_varies_by(rng):
    front, losses = rng.normal(size=(9, 3)), rng.normal(size=(20, 3))
    low, high, w = front.min(0), front.max(0), np.array([1.0, 0.0, 2.5])
    expected = [sum(w * (row - low) / (high - low)) for row in losses]
    np.testing.assert_allclose(weighted(front, w)(losses), expected, rtol=1e-12)


def test_a_tolerance_weighted_length_is_measured_in_half_ranges_from_the_best(rng):
    front, losses = rng.normal(size=(9, 3)), rng.normal(size=(20, 3))
    mu = 2.0 / (front.max(0) - front.min(0))
    expected = [np.sqrt(sum((mu * (row - front.min(0))) ** 2)) for row in losses]
    np.testing.assert_allclose(tolerance(front)(losses), expected, rtol=1e-12)
    expected = [np.sqrt(sum((row / [0.1, 2.0, 3.0]) ** 2)) for row in losses]
    given = tolerance(front, [0.1, 2.0, 3.0], aims=np.zeros(3))
    np.testing.assert_allclose(given(losses), expected, rtol=1e-12)


def test_a_principal_component_counts_against_what_is_minimised(rng):
    signs = np.array([1.0, -1.0, 1.0])
    values = rng.normal(size=(50, 1)) * [1.0, -2.0, 0.7] + 0.1 * rng.normal(size=(50, 3)) + 4.0
    way = pca(values * signs, NAMES, signs, "rows")
    Z = (values - values.mean(0)) / values.std(0, ddof=1)
    eigenvalues, vectors = np.linalg.eigh(np.corrcoef(values.T))
    first = vectors[:, -1] * -np.sign(signs @ vectors[:, -1])  # what should be small counts with -1
    assert way.of.kept == 1
    np.testing.assert_allclose(way(values * signs), -eigenvalues[-1] * Z @ first, rtol=1e-9)
    best = way(values * signs).argmin()
    assert values[best, 0] < np.median(values[:, 0])
    assert values[best, 1] > np.median(values[:, 1])


@pytest.mark.parametrize(
    ("way", "numbers", "said"),
    [
        (weighted, [1.0, -1.0, 0.0], "none may be negative"),
        (weighted, [0.0, 0.0, 0.0], "nor all be 0"),
        (weighted, [1.0, 2.0], "give 3 finite numbers"),
        (tolerance, [1.0, 0.0, 1.0], "each must be > 0"),
        (tolerance, [1.0, np.nan, 1.0], "give 3 finite numbers"),
    ],
)
def test_numbers_that_weigh_nothing_are_refused(rng, way, numbers, said):
    with pytest.raises(ValueError, match=said):
        way(rng.normal(size=(4, 3)), numbers)
