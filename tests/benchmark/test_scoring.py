"""Regret and score against arithmetic done by hand; nobody beats a certified optimum."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from pkm_gym.benchmark.record import EvaluationLog, Setting
from pkm_gym.benchmark.scoring import (
    duel,
    interval,
    median,
    quantile,
    regrets,
    score,
    share_feasible,
    share_within,
    violations,
)


def log_of(problem, rows, designs) -> EvaluationLog:
    how = Setting(
        problem.name, "val", problem.hash(), "", "stub", "", "free", "scratch", 0,
        designs.shape[1], 0,
    )  # fmt: skip
    return EvaluationLog(
        how, np.asarray(rows), designs, np.zeros(len(rows)), *np.zeros((2, len(rows)), int), "", ""
    )


def test_regret_is_the_log_of_value_over_optimum_of_the_best_feasible_design(shipped, rng):
    problem, split = shipped
    rows = np.flatnonzero(split.solvable)[:8]
    span = problem.high - problem.low
    near = split.designs[rows][:, None, :] + 0.05 * span * rng.uniform(-1, 1, (8, 60, len(span)))
    designs = np.clip(near, problem.low, problem.high)
    found = regrets(log_of(problem, rows, designs), problem, split)
    minimised = problem.objectives[0].direction == "minimise"
    assert np.isfinite(found[:, -1]).any()
    for i, row in enumerate(rows):
        best = math.inf
        for k in range(60):
            one = problem.evaluate(designs[i, k][None], split.tasks[row][None])
            if one.feasible[0]:
                ratio = one.objectives[0, 0] / split.optima[row]
                best = min(best, math.log(ratio if minimised else 1.0 / ratio))
            assert found[i, k] == pytest.approx(best, abs=1e-12)


def test_who_peeks_at_the_optimum_scores_one(shipped):
    problem, split = shipped
    rows = np.flatnonzero(split.solvable)[:16]
    found = regrets(log_of(problem, rows, split.designs[rows][:, None, :]), problem, split)
    assert score(found) == 1.0


def test_a_known_regret_gets_exactly_its_score():
    regret = np.full((2, 12), 1e-2)
    assert score(regret) == pytest.approx(2 / 8, abs=1e-15)
    regret[0, :6] = np.inf  # nothing feasible yet counts as a regret of 1 and more
    regret[1, 6:] = 1e-9  # below the floor nothing is gained
    assert score(regret) == pytest.approx((6 * 2 + 6 * 2 + 6 * 8) / (24 * 8), abs=1e-15)
    assert score(np.full((3, 300), 1.0)) == 0.0


def test_a_short_budget_keeps_its_last_regret():
    assert score(np.array([[1e-1, 1e-4]])) == pytest.approx((1 + 11 * 4) / (12 * 8))


def test_evaluations_after_the_twelfth_do_not_score():
    late = np.full((1, 300), np.inf)
    late[:, 12:] = 0.0
    assert score(late) == 0.0


def test_infinite_regrets_stay_in_the_quantiles():
    regret = np.array([[1.0], [2.0], [3.0], [np.inf]])
    assert quantile(1, 0.9)(regret) == np.inf
    assert median(1)(regret) == 3.0
    assert share_feasible(1)(regret) == 0.75
    assert share_within(1, 2.0)(regret) == 0.5


def test_beating_a_certified_optimum_stops_with_a_sentence(shipped, beside):
    problem, split = shipped
    rows = np.flatnonzero(split.solvable)[:4]
    log = log_of(problem, rows, split.designs[rows][:, None, :])
    worse = split.designs.copy()
    worse[rows[2]] = beside(problem, split.designs[rows[2:3]], split.tasks[rows[2:3]])[0]
    with pytest.raises(
        ValueError, match=f"stub beats the certified optimum of val task {rows[2]} "
    ) as caught:
        regrets(log, problem, replace(split, designs=worse))
    assert "\n" not in str(caught.value)


def test_unsolvable_tasks_are_measured_apart(shipped):
    problem, split = shipped
    if split.solvable.all():
        pytest.skip("every task of the split is solvable")
    log = log_of(problem, np.arange(len(split)), split.designs[:, None, :])
    assert len(regrets(log, problem, split)) == split.solvable.sum()
    np.testing.assert_allclose(violations(log, problem, split), 0.0, atol=1e-12)
    assert len(violations(log, problem, split)) == (~split.solvable).sum()


def test_the_bootstrap_interval_of_a_mean_is_that_of_statistics(rng):
    regret = 10.0 ** rng.normal(-3.0, 0.5, (1, 400, 1))
    found = interval(score, regret)
    values = -np.log10(regret[0, :, 0]) / 8
    half = 1.96 * values.std(ddof=1) / np.sqrt(400)
    assert found.value == pytest.approx(values.mean())
    assert found.low == pytest.approx(values.mean() - half, abs=0.25 * half)
    assert found.high == pytest.approx(values.mean() + half, abs=0.25 * half)


def test_seeds_count_with_their_median():
    regret = np.array([1e-1, 1e-2, 1e-6])[:, None, None] * np.ones((3, 5, 12))
    assert interval(median(12), regret).value == pytest.approx(1e-2)


def test_a_duel_counts_wins_and_bounds_their_share():
    one, other = np.full((1, 100), 1e-4), np.full((1, 100), 1e-2)
    other[0, :7] = 1e-5
    other[0, 7:9] = 1e-4
    found = duel(one, other)
    assert (found.share, found.tasks) == (0.91, 100)
    # Clopper and Pearson: at the lower bound, 91 wins or more have a probability of 5 %.
    tail = sum(
        math.comb(100, k) * found.low**k * (1 - found.low) ** (100 - k) for k in range(91, 101)
    )
    assert tail == pytest.approx(0.05, abs=1e-6)


def test_regrets_below_the_floor_and_infinite_ones_are_ties():
    one = np.array([[1e-9, np.inf, np.inf, 1e-3]])
    other = np.array([[0.0, np.inf, 1e-3, np.inf]])
    assert duel(one, other).share == 0.25
