"""The shipped tasks are those the command draws, and their optima are optima."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
import scipy.optimize

import pkm_gym
from pkm_gym.benchmark import splits
from pkm_gym.benchmark.splits import BEYOND, SPLITS, draw, load_split, split_path
from pkm_gym.core.pool import Pool
from pkm_gym.core.solve import solve_tasks
from pkm_gym.mechanisms import declaration

# Of a constraint, a difference of numbers near 1: another compiler or processor sums otherwise.
ROUNDING = 1e-15

UNMEASURED = [name for name in pkm_gym.problems() if not declaration(name).splits]


@pytest.mark.parametrize("split", SPLITS)
def test_what_is_shipped_is_what_is_drawn_bit_for_bit(shipped, split):
    problem, _ = shipped
    _, pool = load_split(problem.name, split)
    drawn = draw(problem, split)
    np.testing.assert_array_equal(pool.tasks, drawn.tasks)
    np.testing.assert_array_equal(pool.starts, drawn.starts)
    assert len(pool) == problem.declared.splits[split]
    assert pool.command.partition(" --from")[0] == f"pkm-gym splits {problem.name} --split {split}"


def test_no_task_is_in_two_splits(shipped):
    problem, _ = shipped
    rows = [load_split(problem.name, split)[1].tasks for split in SPLITS]
    tasks = np.concatenate(rows)
    assert len(np.unique(tasks, axis=0)) == len(tasks) == sum(problem.declared.splits.values())


@pytest.mark.parametrize("split", SPLITS)
def test_optima_lie_inside_every_limit_and_are_worth_what_is_said(shipped, split):
    problem, _ = shipped
    _, pool = load_split(problem.name, split)
    evaluation = problem.evaluate(pool.designs, pool.tasks)
    assert (evaluation.constraints[pool.solvable] <= -1e-12 + ROUNDING).all()
    np.testing.assert_allclose(
        evaluation.objectives[pool.solvable, 0], pool.optima[pool.solvable], rtol=1e-12
    )
    assert not evaluation.feasible[~pool.solvable].any()


def log_merits(problem, pool):
    """Return the log merits (n,) of a pool's optima."""
    return problem.evaluate(pool.designs, pool.tasks).log_merit


def test_other_seeds_find_the_same_optima(shipped):
    problem, pool = shipped
    pool = pool.first(3 if problem.declared.starts else 6)
    again = solve_tasks(problem, pool.tasks, seed=987)
    np.testing.assert_array_equal(again.solvable, pool.solvable)
    if problem.declared.searches == 1:  # most searches miss the best of so many basins
        assert (again.log_merit >= log_merits(problem, pool) - 1e-10).all()
        return
    kept = again.solvable
    np.testing.assert_allclose(again.optima[kept], pool.optima[kept], rtol=1e-9)


def test_no_other_optimiser_finds_better(shipped):
    problem, pool = shipped
    row = int(np.flatnonzero(pool.solvable)[0])
    task = pool.tasks[row : row + 1]

    def log_merit(designs):
        return problem.evaluate(np.ascontiguousarray(designs.T), task).log_merit

    few = bool(problem.declared.coarse)  # where an evaluation is dear
    found = scipy.optimize.differential_evolution(
        log_merit,
        list(zip(problem.low, problem.high, strict=True)),
        rng=3, popsize=15 if few else 30, maxiter=100 if few else 1200, tol=0.0, polish=False,
        vectorized=True, updating="deferred",
    )  # fmt: skip
    optimum = log_merits(problem, pool)[row]
    # One search ends near, no more, where more than two must agree: a problem of many basins. It
    # may end in any of them where there are so many that no two searches are asked to agree.
    near = 1e-10 if problem.declared.searches == 2 and not few else 1e-5
    assert optimum - 1e-10 <= found.fun
    assert found.fun <= optimum + near or problem.declared.searches == 1


def test_ood_asks_for_more_than_the_training_range_but_nothing_illegal(shipped):
    problem, _ = shipped
    tasks = load_split(problem.name, "ood")[1].tasks
    low, high, legal_low, legal_high = np.array(
        [(v.low, v.high, v.legal_low, v.legal_high) for v in problem.task_variables]
    ).T
    outside = (tasks < low) | (tasks > high)
    assert outside.any(axis=1).all()
    far = BEYOND * (high - low) + 1e-12
    assert ((tasks >= low - far) & (tasks <= high + far)).all()
    assert ((tasks >= legal_low) & (tasks <= legal_high)).all()
    for split in ("train", "val", "test"):
        inside = load_split(problem.name, split)[1].tasks
        assert ((inside >= low) & (inside <= high)).all()


@pytest.fixture
def copies(tmp_path, monkeypatch):
    """The shipped files in a folder where they may be spoilt."""
    folder = tmp_path / "data"
    shutil.copytree(splits.FOLDER, folder)
    monkeypatch.setattr(splits, "FOLDER", folder)
    monkeypatch.setattr(splits.manifest, "__defaults__", (folder,))
    return folder


@pytest.mark.usefixtures("copies")
def test_an_edited_file_is_refused_by_name(shipped):
    problem, pool = shipped
    path = split_path(problem.name, "val")
    Pool.save(pool.first(len(pool) - 1), path)
    with pytest.raises(ValueError, match=rf"{path.name}' was changed \(sha256 .*splits") as caught:
        load_split(problem.name, "val")
    assert "\n" not in str(caught.value)


def test_a_foreign_file_is_refused_by_name(shipped):
    problem, _ = shipped
    other = pkm_gym.make_problem(problem.name, bounds={problem.variable_names[0]: (0.3, 0.4)})
    path = split_path(problem.name, "val")
    with pytest.raises(
        ValueError, match=rf"{path.name}' is no pool: it belongs to another problem"
    ):
        Pool.load(path, other)


@pytest.mark.usefixtures("copies")
def test_a_missing_split_says_how_to_make_it(shipped):
    problem, _ = shipped
    split_path(problem.name, "val").unlink()
    with pytest.raises(ValueError, match=f"make it with `pkm-gym splits {problem.name}`"):
        load_split(problem.name, "val")


def test_unknown_splits_are_refused_with_the_closest_match(shipped):
    with pytest.raises(ValueError, match="unknown split 'tests'; did you mean 'test'"):
        load_split(shipped[0].name, "tests")


@pytest.mark.parametrize("name", UNMEASURED)
def test_a_problem_that_declares_no_splits_says_so(name):
    with pytest.raises(ValueError, match=f"^{name} declares no splits: no methods are measured"):
        load_split(name, "test")
