"""Descents from many starts, on problems whose optimum is known otherwise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.descent import descend
from pkm_gym.core.evolution import evolve, gather
from pkm_gym.core.merit import TOLERANCE
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import polish, solve_tasks


@pytest.fixture(scope="module")
def leg() -> DesignProblem:
    return pkm_gym.make_problem("stroke_leg_gait")


@pytest.mark.parametrize(("name", "n"), [("stroke_leg_gait", 3000), ("pus6_layout", 300)])
def test_pieces_break_just_where_limits_do(name: str, n: int) -> None:
    problem, rng = pkm_gym.make_problem(name), np.random.default_rng(4)
    designs = problem.low + (problem.high - problem.low) * rng.random((n, len(problem.low)))
    tasks = problem.draw_tasks(n, rng)
    evaluation, pieces = problem.evaluate(designs, tasks), problem.pieces(designs, tasks)
    assert np.isfinite(pieces).all()
    defined = evaluation.unreached <= 0.0
    assert ((pieces[:, 1:] <= TOLERANCE).all(axis=1) == evaluation.feasible)[defined].all()
    assert (pieces[~defined, 1:] > TOLERANCE).any(axis=1).all()
    log = problem.objectives[0].sign * np.log(evaluation.objectives[defined, 0])
    np.testing.assert_allclose(pieces[defined, 0], log, rtol=1e-14)


def test_pieces_of_any_problem_are_its_objective_and_constraints(problem: DesignProblem) -> None:
    rng = np.random.default_rng(4)
    designs = problem.low + (problem.high - problem.low) * rng.random((200, len(problem.low)))
    pieces = DesignProblem.pieces(problem, designs, problem.pack(None)[None])
    evaluation = problem.evaluate(designs)
    assert np.isfinite(pieces).all()
    np.testing.assert_array_equal(pieces[:, 1:], evaluation.constraints + TOLERANCE)


def test_a_descent_finds_what_evolution_finds() -> None:
    """On the leg's own problem, which evolution solves by itself."""
    leg = pkm_gym.make_problem("stroke_leg")
    task = leg.pack(None)[None]
    wanted = solve_tasks(leg, task)
    leg.declared = replace(leg.declared, starts=4)  # type: ignore[misc]  # of this object alone
    found = descend(leg, task, np.random.default_rng(0))
    assert found.solvable.all()
    np.testing.assert_allclose(found.log_merit, wanted.log_merit, rtol=0.0, atol=1e-8)


def test_a_search_does_not_depend_on_the_other_tasks(leg: DesignProblem) -> None:
    tasks = leg.draw_tasks(2, np.random.default_rng(1))
    both = descend(leg, tasks, np.random.default_rng(7))
    first = descend(leg, tasks[:1], np.random.default_rng(7))
    np.testing.assert_array_equal(both.designs[:1], first.designs)


def test_a_polish_stays_near_and_is_never_worse(leg: DesignProblem) -> None:
    optimum = leg.design(next(iter(leg.reference.optima.values())).design)
    start = optimum + 0.005 * (leg.high - leg.low)
    found = polish(leg, start[None])
    assert (np.abs(found[0] - start) <= 0.0201 * (leg.high - leg.low)).all()
    before, after = leg.evaluate(start[None]), leg.evaluate(found)
    assert after.feasible[0]
    assert not before.feasible[0] or after.objectives[0, 0] <= before.objectives[0, 0]


def test_gathered_starts_stand_apart_the_best_one_first() -> None:
    screws = pkm_gym.make_problem("pus6", sampling="coarse")
    task = screws.draw_tasks(1, np.random.default_rng(3))
    starts, evaluations = gather(screws, task[0], np.random.default_rng(1), 6)
    assert evaluations > len(starts) == 6
    assert ((starts >= screws.low) & (starts <= screws.high)).all()
    merits = screws.evaluate(starts, np.repeat(task, 6, axis=0)).log_merit
    best = evolve(screws, task, np.random.default_rng(2)).log_merit[0]
    assert merits[0] == merits.min() < best + 0.1
    unit = (starts - screws.low) / (screws.high - screws.low)
    distances = np.abs(unit[:, None] - unit).max(axis=-1)[np.triu_indices(6, 1)]
    assert distances.min() > 0.0
    assert distances[0] == np.abs(unit[1] - unit[0]).max() >= 0.05


def test_descents_from_gathered_starts_find_what_evolution_finds() -> None:
    screws = pkm_gym.make_problem("pus6")
    assert screws.declared.coarse
    tasks = screws.draw_tasks(2, np.random.default_rng(3))
    found = descend(screws, tasks, np.random.default_rng(0))
    wanted = evolve(screws, tasks, np.random.default_rng(0))
    assert found.evaluations < 0.6 * wanted.evaluations  # half, some more on one machine or another
    np.testing.assert_allclose(found.log_merit, wanted.log_merit, rtol=0.0, atol=1e-8)
