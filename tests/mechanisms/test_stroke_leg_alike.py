"""Designs of the leg that measure alike, and the one of them that is kept."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms import family_problem
from pkm_gym.mechanisms.stroke_leg.alike import middle_of_arc, turned

PROBLEMS = ("stroke_leg", "stroke_leg_gait")
TOLD_APART = ("gap", "mount")


@pytest.fixture(scope="module", params=PROBLEMS)
def leg(request: pytest.FixtureRequest) -> DesignProblem:
    return family_problem(request.param)


@pytest.fixture(scope="module")
def feasible(leg: DesignProblem) -> tuple[np.ndarray, np.ndarray]:
    """Feasible designs of tasks of the Family."""
    rng = np.random.default_rng(3)
    designs = leg.low + (leg.high - leg.low) * rng.random((200_000, len(leg.low)))
    tasks = leg.draw_tasks(len(designs), rng)
    kept = leg.evaluate(designs, tasks).feasible
    assert kept.sum() > 20
    return designs[kept][:50], tasks[kept][:50]


def test_designs_whose_b_is_turned_measure_alike(leg, feasible) -> None:
    designs, tasks = feasible
    moved = turned(leg, designs, np.random.default_rng(0).uniform(-0.1, 0.1, len(designs)))
    before, after = (leg.evaluate(rows, tasks).indices for rows in (designs, moved))
    for name in before:
        if name not in TOLD_APART:
            np.testing.assert_allclose(after[name], before[name], rtol=1e-9, err_msg=name)
    assert np.abs(moved - designs).max() > 0.01


def test_the_one_that_is_kept_is_feasible_and_the_same_from_anywhere_on_the_arc(
    leg, feasible
) -> None:
    designs, tasks = feasible
    middle = leg.one_of_alike(designs, tasks)
    assert leg.evaluate(middle, tasks).feasible.all()
    assert ((middle >= leg.low) & (middle <= leg.high)).all()
    np.testing.assert_allclose(leg.one_of_alike(middle, tasks), middle, atol=1e-9)
    aside = turned(leg, middle, np.full(len(middle), 0.003))
    still = leg.evaluate(aside, tasks).feasible & ((aside >= leg.low) & (aside <= leg.high)).all(1)
    assert still.sum() > 10
    again = leg.one_of_alike(aside[still], tasks[still])
    np.testing.assert_allclose(again, middle[still], atol=1e-9)


def test_the_ends_of_the_arc_are_as_far_from_the_one_that_is_kept(leg, feasible) -> None:
    designs, tasks = feasible
    middle = leg.one_of_alike(designs[:5], tasks[:5])
    for k in range(5):
        angles = np.linspace(-0.6, 0.6, 4801)
        rows = turned(leg, np.repeat(middle[k : k + 1], len(angles), axis=0), angles)
        inside = leg.evaluate(rows, tasks[k : k + 1]).feasible
        inside &= ((rows >= leg.low) & (rows <= leg.high)).all(axis=1)
        broken = angles[~inside]
        ends = broken[broken < 0.0].max(initial=-0.6), broken[broken > 0.0].min(initial=0.6)
        assert abs(sum(ends)) < 1e-3


def test_designs_stay_where_one_of_the_three_is_fixed_or_nothing_is_feasible() -> None:
    narrow = pkm_gym.make_problem("stroke_leg_gait", fixed={"phi": 2.0})
    rows = narrow.low[None] + 0.5 * (narrow.high - narrow.low)
    assert middle_of_arc(narrow, rows, narrow.pack(None)[None]) is rows
    whole = pkm_gym.make_problem("stroke_leg_gait")
    corner = whole.low[None].copy()
    np.testing.assert_array_equal(whole.one_of_alike(corner, whole.pack(None)[None]), corner)
