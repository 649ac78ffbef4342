"""The verbs of the benchmark: runs that go on where they were, tables, leaderboard, refusals."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pkm_gym.benchmark import SPLITS, EvaluationLog, load_split
from pkm_gym.benchmark.splits import Entry, manifest, sha256, write_manifest
from pkm_gym.core.pool import Pool
from pkm_gym.mechanisms import family_problem

QUICK = ("--split", "val", "--tasks", 3, "--evaluations", 14, "--jobs", 1)
FOLDER = Path("runs/diamond/benchmark/val")
METHODS = ("--method", "random", "--method", "interpolated", "--method", "start+cobyqa")


def test_benchmark_runs_methods_and_ranks_them_by_track(run):
    result = run("benchmark", "diamond", *QUICK, *METHODS, "--seeds", 2)
    assert result.exit_code == 0, result.output
    for words in (
        "diamond, val: regret in per cent",
        "free start, scratch",
        "free start, transfer",
        "given start, scratch",
        "interpolated after 12 evaluations is better on",
        "What was spent besides the evaluations on a task",
        "microseconds",
        "written: runs/diamond/benchmark/val",
    ):
        assert words in result.output
    logs = [EvaluationLog.load(path) for path in sorted(FOLDER.glob("*.npz"))]
    assert {log.setting.method for log in logs} == {"random", "interpolated", "start+cobyqa"}
    assert {log.setting.seed for log in logs} == {0, 1}
    assert all(len(log) == 3 for log in logs)
    assert {path.name for path in FOLDER.glob("*.png")} == {"regret.png", "solved.png"}
    with (FOLDER / "table.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert rows[0]["method"] == "interpolated"
    assert {row["tasks"] for row in rows} == {"3"}
    assert {row["seeds"] for row in rows} == {"2"}


def test_what_is_done_is_not_repeated_and_more_tasks_are_added(run):
    path = FOLDER / "random-14-seed0.npz"
    run("benchmark", "diamond", *QUICK, "--method", "random")
    first, written = EvaluationLog.load(path), path.stat().st_mtime_ns
    run("benchmark", "diamond", *QUICK, "--method", "random")
    assert path.stat().st_mtime_ns == written
    run("benchmark", "diamond", *QUICK[:3], 5, *QUICK[4:], "--method", "random")
    second = EvaluationLog.load(path)
    np.testing.assert_array_equal(second.designs[:3], first.designs)
    np.testing.assert_array_equal(second.seconds[:3], first.seconds)
    assert len(second) == 5


def test_score_prints_the_same_score_from_the_logs(run):
    ran = run("benchmark", "diamond", *QUICK, *METHODS).output
    scored = run("score", *sorted(FOLDER.glob("*.npz")))
    assert scored.exit_code == 0, scored.output
    assert scored.output.strip() in ran


def test_pool_sizes_are_drawn_against_regret(run):
    words = ("--method", "interpolated", "--pool", 256, "--pool", 1024)
    result = run("benchmark", "diamond", *QUICK, *words)
    assert result.exit_code == 0, result.output
    assert "interpolated, pool 256" in result.output
    assert (FOLDER / "pool.png").exists()


def test_the_leaderboard_keeps_one_line_a_method(run, tmp_path):
    board = tmp_path / "board.csv"
    words = ("benchmark", "diamond", *QUICK, "--leaderboard", board)
    run(*words, "--method", "random")
    run(*words, "--method", "random", "--method", "interpolated")
    with board.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["method"] for row in rows] == ["random", "interpolated"]
    assert all(row["command"] and row["version"] for row in rows)
    board.write_text("a,b\n1,2\n")
    result = run(*words, "--method", "random")
    assert result.exit_code == 2
    assert "board.csv' is no leaderboard" in result.stderr
    assert board.read_text() == "a,b\n1,2\n"


BAD = """
from pkm_gym.benchmark import method

@method()
def bad(view, training):
    raise RuntimeError("no idea")
"""


@pytest.mark.parametrize("others", [(), ("--method", "random")])
def test_a_method_that_fails_is_named_and_the_others_go_on(run, tmp_path, monkeypatch, others):
    (tmp_path / "bad_of_tests.py").write_text(BAD)
    monkeypatch.syspath_prepend(str(tmp_path))
    bad = ("--method", "bad_of_tests:bad")
    result = run("benchmark", "diamond", *QUICK, *bad, *others, "--seeds", 2)
    assert result.exit_code == 1
    assert "failed, and not ranked" in result.output
    assert "failed while it prepared: RuntimeError: no idea" in result.output
    assert (FOLDER / "table.csv").exists() == bool(others)
    assert ("written: runs" in result.output) == bool(others)


PAST = """
from pkm_gym.benchmark import method
from pkm_gym.mechanisms import family_problem

@method()
def past(view, training):
    family_problem(view.problem).evaluate(view.low[None])
    return lambda session: session.evaluate(view.low)
