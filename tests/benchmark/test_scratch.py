"""Opponents that know no other tasks: counted, repeatable, in the box, better than chance."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np
import pytest

from pkm_gym.benchmark.methods import METHODS, find_method
from pkm_gym.benchmark.scratch import DIFFERENCE, UnitCube, descend, slsqp_inside
from pkm_gym.benchmark.session import Session, Spent
from pkm_gym.benchmark.view import View
from pkm_gym.core import merit

NAMES = [name for name, where in METHODS.items() if where.startswith("pkm_gym.benchmark.scratch:")]
SEARCHES = ["cobyqa", "cobyla", "slsqp", "slsqp-margin", "start+cobyqa", "de"]
BUDGET = 120
TASKS = 5


def search(name: str, shipped, row: int, *, budget: int = BUDGET, seed: int = 0) -> Session:
    problem, split = shipped
    found = find_method(name)
    start = split.starts[row] if found.start == "given" else None
    session = Session(problem, split.tasks[row], budget=budget, start=start, seed=seed)
    with suppress(Spent):
        found.prepare(View.of(problem), None)(session)
    return session


@pytest.fixture(scope="session")
def searched(shipped) -> Callable[[str], list[Session]]:
    """Return what a method did on the first solvable tasks; it runs once."""
    _, split = shipped
    known: dict[str, list[Session]] = {}

    def of(name: str) -> list[Session]:
        if name not in known:
            rows = np.flatnonzero(split.solvable)[:TASKS]
            known[name] = [search(name, shipped, int(row)) for row in rows]
        return known[name]

    return of


def reached(sessions: list[Session]) -> float:
    """Return the median over tasks of the answer's log merit, beyond any other if infeasible."""
    return float(np.median([
        e.log_merit[e.feasible].min() if e.feasible.any() else merit.WORST + e.log_merit.min()
        for e in sessions
    ]))  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_what_is_counted_is_what_was_evaluated(name, shipped, monkeypatch):
    problem, split = shipped
    evaluate, seen = problem.evaluate, []

    def instrumented(designs, tasks=None):
        seen.extend(np.array(designs))
        np.testing.assert_array_equal(tasks, split.tasks[:1])
        return evaluate(designs, tasks)

    monkeypatch.setattr(problem, "evaluate", instrumented)
    session = search(name, shipped, 0, budget=40)
    assert session.count == len(seen) == 40
    np.testing.assert_array_equal(session.designs, seen)


@pytest.mark.parametrize("name", NAMES)
def test_the_same_seed_repeats_every_design(name, shipped):
    one, other = (search(name, shipped, 0, budget=60, seed=7).designs for _ in range(2))
    np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("name", ["random", "sobol", "de"])
def test_another_seed_gives_other_designs(name, shipped):
    one, other = (search(name, shipped, 0, budget=8, seed=seed).designs for seed in (1, 2))
    assert not np.isin(one, other).any()


@pytest.mark.parametrize("name", NAMES)
def test_each_stays_in_the_box(name, searched, shipped):
    problem, _ = shipped
    for session in searched(name):
        designs = session.designs
        assert len(designs) == BUDGET
        assert (designs >= problem.low).all()
        assert (designs <= problem.high).all()


@pytest.fixture
def findable(shipped):
    """Skip where next to nothing feasible is found from nothing, whatever the method."""
    if shipped[0].declared.searches == 1:
        pytest.skip(f"{BUDGET} evaluations find nothing feasible among so many basins")


@pytest.mark.usefixtures("findable")
@pytest.mark.parametrize("name", SEARCHES)
def test_a_search_beats_chance_at_equal_evaluations(name, searched):
    assert reached(searched(name)) < reached(searched("random"))


@pytest.mark.usefixtures("findable")
@pytest.mark.parametrize("name", ["cobyqa", "cobyla", "slsqp", "slsqp-margin", "start+cobyqa"])
def test_most_local_searches_find_a_feasible_design(name, searched):
    assert sum(session.feasible.any() for session in searched(name)) > TASKS / 2


@pytest.mark.parametrize("name", ["cobyqa", "cobyla", "slsqp", "slsqp-margin"])
def test_no_point_is_paid_for_twice(name, searched):
    for session in searched(name):
        assert len(np.unique(session.designs, axis=0)) == BUDGET


def test_the_differences_of_slsqp_are_counted(searched, shipped):
    problem, _ = shipped
    span = problem.high - problem.low
    first = searched("slsqp")[0].designs[: len(span) + 1]
    moved = (first[1:] - first[0]) / span
    np.testing.assert_allclose(first[0], 0.5 * (problem.low + problem.high), rtol=1e-14)
    np.testing.assert_allclose(np.abs(moved), DIFFERENCE * np.eye(len(span)), rtol=1e-6, atol=1e-12)


def test_the_given_start_is_evaluated_first_and_paid_for(searched, shipped):
    _, split = shipped
    rows = np.flatnonzero(split.solvable)[:TASKS]
    firsts = [session.designs[0] for session in searched("start+cobyqa")]
    np.testing.assert_allclose(firsts, split.starts[rows], rtol=1e-14)


def test_descending_from_near_the_optimum_comes_closer(shipped):
    problem, split = shipped
    row = int(np.flatnonzero(split.solvable)[0])
    near = 0.99 * split.designs[row] + 0.01 * split.starts[row]
    session = Session(problem, split.tasks[row], budget=200)
    with suppress(Spent):
        descend(session, near, 0.002)
    optimum = problem.evaluate(split.designs[row][None], split.tasks[row][None]).log_merit[0]
    regrets = session.log_merit - optimum
    assert -1e-9 < regrets[session.feasible].min() < 2e-2 * abs(regrets[0])


def test_the_objective_is_the_log_merit_without_penalties(shipped, rng):
    problem, split = shipped
    session = Session(problem, split.tasks[0], budget=500)
    cube = UnitCube(session)
    offsets = []
    for point in rng.random((500, cube.dimensions)):
        evaluation = cube.evaluate(point)
        value, told = cube.objective(point), evaluation.log_merit[0]
        assert np.isfinite(value)
        assert ((cube.limits(point) <= 0.0) == (evaluation.constraints[0] <= 0.0)).all()
        if np.isnan(evaluation.values[0]):
            assert value == told
        elif told < merit.CAP:
            penalty = np.maximum(evaluation.constraints[0], 0.0).sum()
            offsets.append(told - problem.declared.penalty_weight * penalty - value)
    assert session.count == 500
    np.testing.assert_allclose(offsets, offsets[0], atol=1e-9)


def test_with_a_margin_slsqp_ends_at_a_feasible_design(shipped):
    problem, split = shipped
    row = int(np.flatnonzero(split.solvable)[0])
    session = Session(problem, split.tasks[row], budget=200)
    cube, near = UnitCube(session), 0.99 * split.designs[row] + 0.01 * split.starts[row]
    with suppress(Spent):
        slsqp_inside(cube, cube.point(near))
    active = split.active[row]
    held = session.constraints[session.feasible][:, active]
    assert session.feasible.any()
    assert (held.max(initial=-1.0) <= 0.0) or not active.any()
