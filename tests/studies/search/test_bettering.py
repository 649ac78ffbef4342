"""Descents from the optima of tasks nearby, and from evolutions: what they better."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from pkm_gym.benchmark import load_split
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, improved, solve_tasks
from pkm_gym.studies.search.bettering import _nearest, from_evolution

ROWS = 3


@pytest.fixture(scope="module")
def known() -> tuple[DesignProblem, Solutions]:
    problem, split = load_split("stroke_leg_gait", "val")
    rows = np.flatnonzero(split.solvable & split.certified)[:ROWS]
    return problem, solve_tasks(problem, split.tasks[rows], seed=0)


def test_a_missed_optimum_is_found_from_a_neighbour_and_then_only_the_best_known(
    known: tuple[DesignProblem, Solutions],
) -> None:
    problem, solved = known
    poor = replace(
        solved,
        designs=np.concatenate([0.5 * (problem.low + problem.high)[None], solved.designs[1:]]),
        log_merit=np.concatenate([[6.0], solved.log_merit[1:]]),
        solvable=np.array([False, True, True]),
    )
    found, gained = improved(problem, poor, solved.designs[:, None])
    np.testing.assert_array_equal(gained, [True, False, False])
    np.testing.assert_array_equal(found.certified, [False, True, True])
    np.testing.assert_allclose(found.log_merit, solved.log_merit, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(found.designs[1:], solved.designs[1:])
    assert found.evaluations > solved.evaluations


def test_an_optimum_that_is_told_with_more_digits_stays_certified(
    known: tuple[DesignProblem, Solutions],
) -> None:
    problem, solved = known
    coarse = replace(solved, log_merit=np.add(solved.log_merit, [5e-10, 1e-7, 0.0]))
    found, gained = improved(problem, coarse, solved.designs[:, None])
    np.testing.assert_array_equal(gained, [True, True, False])
    np.testing.assert_array_equal(found.certified, [True, False, True])


@pytest.mark.slow
def test_an_evolution_finds_a_basin_to_which_hardly_a_descent_leads() -> None:
    problem, split = load_split("stroke_leg_gait", "test")
    task = split.tasks[17:18]
    solved = solve_tasks(problem, task, seed=5)  # certified, and wrong
    found = from_evolution(problem, solved, Console(quiet=True))
    assert found.log_merit[0] < solved.log_merit[0] - 0.01
    assert found.evaluations > solved.evaluations
    assert not found.certified[0]
    assert found.optima[0] == pytest.approx(split.optima[17], rel=1e-5)


def test_neighbours_are_the_nearest_and_never_the_task_itself() -> None:
    problem, split = load_split("stroke_leg_gait", "val")
    span = np.array([v.high - v.low for v in problem.task_variables])
    apart = np.linalg.norm((split.tasks[:, None] - split.tasks[None]) / span, axis=-1)
    np.fill_diagonal(apart, np.inf)
    count = problem.declared.neighbours
    np.testing.assert_array_equal(
        np.sort(_nearest(problem, split.tasks, split.tasks, own=True)),
        np.sort(np.argsort(apart, axis=1)[:, :count]),
    )
    few = split.tasks[:5]
    nearest = _nearest(problem, few, split.tasks, own=False)
    np.testing.assert_array_equal(nearest[:, 0], np.arange(5))