"""


def test_a_method_that_goes_past_the_door_is_named_and_enters_no_table(run, tmp_path, monkeypatch):
    (tmp_path / "past_of_tests.py").write_text(PAST)
    monkeypatch.syspath_prepend(str(tmp_path))
    past = ("--method", "past_of_tests:past", "--method", "random")
    result = run("benchmark", "diamond", *QUICK, *past, "--leaderboard", "board.csv")
    assert result.exit_code == 0, result.output
    assert "past_of_tests:past is not ranked: for a task it evaluated up to 1" in result.output
    for file in (FOLDER / "table.csv", Path("board.csv")):
        assert [row["method"] for row in csv.DictReader(file.read_text().splitlines())] == [
            "random"
        ]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("diamant",), "unknown mechanism 'diamant'; did you mean 'diamond'?"),
        (("diamond", "--split", "train"), "methods are measured on val, test, ood"),
        (("diamond", "--tasks", "999"), "--tasks is 999: val has 256 tasks"),
        (("diamond", "--method", "cobya"), "unknown method 'cobya'; did you mean 'cobyqa'?"),
        (("diamond", "--method", "nowhere:it"), "there is no module 'nowhere'"),
    ],
)
def test_mistakes_are_answered_in_one_sentence(run, words, sentence):
    result = run("benchmark", *words)
    assert result.exit_code == 2
    assert sentence in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


def test_an_optimum_that_is_beaten_is_bettered_from_the_log(run, tmp_path):
    problem, split = load_split("diamond", "val")
    split = split.only(np.flatnonzero(split.solvable)[:3])
    ways = 0.01 * (problem.high - problem.low) * np.random.default_rng(0).normal(size=(200, 3))
    around = np.clip(split.designs[1] + ways, problem.low, problem.high)
    kept = problem.evaluate(around, np.repeat(split.tasks[1:2], 200, axis=0)).feasible
    worse = np.array([split.designs[0], around[kept.argmax()], split.designs[2]])
    found = problem.evaluate(worse, split.tasks)
    assert found.feasible.all()
    folder, path = tmp_path / "mine", tmp_path / "mine" / "diamond_val.npz"
    replace(split, designs=worse, optima=found.objectives[:, 0]).save(path)
    load_split("diamond", "train")[1].save(folder / "diamond_train.npz")
    write_manifest({p.name: Entry(sha256(p), 100, 1.0) for p in folder.iterdir()}, folder)
    words = ("diamond", "--split", "val", "--folder", folder, "--method", "designer", "--jobs", 1)
    stopped = run("benchmark", *words)
    assert stopped.exit_code == 2
    assert "designer beats the certified optimum of val task 1 of diamond by" in stopped.stderr
    (log,) = FOLDER.glob("designer-*.npz")
    done = run("splits", "diamond", "--from", log, "-o", folder)
    assert done.exit_code == 0, done.output
    assert "from what designer found: 1 of 3 optima bettered" in done.stdout
    better = load_split("diamond", "val", folder)[1]
    np.testing.assert_array_equal(better.certified, [True, False, True])
    np.testing.assert_allclose(better.optima, split.optima, rtol=1e-9)
    np.testing.assert_array_equal(better.designs[[0, 2]], split.designs[[0, 2]])
    assert manifest(folder)[path.name].evaluations > 100
    assert run("benchmark", *words).exit_code == 0


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("diamond", "--from", "none.npz"), "none.npz' does not exist"),
        (("spr3", "--from", "log.npz"), "is a log of diamond, or of another version of it"),
        (("diamond", "--from", "log.npz", "--split", "test"), "one split at a time, not test, val"),
    ],
)
def test_logs_that_better_no_split_are_refused(run, refused, words, sentence):
    few = ("--split", "val", "--tasks", 1, "--evaluations", 2, "--jobs", 1)
    assert run("benchmark", "diamond", "--method", "random", *few).exit_code == 0
    (FOLDER / "random-2-seed0.npz").rename("log.npz")
    assert sentence in refused("splits", *words)


def test_score_refuses_what_is_no_log(run, tmp_path):
    result = run("score", tmp_path / "none.npz")
    assert result.exit_code == 2
    assert "none.npz' does not exist" in result.stderr


@pytest.mark.slow
@pytest.mark.parametrize("name", ["diamond", "spr3"])
def test_the_command_makes_the_shipped_split_again(run, tmp_path, name):
    result = run("splits", name, "--split", "val", "-o", tmp_path)
    assert result.exit_code == 0, result.output
    problem = family_problem(name)
    made, shipped = Pool.load(tmp_path / f"{name}_val.npz", problem), load_split(name, "val")[1]
    np.testing.assert_array_equal(made.tasks, shipped.tasks)
    np.testing.assert_array_equal(made.solvable, shipped.solvable)
    span = problem.high - problem.low
    np.testing.assert_allclose(made.starts / span, shipped.starts / span, atol=1e-6)
    solved = made.solvable
    np.testing.assert_allclose(
        made.designs[solved] / span, shipped.designs[solved] / span, atol=1e-6
    )
    np.testing.assert_allclose(made.optima[solved], shipped.optima[solved], rtol=1e-9)
    assert len(made) == SPLITS["val"]
