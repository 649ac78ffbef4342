"""Logs become entries: one for each method, its seeds together, tracks apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pkm_gym.benchmark import EvaluationLog
from pkm_gym.benchmark.record import Cost, Setting
from pkm_gym.benchmark.splits import manifest, sha256, split_path
from pkm_gym.benchmark.standings import compare, pays_after, standings


@pytest.fixture
def logs(shipped, beside):
    """A log whose regret is that of a share of the way from a feasible design to the optimum."""
    problem, split = shipped
    rows = np.flatnonzero(split.solvable)[:6]
    starts = beside(problem, split.designs[rows], split.tasks[rows])

    def make(method="toy", seed=0, last=1.0, knowledge="scratch", rows=rows, budget=12):
        learned = problem.declared.splits["train"] if knowledge == "transfer" else 0
        how = Setting(
            problem.name, "val", problem.hash(), sha256(split_path(problem.name, "val")), method,
            "", "free", knowledge, seed, budget, learned,
        )  # fmt: skip
        own = starts[: len(rows), None, :] * np.ones((1, budget, 1))
        own[:, -1] += last * (split.designs[rows] - own[:, -1])
        return EvaluationLog(how, rows, own, np.full(len(rows), 0.12), "0", "made by a test")

    return make


def test_seeds_make_one_entry_and_the_best_score_comes_first(logs):
    entries = standings([logs(seed=1), logs("other", last=0.0), logs(seed=0)])
    assert [(entry.name, entry.seeds) for entry in entries] == [("toy", 2), ("other", 1)]
    assert entries[0].score.value > entries[1].score.value
    assert entries[0].median(12) <= 0.0 < entries[1].median(12)
    assert entries[0].seconds == pytest.approx(0.01)


def test_a_pool_is_paid_for_in_evaluations(logs, shipped):
    problem, _ = shipped
    transfer, scratch = standings([logs("known", knowledge="transfer"), logs(last=0.0, budget=100)])
    cost = manifest()[split_path(problem.name, "train").name].evaluations
    assert (transfer.cost.evaluations, scratch.cost.evaluations) == (cost, 0)
    # The other never comes as low within its 100 evaluations: 88 are saved a task.
    assert pays_after(transfer, [transfer, scratch]) == pytest.approx(cost / 88)
    assert pays_after(scratch, [transfer, scratch]) is None


def test_training_is_paid_for_and_a_log_is_scored_without_its_method(logs, tmp_path):
    path = tmp_path / "log.npz"
    replace(logs("nowhere:it"), training=Cost(1000, np.nan)).save(path)
    entry = standings([EvaluationLog.load(path)])[0]
    assert entry.name == "nowhere:it"
    assert entry.cost.evaluations == 1000
    assert np.isnan(entry.cost.seconds)


def test_methods_are_compared_on_the_tasks_they_share(logs):
    one, other = standings([logs(), logs("other", last=0.0, rows=logs().rows[:4])])
    found = compare(one, 12, other, 12)
    assert (found.share, found.tasks) == (1.0, 4)
    assert compare(one, 11, other, 12).share == 0.0  # alike before the last evaluation


def test_logs_that_do_not_belong_together_are_refused(logs):
    with pytest.raises(ValueError, match="the seeds of toy were run on different tasks"):
        standings([logs(), logs(seed=1, rows=logs().rows[:4])])
    log = logs()
    foreign = replace(log, setting=replace(log.setting, split="test"))
    with pytest.raises(ValueError, match="the logs must be of one problem and split"):
        standings([log, foreign])
    old = replace(log, setting=replace(log.setting, hash="0" * 64))
    with pytest.raises(ValueError, match=r"belongs to another version of .*: run it again"):
        standings([old])
