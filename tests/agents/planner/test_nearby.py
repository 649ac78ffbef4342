"""Basins: the nearest optima, descents against another of SciPy's, which basin is chosen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import NonlinearConstraint, minimize

from pkm_gym.agents.planner.nearby import APART, NEAREST, Nearby, descend, new_basin
from pkm_gym.agents.planner.planner import TRUST, Planner
from pkm_gym.agents.planner.surrogate import Pieces
from pkm_gym.benchmark.splits import load_split

RNG = np.random.default_rng(6)
HOLLOWS = np.array([[0.25, 0.3], [0.7, 0.4]])


class Hollows:
    """A stand-in for a surrogate: two hollows, the second one deeper, and x + y <= 1 in two pieces.

    Its limit is said to err by 0.01.
    """

    errors = np.array([0.0, 0.01])

    def errors_at(self, _point):
        return self.errors

    def pieces(self, _point, places):
        ways = places[:, None] - HOLLOWS
        depths = np.array([0.5, 1.0]) * np.exp(-20.0 * (ways**2).sum(axis=2))
        merit = -depths.sum(axis=1)
        slope = (40.0 * depths[..., None] * ways).sum(axis=1)
        limit, nan = places.sum(axis=1) - 1.0, np.full(len(places), -np.inf)
        values = np.stack([np.c_[merit, nan], np.c_[limit, limit - 0.1]], axis=1)
        ones = np.ones_like(slope)
        return Pieces(
            values, np.stack([np.stack([slope, 0.0 * slope], 1), np.stack([ones] * 2, 1)], 1)
        )


def test_the_nearest_are_those_whose_optima_are():
    points = RNG.uniform(-0.6, 0.6, (200, 3))
    nearby = Nearby(
        points, np.c_[points[:, 0], 0.5 * points[:, 1]]
    )  # the third field moves nothing
    asked = RNG.uniform(-0.6, 0.6, (5, 3))
    apart = np.linalg.norm((asked[:, None] - points)[..., :2] * [1.0, 0.5], axis=2)
    expected = nearby.places[np.argsort(apart, axis=1)[:, :NEAREST]]
    np.testing.assert_allclose(nearby.of(asked)[:, :5], expected[:, :5], atol=1e-12)
    assert nearby.of(asked).shape == (5, NEAREST, 2)


def test_few_known_tasks_are_all_taken():
    points = RNG.uniform(-0.6, 0.6, (9, 2))
    assert Nearby(points, points).of(points[:2]).shape == (2, 9, 2)


@pytest.mark.parametrize("start", [(0.2, 0.2), (0.6, 0.4), (0.5, 0.7)])
def test_a_descent_ends_where_cobyqa_does(start):
    place, price = descend(Hollows(), np.zeros(1), np.array(start))
    at = lambda x: Hollows().pieces(None, np.asarray(x)[None])  # noqa: E731
    expected = minimize(
        lambda x: at(x).values[0, 0, 0], place + 0.01, method="COBYQA",
        bounds=[(max(0.0, s - 0.3), min(1.0, s + 0.3)) for s in start],
        constraints=NonlinearConstraint(lambda x: at(x).values[0, 1, 0] + 0.01, -np.inf, 0.0),
        options={"final_tr_radius": 1e-7},
    )  # fmt: skip
    assert place.sum() <= 0.99 + 1e-6  # the limit, and the error that it may have
    assert price == pytest.approx(expected.fun, abs=1e-4)


def test_what_cannot_be_kept_is_priced():
    far = np.array([1.0, 1.0])  # the limit is 0.4 beyond the reach
    place, price = descend(Hollows(), np.zeros(1), far)
    np.testing.assert_allclose(place, [0.7, 0.7], atol=1e-6)
    assert price == pytest.approx(10.0 * 0.41 + Hollows().pieces(None, place[None]).values[0, 0, 0])


def test_the_deeper_basin_is_tried_first_then_the_other():
    nearby = Nearby(RNG.uniform(size=(3, 1)), np.array([[0.2, 0.2], [0.3, 0.3], [0.7, 0.25]]))
    tried, home = np.empty((0, 2)), np.array([0.9, 0.9])
    deeper = new_basin(Hollows(), nearby, np.zeros(1), tried, home)
    assert np.linalg.norm(deeper - HOLLOWS[1]) < np.linalg.norm(deeper - HOLLOWS[0])
    other = new_basin(Hollows(), nearby, np.zeros(1), deeper[None] + 0.9 * APART, home)
    np.testing.assert_allclose(other, HOLLOWS[0], atol=0.03)
    last = new_basin(Hollows(), nearby, np.zeros(1), np.array([deeper, other]), home)
    np.testing.assert_array_equal(last, home)


def test_what_a_first_plan_reaches_is_no_new_basin():
    assert APART > TRUST


def test_a_planner_that_knows_optima_begins_there_whatever_its_start(random_planner):
    problem, pool = load_split("diamond", "val")
    policy = Planner(random_planner.policy.surrogate, Nearby.of_pool(problem, pool.first(30)))
    begun = []
    for design in (problem.low, problem.high):
        designer = replace(random_planner, policy=policy, starts=Fixed(design))
        begun.append(designer.propose(designer.open(pool.tasks[:2])))
    np.testing.assert_array_equal(*begun)
    again = Planner.of_tensors(problem, policy.tensors())
    np.testing.assert_array_equal(again.nearby.places, policy.nearby.places)
    np.testing.assert_array_equal(again.nearby.points, policy.nearby.points)


@pytest.mark.parametrize("cut", ["nearby.points", "nearby.places"])
def test_optima_that_lack_an_array_are_refused(random_planner, cut):
    problem, pool = load_split("diamond", "val")
    policy = Planner(random_planner.policy.surrogate, Nearby.of_pool(problem, pool.first(30)))
    tensors = {name: array for name, array in policy.tensors().items() if name != cut}
    with pytest.raises(ValueError, match=cut):
        Planner.of_tensors(problem, tensors)


class Fixed:
    """The same start for each task."""

    def __init__(self, design):
        self._design = design

    def designs(self, tasks):
        return np.repeat(self._design[None], len(tasks), axis=0)
