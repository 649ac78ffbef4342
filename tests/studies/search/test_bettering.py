"""Descents from the optima of tasks nearby, and from evolutions: what they better."""

from __future__ import annotations

from dataclasses import replace
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from pkm_gym.benchmark import load_split
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, improved, solve_tasks
from pkm_gym.studies.search.bettering import _nearest, from_evolution, from_neighbours
from pkm_gym.studies.search.solving import Job

ROWS = 3


def job(problem: DesignProblem, solved: Solutions, folder: Path) -> Job:
    """Return the job that has solved the tasks; one task is bettered at a time."""
    return Job(problem, solved.tasks, solved.designs, 0, "a test", folder / "x.part", effort=4)


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


def test_what_is_bettered_is_kept_when_it_is_stopped(
    known: tuple[DesignProblem, Solutions], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, solved = known
    own = job(problem, solved, tmp_path)
    poor = replace(solved, solvable=np.zeros(ROWS, dtype=bool), log_merit=np.full(ROWS, 6.0))
    tasks = np.repeat(solved.tasks, problem.declared.neighbours, axis=0)
    neighbours = tasks, np.repeat(solved.designs, problem.declared.neighbours, axis=0)
    keep, kept, heard = Job.keep, [], StringIO()

    def stopped(own: Job, bettered: Solutions) -> None:
        keep(own, bettered)
        kept.append(bettered.solvable.sum())
        if len(kept) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(Job, "keep", stopped)
    with pytest.raises(KeyboardInterrupt):
        from_neighbours(own, poor, Console(file=heard, width=500), neighbours)
    assert kept == [1, 2]
    assert f"what is solved is kept in {own.part}: the same command goes on" in heard.getvalue()
    monkeypatch.undo()
    before = own.kept()
    assert before is not None
    np.testing.assert_array_equal(before.solvable, [True, True, False])
    found = from_neighbours(own, before, Console(quiet=True), neighbours)
    np.testing.assert_allclose(found.log_merit, solved.log_merit, rtol=0.0, atol=1e-9)
    assert found.evaluations > before.evaluations > poor.evaluations


@pytest.mark.slow
def test_an_evolution_finds_a_basin_to_which_hardly_a_descent_leads(tmp_path: Path) -> None:
    problem, split = load_split("stroke_leg_gait", "test")
    task = split.tasks[17:18]
    solved = solve_tasks(problem, task, seed=5)  # certified, and wrong
    found = from_evolution(job(problem, solved, tmp_path), solved, Console(quiet=True))
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
