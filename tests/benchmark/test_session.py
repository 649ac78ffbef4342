"""The session counts every design, hands over what the track allows, and adds the noise asked."""

from __future__ import annotations

import time

import numpy as np
import pytest

from pkm_gym.benchmark import Session, Spent


@pytest.fixture
def session(shipped):
    problem, split = shipped
    return Session(problem, split.tasks[0], budget=10, seed=[3, 0])


def test_every_design_of_a_batch_counts(session, shipped):
    problem, split = shipped
    session.evaluate(split.designs[0])
    session.evaluate(split.designs[1:5])
    assert session.count == 5
    np.testing.assert_array_equal(session.designs, split.designs[:5])
    exact = problem.evaluate(split.designs[:5], split.tasks[:1])
    np.testing.assert_array_equal(session.log_merit, exact.log_merit)
    np.testing.assert_array_equal(session.values, exact.objectives[:, 0])
    np.testing.assert_array_equal(session.constraints, exact.constraints)
    np.testing.assert_array_equal(session.feasible, exact.feasible)


def test_a_batch_beyond_the_budget_is_evaluated_as_far_as_it_goes(session, shipped):
    _, split = shipped
    session.evaluate(split.designs[:8])
    with pytest.raises(Spent):
        session.evaluate(split.designs[8:11])
    assert session.count == 10
    np.testing.assert_array_equal(session.designs, split.designs[:10])
    with pytest.raises(Spent):
        session.evaluate(split.designs[0])
    assert session.count == 10


def test_a_start_is_handed_over_unevaluated(shipped):
    problem, split = shipped
    session = Session(problem, split.tasks[0], budget=3, start=split.starts[0])
    assert session.count == 0
    session.evaluate(session.start)
    assert session.count == 1


@pytest.mark.parametrize("value", [np.nan, np.inf, 1e9])
def test_designs_outside_the_bounds_are_refused_and_cost_nothing(session, shipped, value):
    problem, split = shipped
    design = split.designs[0].copy()
    design[-1] = value
    with pytest.raises(ValueError, match=f"{problem.variable_names[-1]} is .*search bounds"):
        session.evaluate(design)
    assert session.count == 0


def test_a_wrong_shape_is_refused(session, shipped):
    with pytest.raises(ValueError, match="a design must have the shape"):
        session.evaluate(np.ones(len(shipped[0].low) + 1))


def test_noise_disturbs_what_is_told_by_its_size_and_repeats(shipped):
    problem, split = shipped
    row = int(np.flatnonzero(split.solvable)[0])
    designs = np.repeat(split.designs[row][None], 4000, axis=0)

    def told():
        session = Session(problem, split.tasks[row], budget=4000, noise=0.01, seed=1)
        session.evaluate(designs)
        return session

    one, other = told(), told()
    np.testing.assert_array_equal(one.values, other.values)
    assert np.log(one.values / split.optima[row]).std() == pytest.approx(0.01, rel=0.1)
    exact = problem.evaluate(designs[:1], split.tasks[row][None])
    assert (one.constraints - exact.constraints).std() == pytest.approx(0.01, rel=0.1)
    assert one.log_merit.std() == pytest.approx(0.01, rel=0.1)


def test_a_delay_is_waited_for_each_design(shipped, monkeypatch):
    problem, split = shipped
    slept = []
    monkeypatch.setattr(time, "sleep", slept.append)
    session = Session(problem, split.tasks[0], budget=4, delay=0.05)
    session.evaluate(split.designs[:3])
    session.evaluate(split.designs[3])
    assert sum(slept) == pytest.approx(4 * 0.05)
