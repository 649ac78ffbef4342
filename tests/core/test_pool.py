"""Pools of solved tasks: what is written is read back, and nothing else is."""

from __future__ import annotations

import dataclasses
import io
import re
import zipfile

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import solve_tasks

ARRAYS = (
    "tasks", "starts", "designs", "optima", "active", "solvable", "constraints", "values",
    "certified",
)  # fmt: skip


@pytest.fixture(scope="module")
def pool(problem: DesignProblem) -> Pool:
    tasks = problem.draw_tasks(6, np.random.default_rng(1))
    starts = np.tile(problem.printed_design(), (6, 1))
    return Pool.from_solutions(solve_tasks(problem, tasks), starts, problem, "made by a test")


@pytest.fixture
def file(pool, tmp_path):
    path = tmp_path / "pool.npz"
    pool.save(path)
    return path


def refusal(path, problem: DesignProblem) -> str:
    with pytest.raises(ValueError, match=re.escape(repr(str(path)))) as caught:
        Pool.load(path, problem)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert (
        f"expected an npz file with {', '.join(ARRAYS)}, hash, command of {problem.name}"
        in sentence
    )
    return sentence


def test_pool_is_read_back_as_it_was_written(pool, file, problem):
    read = Pool.load(file, problem)
    for name in ARRAYS:
        one, other = getattr(pool, name), getattr(read, name)
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    assert (read.hash, read.command) == (problem.hash(), "made by a test")
    assert len(read) == 6


def test_pool_holds_what_was_solved(pool, problem):
    evaluation = problem.evaluate(pool.designs, pool.tasks)
    np.testing.assert_array_equal(pool.solvable, evaluation.feasible)
    assert pool.solvable.any()
    np.testing.assert_allclose(
        pool.optima[pool.solvable], evaluation.objectives[pool.solvable, 0], rtol=1e-12
    )


def test_saving_makes_the_folder_and_leaves_nothing_else(pool, problem, tmp_path):
    path = tmp_path / "new" / "folder" / "pool"
    pool.save(path)
    assert [item.name for item in path.parent.iterdir()] == ["pool"]
    assert len(Pool.load(path, problem)) == 6


def test_failed_save_keeps_the_old_file(pool, file, monkeypatch):
    def fail(handle, **_):
        handle.write(b"half of it")
        raise OSError("no space left on device")

    before = file.read_bytes()
    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(OSError, match="no space left"):
        pool.save(file)
    assert file.read_bytes() == before
    assert [item.name for item in file.parent.iterdir()] == [file.name]


def test_missing_file_and_folder_are_refused(problem, tmp_path):
    assert "does not exist" in refusal(tmp_path / "none.npz", problem)
    assert "cannot be read (Is a directory)" in refusal(tmp_path, problem)


@pytest.mark.parametrize("content", [b"", b"not a pool", b"PK\x03\x04 but no more"])
def test_foreign_file_is_refused(problem, tmp_path, content):
    path = tmp_path / "foreign.npz"
    path.write_bytes(content)
    assert "is damaged or no npz file" in refusal(path, problem)


def test_other_numpy_files_are_refused(problem, tmp_path):
    path = tmp_path / "array.npy"
    np.save(path, np.zeros(3))
    assert "is damaged or no npz file" in refusal(path, problem)
    path = tmp_path / "objects.npz"
    np.savez(path, tasks=np.array([{"a": 1}], dtype=object))
    assert "is damaged or no npz file" in refusal(path, problem)


def test_truncated_and_flipped_files_are_refused(file, problem):
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    assert "is damaged" in refusal(file, problem)
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        start = archive.getinfo("tasks.npy").header_offset
    flipped = bytearray(whole)
    for at in range(start + 120, start + 140):
        flipped[at] ^= 0xFF
    file.write_bytes(flipped)
    assert "is damaged" in refusal(file, problem)


@pytest.mark.parametrize("name", [*ARRAYS, "hash", "command"])
def test_missing_array_is_refused(pool, problem, tmp_path, name):
    path = tmp_path / "less.npz"
    content = dataclasses.asdict(pool)
    del content[name]
    np.savez(path, **content)
    assert f"lacks {name}:" in refusal(path, problem)


@pytest.mark.parametrize("name", ARRAYS)
def test_wrong_shape_or_type_is_refused(pool, problem, tmp_path, name):
    path = tmp_path / "wrong.npz"
    array = getattr(pool, name)
    for wrong in (array[..., None], array[:-1], array.astype(str), np.asarray(3.0)):
        np.savez(path, **dataclasses.asdict(pool) | {name: wrong})
        assert "of shape" in refusal(path, problem)


def test_senseless_numbers_are_refused(pool, problem, tmp_path):
    path = tmp_path / "wrong.npz"
    for name in ("tasks", "starts", "designs"):
        bad = getattr(pool, name).copy()
        bad[0, 0] = np.nan
        dataclasses.replace(pool, **{name: bad}).save(path)
        assert f"has {name} that are not finite" in refusal(path, problem)
    unknown = np.full(len(pool), np.nan)
    dataclasses.replace(pool, optima=unknown).save(path)
    assert "has solvable tasks without an optimum" in refusal(path, problem)
    illegal = pool.tasks.copy()
    illegal[2, 0] = problem.task_variables[0].legal_high + 1.0
    dataclasses.replace(pool, tasks=illegal).save(path)
    assert "has an illegal task (task row 2" in refusal(path, problem)


def test_pool_of_another_problem_is_refused(file, problem):
    variable = problem.variables[0]
    other = pkm_gym.make_problem(
        problem.name, bounds={variable.name: (variable.low, variable.high + 0.1)}
    )
    assert f"belongs to another problem (hash {problem.hash()[:12]})" in refusal(file, other)
