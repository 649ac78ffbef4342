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
    rows = np.flatnonzero(split.solvable)[:30]
    starts = beside(problem, split.designs[rows], split.tasks[rows])
    moved = (starts != split.designs[rows]).any(axis=1)  # an optimum may leave no room beside it
    rows, starts = rows[moved][:6], starts[moved][:6]

    def make(method="toy", seed=0, last=1.0, knowledge="scratch", rows=rows, budget=12):
        learned = problem.declared.splits["train"] if knowledge == "transfer" else 0
        how = Setting(
            problem.name, "val", problem.hash(), sha256(split_path(problem.name, "val")), method,
            "", "free", knowledge, seed, budget, learned,
        )  # fmt: skip
        own = starts[: len(rows), None, :] * np.ones((1, budget, 1))
        own[:, -1] += last * (split.designs[rows] - own[:, -1])
        counts = np.zeros((2, len(rows)), dtype=np.int64)
        return EvaluationLog(
            how, rows, own, np.full(len(rows), 0.12), *counts, "0", "made by a test"
        )

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
    replace(logs("nowhere:it", knowledge="transfer"), training=Cost(1000, np.nan)).save(path)
    entry = standings([EvaluationLog.load(path)])[0]
    assert entry.name == "nowhere:it"
    assert entry.cost.evaluations == entry.pool.evaluations + 1000
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


def twice(log):
    return {"rows": np.repeat(log.rows[:1], len(log))}


def gone(log):
    designs = log.designs.copy()
    designs[:, 0] = np.nan
    return {"designs": designs}


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (twice, "its rows must number different tasks"),
        (lambda log: {"rows": log.rows - 1000}, "its rows must number different tasks"),
        (lambda log: {"rows": log.rows + 0.5}, "rows is float64 of shape"),
        (gone, "finite up to the last that was evaluated"),
        (lambda log: {"designs": np.full_like(log.designs, np.inf)}, "finite up to the last"),
        (lambda log: {"designs": log.designs[:, :3]}, "12 designs a task"),
        (lambda log: {"seconds": -log.seconds}, "must be numbers from 0 on"),
        (lambda _: {"training_evaluations": -5}, "must be numbers from 0 on"),
        (lambda log: {"outside": log.outside - 1}, "its counts of evaluations must be"),
        (lambda _: {"start": "easy"}, "start is 'easy', it must be given or free"),
        (lambda _: {"knowledge": "all"}, "knowledge is 'all', it must be transfer or scratch"),
        (lambda _: {"pool": 7}, "it knew 7 training tasks and was trained with 0 eval"),
        (lambda _: {"training_evaluations": 9}, "was trained with 9 evaluations in the track"),
        (lambda _: {"knowledge": "transfer"}, "it knew no training tasks and had no training"),
    ],
)
def test_a_log_that_no_run_writes_is_refused(logs, tmp_path, change, sentence):
    log, path = logs(), tmp_path / "log.npz"
    log.save(path)
    with np.load(path) as archive:
        content = dict(archive) | change(log)
    np.savez(path, **content)
    with pytest.raises(ValueError, match=rf"log.npz' is no log of a run: .*{sentence}"):
        EvaluationLog.load(path)


def test_designs_that_a_benchmark_would_not_evaluate_are_refused(logs, shipped):
    problem, split = shipped
    log = logs()
    outside = log.designs.copy()
    outside[2, 3, 0] = problem.high[0] + 1e-9
    with pytest.raises(ValueError, match=rf"{problem.variable_names[0]} = .* designs lie within"):
        standings([replace(log, designs=outside)])
    with pytest.raises(ValueError, match=rf"variables: {problem.name} has {len(problem.low)}$"):
        standings([replace(log, designs=log.designs[:, :, :1])])
    far = log.rows + len(split)
    with pytest.raises(ValueError, match=rf"has a task {far[-1]}: the val split .* {len(split)}"):
        standings([replace(log, rows=far)])
