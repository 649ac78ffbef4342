"""Interpolation between solved tasks, and the ladder of corrected limits."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest

from pkm_gym.benchmark import Evaluator, Interpolation, Spent, load_split
from pkm_gym.benchmark.transfer import (
    climb,
    interpolated,
    interpolated_cobyqa,
    neighbours,
)

BUDGET = 12


@pytest.fixture(scope="module")
def pool(shipped):
    return load_split(shipped[0].name, "train")[1]


@pytest.fixture(scope="module")
def interpolation(shipped, pool):
    return Interpolation(shipped[0], pool)


def test_known_tasks_are_given_back_their_optima(interpolation, shipped, pool):
    problem, _ = shipped
    rows = [
        row
        for row in np.flatnonzero(pool.solvable)[:40]
        if tuple(np.flatnonzero(pool.active[row]).tolist()) in interpolation.branches
    ]
    for row in rows:
        branch = interpolation.branches[tuple(np.flatnonzero(pool.active[row]).tolist())]
        found = interpolation.design(branch, interpolation.place(pool.tasks[row]))
        span = problem.high - problem.low
        np.testing.assert_allclose(found / span, pool.designs[row] / span, atol=1e-6)


def test_a_limit_moves_its_constraint_and_no_other(interpolation, shipped, pool):
    problem, _ = shipped
    fields = [i for i, v in enumerate(problem.task_variables) if v.drawn and v.limit]
    moved = [interpolation.limit_of(j) for j in range(len(problem.constraint_names))]
    assert sorted(field for field in moved if field is not None) == fields
    for j, field in enumerate(moved):
        if field is None:
            continue
        row = int(np.flatnonzero(pool.solvable)[3])
        task, h = pool.tasks[row].copy(), 1e-5
        span = interpolation._span[field]
        task[field] = 0.5 * (problem.task_variables[field].low + problem.task_variables[field].high)
        ahead, behind = task.copy(), task.copy()
        ahead[field], behind[field] = task[field] + h * span, task[field] - h * span
        design = pool.designs[row][None]
        ends = [problem.evaluate(design, t[None]).constraints[0, j] for t in (ahead, behind)]
        tighter = -1.0 if problem.task_variables[field].limit == "upper" else 1.0
        assert tighter * (ends[0] - ends[1]) > 0.0


def test_neighbours_are_the_optima_of_the_nearest_tasks(interpolation, shipped, pool):
    problem, split = shipped
    span = [max(v.high - v.low, 1e-9) for v in problem.task_variables]
    known = pool.solvable
    distance = np.linalg.norm((pool.tasks[known] - split.tasks[0]) / span, axis=1)
    nearest = pool.designs[known][np.argsort(distance)[:5]]
    np.testing.assert_array_equal(interpolation.nearest(split.tasks[0], 5), nearest)


def regret(problem, split, row, search, budget=BUDGET):
    evaluator = Evaluator(problem, split.tasks[row], budget=budget, seed=row)
    with suppress(Spent):
        search(evaluator)
    feasible = evaluator.feasible
    optimum = problem.evaluate(split.designs[row][None], split.tasks[row][None]).log_merit[0]
    return evaluator.log_merit[feasible].min(initial=np.inf) - optimum, evaluator.count


def test_the_ladder_comes_closer_than_neighbours(shipped, pool, interpolation):
    problem, split = shipped
    rows = np.flatnonzero(split.solvable)[:24].tolist()
    near = neighbours.prepare(problem, pool)
    found = np.array([
        [regret(problem, split, row, search)[0] for row in rows]
        for search in (
            near,
            lambda e: climb(interpolation, e, 1),
            lambda e: climb(interpolation, e, BUDGET),
        )
    ])  # fmt: skip
    by_neighbours, first, last = np.median(found, axis=1)
    assert last < 0.1 * by_neighbours
    assert last <= first
    assert np.isfinite(found[2]).mean() > 0.75


def test_cobyqa_goes_on_where_the_ladder_ends(shipped, pool):
    problem, split = shipped
    rows = np.flatnonzero(split.solvable)[:6].tolist()
    ladder, further = (m.prepare(problem, pool) for m in (interpolated, interpolated_cobyqa))
    for row in rows:
        _, count = regret(problem, split, row, ladder, budget=60)
        assert count <= BUDGET  # the ladder ends
    climbed = [regret(problem, split, row, ladder, budget=60)[0] for row in rows]
    refined = [regret(problem, split, row, further, budget=60)[0] for row in rows]
    assert np.median(refined) < np.median(climbed)


def test_a_pool_that_is_too_small_is_refused(shipped, pool):
    with pytest.raises(ValueError, match=r"the pool has \d solvable tasks: interpolation needs"):
        Interpolation(shipped[0], pool.first(5))
