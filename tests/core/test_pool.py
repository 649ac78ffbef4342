"""Pools of solved tasks: what is written is read back, and nothing else is."""

from __future__ import annotations

import dataclasses
import io
import re
import zipfile

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.pool import Pool, renewed
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions

ARRAYS = (
    "tasks", "starts", "designs", "optima", "active", "solvable", "constraints", "values",
    "certified",
)  # fmt: skip


@pytest.fixture(scope="module")
def pool(family_problem: DesignProblem, solved: Solutions) -> Pool:
    """The first tasks of the Family, six of them solvable."""
    starts = np.tile(family_problem.printed_design(), (len(solved.tasks), 1))
    whole = Pool.from_solutions(solved, starts, family_problem, "made by a test")
    return whole.first(int(np.flatnonzero(whole.solvable)[5]) + 1)


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


def test_pool_is_read_back_as_it_was_written(pool, file, family_problem):
    read = Pool.load(file, family_problem)
    for name in ARRAYS:
        one, other = getattr(pool, name), getattr(read, name)
        assert one.dtype == other.dtype
        np.testing.assert_array_equal(one, other)
    assert (read.hash, read.command) == (family_problem.hash(), "made by a test")
    assert len(read) == len(pool)


def test_pool_holds_what_was_solved(pool, family_problem):
    evaluation = family_problem.evaluate(pool.designs, pool.tasks)
    np.testing.assert_array_equal(pool.solvable, evaluation.feasible)
    assert pool.solvable.any()
    np.testing.assert_allclose(
        pool.optima[pool.solvable], evaluation.objectives[pool.solvable, 0], rtol=1e-12
    )


def test_saving_makes_the_folder_and_leaves_nothing_else(pool, family_problem, tmp_path):
    path = tmp_path / "new" / "folder" / "pool"
    pool.save(path)
    assert [item.name for item in path.parent.iterdir()] == ["pool"]
    assert len(Pool.load(path, family_problem)) == len(pool)


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


def test_truncated_and_flipped_files_are_refused(file, family_problem):
    whole = file.read_bytes()
    file.write_bytes(whole[: len(whole) // 2])
    assert "is damaged" in refusal(file, family_problem)
    with zipfile.ZipFile(io.BytesIO(whole)) as archive:
        start = archive.getinfo("tasks.npy").header_offset
    flipped = bytearray(whole)
    for at in range(start + 120, start + 140):
        flipped[at] ^= 0xFF
    file.write_bytes(flipped)
    assert "is damaged" in refusal(file, family_problem)


@pytest.mark.parametrize("name", [*ARRAYS, "hash", "command"])
def test_missing_array_is_refused(pool, family_problem, tmp_path, name):
    path = tmp_path / "less.npz"
    content = dataclasses.asdict(pool)
    del content[name]
    np.savez(path, **content)
    assert f"lacks {name};" in refusal(path, family_problem)


@pytest.mark.parametrize("name", ARRAYS)
def test_wrong_shape_or_type_is_refused(pool, family_problem, tmp_path, name):
    path = tmp_path / "wrong.npz"
    array = getattr(pool, name)
    for wrong in (array[..., None], array[:-1], array.astype(str), np.asarray(3.0)):
        np.savez(path, **dataclasses.asdict(pool) | {name: wrong})
        assert "of shape" in refusal(path, family_problem)


def test_senseless_numbers_are_refused(pool, family_problem, tmp_path):
    path = tmp_path / "wrong.npz"
    for name in ("tasks", "starts", "designs"):
        bad = getattr(pool, name).copy()
        bad[0, 0] = np.nan
        dataclasses.replace(pool, **{name: bad}).save(path)
        assert f"has {name} that are not finite" in refusal(path, family_problem)
    unknown = np.full(len(pool), np.nan)
    dataclasses.replace(pool, optima=unknown).save(path)
    assert "has solvable tasks without an optimum" in refusal(path, family_problem)
    illegal = pool.tasks.copy()
    illegal[2, 0] = family_problem.task_variables[0].legal_high + 1.0
    dataclasses.replace(pool, tasks=illegal).save(path)
    assert "has an illegal task (task row 2" in refusal(path, family_problem)


def test_pool_of_another_problem_is_refused(file, family_problem):
    variable = family_problem.variables[0]
    other = pkm_gym.make_problem(
        family_problem.name, bounds={variable.name: (variable.low, variable.high + 0.1)}
    )
    assert f"belongs to another problem (hash {family_problem.hash()[:12]})" in refusal(file, other)


# Older files --------------------------------------------------------------------------------------

NEWER = ("constraints", "values", "certified")


def older(pool, path, **changes):
    """Write a pool as it was before the newer arrays, and under another hash."""
    content = dataclasses.asdict(pool) | {"hash": "0" * 64} | changes
    np.savez(path, **{name: array for name, array in content.items() if name not in NEWER})
    return path


def test_an_older_file_is_renewed_to_what_it_would_be(pool, family_problem, tmp_path):
    path = older(pool, tmp_path / "old.npz")
    assert "lacks constraints, values, certified" in refusal(path, family_problem)
    again = renewed(path, family_problem, certified=True)
    for name in ARRAYS:
        one, other = getattr(pool, name), getattr(again, name)
        if name != "certified":
            np.testing.assert_array_equal(one, other, err_msg=name)
    assert again.certified.all()
    assert not renewed(path, family_problem, certified=False).certified.any()
    assert (again.hash, again.command) == (family_problem.hash(), "made by a test")
    again.save(path)
    assert len(Pool.load(path, family_problem)) == len(pool)


def test_what_a_file_says_of_certificates_is_kept(pool, family_problem, tmp_path):
    said = np.arange(len(pool)) % 2 == 0
    dataclasses.replace(pool, certified=said, hash="0" * 64).save(tmp_path / "a.npz")
    for certified in (True, False):
        again = renewed(tmp_path / "a.npz", family_problem, certified=certified)
        np.testing.assert_array_equal(again.certified, said)


def test_an_edited_optimum_is_not_renewed(pool, family_problem, tmp_path):
    row = int(np.flatnonzero(pool.solvable)[1])
    optima = pool.optima.copy()
    optima[row] *= 1.0 + 1e-6
    path = older(pool, tmp_path / "old.npz", optima=optima)
    with pytest.raises(ValueError, match=f"the optimum of its task {row} is .* solve its tasks"):
        renewed(path, family_problem, certified=True)
    designs = pool.designs.copy()
    designs[row] = 2.0 * family_problem.high
    path = older(pool, tmp_path / "old.npz", designs=designs)
    with pytest.raises(ValueError, match=f"the optimum of its task {row} is") as refused:
        renewed(path, family_problem, certified=True)
    assert "\n" not in str(refused.value)


def test_what_is_no_older_pool_is_not_renewed(pool, family_problem, tmp_path):
    path = tmp_path / "less.npz"
    np.savez(path, tasks=pool.tasks)
    with pytest.raises(ValueError, match="lacks starts, designs, optima, active, solvable, comm"):
        renewed(path, family_problem, certified=True)
    with pytest.raises(ValueError, match="does not exist"):
        renewed(tmp_path / "none.npz", family_problem, certified=True)
