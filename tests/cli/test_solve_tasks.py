"""``pkm-gym solve-tasks``: pools that depend on the command alone, however often it is stopped."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.pool import ARRAYS, Pool
from pkm_gym.studies.search import solving

SOLVE = ("solve-tasks", "diamond", "-n", 7, "--seed", 3)


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    monkeypatch.setattr(solving, "CHUNK", 3)


@pytest.fixture
def stop_after(monkeypatch):
    """Have Ctrl-C pressed in the search that follows so many others."""
    whole = solving.solve_tasks

    def stop(chunks):
        calls = iter(range(chunks))

        def solve_or_stop(*arguments, **options):
            if next(calls, None) is None:
                raise KeyboardInterrupt
            return whole(*arguments, **options)

        monkeypatch.setattr(solving, "solve_tasks", solve_or_stop)

    yield stop
    monkeypatch.setattr(solving, "solve_tasks", whole)


def load(path, **arguments):
    return Pool.load(path, pkm_gym.make_problem("diamond", **arguments))


def test_a_pool_holds_the_family_s_tasks_with_feasible_optima(run, tmp_path):
    result = run(*SOLVE, "-o", "pool.npz")
    assert result.exit_code == 0, result.output
    problem = pkm_gym.make_problem("diamond")
    pool = load(tmp_path / "pool.npz")
    assert len(pool) == 7
    assert len(np.unique(pool.tasks, axis=0)) == 7
    assert ((pool.starts >= problem.low) & (pool.starts <= problem.high)).all()
    known = pool.solvable
    evaluation = problem.evaluate(pool.designs[known], pool.tasks[known])
    assert evaluation.feasible.all()
    assert np.array_equal(evaluation.objectives[:, 0], pool.optima[known])
    assert pool.command == "pkm-gym solve-tasks diamond -n 7 --seed 3"
    assert [path.name for path in tmp_path.iterdir()] == ["pool.npz"]
    assert f"solvable {known.sum()}" in " ".join(result.stdout.split())


def test_a_stopped_run_goes_on_and_ends_with_the_same_pool(run, tmp_path, stop_after):
    run(*SOLVE, "-o", "whole.npz")
    for chunks in (1, 1):
        stop_after(chunks)
        stopped = run(*SOLVE, "-o", "pool.npz")
        assert stopped.exit_code == 130
        assert "what is solved is kept in pool.npz.part" in stopped.stdout
        assert not (tmp_path / "pool.npz").exists()
    stop_after(1)
    finished = run(*SOLVE, "-o", "pool.npz")
    assert finished.exit_code == 0
    assert "more by an earlier run" in finished.stdout
    whole, resumed = load(tmp_path / "whole.npz"), load(tmp_path / "pool.npz")
    for name in ARRAYS:
        assert np.array_equal(getattr(whole, name), getattr(resumed, name), equal_nan=True)
    assert not (tmp_path / "pool.npz.part").exists()


def test_a_run_stopped_in_its_first_chunk_leaves_nothing(run, tmp_path, stop_after):
    stop_after(0)
    stopped = run(*SOLVE, "-o", "pool.npz")
    assert stopped.exit_code == 130
    assert "nothing is kept before the first 3 tasks are solved" in stopped.stdout
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "other",
    [
        ("solve-tasks", "diamond", "-n", 7, "--seed", 4),
        ("solve-tasks", "diamond", "-n", 8, "--seed", 3),
        (*SOLVE, "--set", "task.overlap=0.4"),
        (*SOLVE, "--fix", "lam_e=0.6"),
    ],
)
def test_the_part_of_another_run_is_refused_and_kept(run, refused, tmp_path, stop_after, other):
    stop_after(1)
    run(*SOLVE, "-o", "pool.npz")
    before = (tmp_path / "pool.npz.part").read_bytes()
    sentence = refused(*other, "-o", "pool.npz")
    assert sentence.startswith(
        "'pool.npz.part' was left by another run ('pkm-gym solve-tasks diamond -n 7 --seed 3')"
    )
    assert (tmp_path / "pool.npz.part").read_bytes() == before


@pytest.mark.parametrize("content", [b"", b"no pool", b"PK\x03\x04 cut"])
def test_a_damaged_part_is_refused_and_kept(refused, tmp_path, content):
    part = tmp_path / "pool.npz.part"
    part.write_bytes(content)
    said = refused(*SOLVE, "-o", "pool.npz")
    assert said.startswith("'pool.npz.part' is damaged or no npz file: expected a part of a pool; ")
    assert "delete it, or choose another file with -o" in said
    assert part.read_bytes() == content


def test_a_finished_pool_is_never_overwritten(refused, tmp_path):
    (tmp_path / "pool.npz").write_bytes(b"precious")
    assert refused(*SOLVE, "-o", "pool.npz").startswith("'pool.npz' exists: delete it")
    assert (tmp_path / "pool.npz").read_bytes() == b"precious"


def test_more_tasks_of_one_seed_begin_with_the_fewer(run, tmp_path):
    run("solve-tasks", "diamond", "-n", 3, "-o", "few.npz")
    run("solve-tasks", "diamond", "-n", 5, "-o", "more.npz")
    few, more = load(tmp_path / "few.npz"), load(tmp_path / "more.npz")
    for name in ARRAYS:
        assert np.array_equal(getattr(few, name), getattr(more, name)[:3], equal_nan=True)


def test_settings_reach_the_problem_and_the_tasks(run, tmp_path):
    words = ("--set", "task.overlap=0.4", "inertia=uniform-arm", "--fix", "lam_e=0.5")
    run("solve-tasks", "diamond", "-n", 2, *words, "--objective", "tau_rms")
    problem = {"inertia": "uniform-arm", "fixed": {"lam_e": 0.5}, "objective": "tau_rms"}
    pool = load(tmp_path / "runs/diamond/pool.npz", **problem)
    names = [item.name for item in pkm_gym.make_problem("diamond").task_variables]
    assert set(pool.tasks[:, names.index("overlap")]) == {0.4}
    assert pool.command.endswith(
        "--set task.overlap=0.4 --set inertia=uniform-arm --fix lam_e=0.5 --objective tau_rms"
    )


def test_tasks_that_are_not_certified_are_named(run, monkeypatch):
    whole = solving.solve_tasks

    def doubt(*arguments, **options):
        solutions = whole(*arguments, **options)
        return replace(solutions, certified=np.array([True, False, True])[: len(solutions.tasks)])

    monkeypatch.setattr(solving, "solve_tasks", doubt)
    text = " ".join(run("solve-tasks", "diamond", "-n", 6).stdout.split())
    assert "certified 4 66.7 %" in text
    assert "not certified, since two seeds differ by more than 1e-10: tasks 1, 4" in text


@pytest.mark.parametrize("words", [("-n", "0"), ("-n", "many"), ("--seed", "-1")])
def test_a_number_that_is_none_is_refused(refused, words):
    assert words[0] in refused("solve-tasks", "diamond", *words)
