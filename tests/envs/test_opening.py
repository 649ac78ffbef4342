"""Where a session starts: its task, its first design, the options of a reset."""

from __future__ import annotations

import dataclasses

import gymnasium as gym
import numpy as np
import pytest

import pkm_gym
from pkm_gym.benchmark import SPLITS, Interpolation, load_split
from pkm_gym.benchmark.splits import split_file
from pkm_gym.mechanisms import declaration, family_problem


def start_of(env, **arguments) -> np.ndarray:
    _, info = env.reset(**arguments)
    assert list(info["best_design"]) == [v.name for v in env.problem.all_variables]
    return np.array([info["best_design"][name] for name in env.problem.variable_names])


def test_centre_is_the_default_start(env_id, make):
    env = make(env_id)
    for seed in range(3):
        np.testing.assert_allclose(
            start_of(env, seed=seed), (env.problem.low + env.problem.high) / 2
        )


def test_random_starts_fill_the_box(env_id, make):
    env = make(env_id, start="random")
    starts = np.array([start_of(env, seed=seed) for seed in range(200)])
    share = (starts - env.problem.low) / (env.problem.high - env.problem.low)
    assert (share >= 0).all()
    assert (share <= 1).all()
    np.testing.assert_allclose(share.mean(axis=0), 0.5, atol=0.1)
    assert (share.min(axis=0) < 0.05).all()
    assert (share.max(axis=0) > 0.95).all()


def test_fixed_id_has_the_papers_task_or_the_given_one(fixed_id, make, other_task):
    env = make(fixed_id)
    env.reset(seed=0)
    assert env.problem.unpack(env.session.tasks[0]) == env.problem.task_type()
    other = other_task(env.problem)
    env = make(fixed_id, task=other)
    _, info = env.reset(seed=0)
    assert other.items() <= info["task"].items()


def test_family_draws_legal_tasks_within_its_range(family_id, make):
    env = make(family_id)
    tasks = np.array([list(env.reset(seed=seed)[1]["task"].values()) for seed in range(100)])
    for column, field in zip(tasks.T, env.problem.task_variables, strict=True):
        assert (column >= field.low).all()
        assert (column <= field.high).all()
        assert (len(set(column)) == 100) == field.drawn
        if not field.drawn:
            assert set(column) == {field.default}


def test_start_of_a_pool_is_the_one_stored_with_the_task(family_id, make, pools):
    pool, file = pools
    env = make(family_id, start="pool", pool=str(file))
    seen = set()
    for seed in range(100):
        start = start_of(env, seed=seed)
        row = int(np.flatnonzero((pool.tasks == env.session.tasks[0]).all(axis=1))[0])
        np.testing.assert_array_equal(start, pool.starts[row])
        seen.add(row)
    assert seen == set(np.flatnonzero(pool.solvable))


def test_fixed_id_starts_where_the_pool_says(fixed_id, make, paper_pool, other_task):
    pool, file = paper_pool
    env = make(fixed_id, start="pool", pool=str(file))
    np.testing.assert_array_equal(start_of(env), pool.starts[0])
    with pytest.raises(ValueError, match=r"has no stored optimum: it isn't in .*npz"):
        make(fixed_id, start="pool", pool=str(file), task=other_task(env.problem))


def test_a_pool_may_be_its_file_itself_or_a_split_by_name(family_id, make, pools):
    pool, file = pools
    ways = [{"pool": pool}, {"pool": file}, {"pool": str(file)}]
    starts = [start_of(make(family_id, start="pool", **way), seed=5) for way in ways]
    np.testing.assert_array_equal(starts, np.tile(starts[0], (3, 1)))


@pytest.mark.parametrize("split", SPLITS)
def test_a_split_is_found_by_its_name(make, split):
    env = make("PKM/DiamondFamily-v0", pool=split, reward="regret")
    _, pool = load_split("diamond", split)
    for seed in range(5):
        env.reset(seed=seed)
        row = np.flatnonzero((pool.tasks == env.session.tasks[0]).all(axis=1))
        assert pool.solvable[row].all()
        assert len(row)


@pytest.mark.parametrize("name", [n for n in pkm_gym.problems() if declaration(n).splits])
def test_starts_are_interpolated_between_the_other_optima_of_a_pool(name, make, rng):
    problem = family_problem(name)
    if not split_file(problem, "val").exists():
        pytest.skip("its splits aren't made")
    env = make(
        f"PKM/{problem.declared.environment}Family-v0",
        pool="val", start="interpolated", reward="regret",
    )  # fmt: skip
    _, pool = load_split(name, "val")
    pool = pool.only(pool.solvable)
    fold = np.arange(len(pool)) % 8
    start = start_of(env, seed=3)
    (row,) = np.flatnonzero((pool.tasks == env.session.tasks[0]).all(axis=1))
    others = Interpolation(problem, pool.only(fold != fold[row]))
    np.testing.assert_allclose(start, others.designs(pool.tasks[[row]])[0], rtol=1e-6)
    given = problem.low + 0.4 * (problem.high - problem.low)
    np.testing.assert_array_equal(start_of(env, options={"design": given}), given)
    elsewhere = make(env.spec, pool="val", start="interpolated", reward="improvement")
    task = problem.draw_tasks(1, rng)
    expected = Interpolation(problem, pool).designs(task)[0]
    np.testing.assert_allclose(start_of(elsewhere, options={"task": task[0]}), expected, rtol=1e-6)


def test_sessions_side_by_side_start_between_the_optima_too(make):
    arguments = {"pool": "val", "start": "interpolated"}
    envs = gym.make_vec("PKM/DiamondFamily-v0", num_envs=3, **arguments)
    one = make("PKM/DiamondFamily-v0", **arguments)
    envs.reset(seed=4)
    for i in range(3):
        np.testing.assert_array_equal(start_of(one, seed=4 + i), envs.session.best.designs[i])


def test_the_papers_task_starts_between_the_optima_of_the_family(make):
    env = make("PKM/Diamond-v0", pool="val", start="interpolated")
    env.reset(seed=0)
    *_, info = env.step(np.zeros(3))
    assert info["merit"] < 1.2


def test_a_pool_that_can_t_serve_is_refused_in_one_sentence(family_id, make, pools):
    pool, _ = pools
    variable = make(family_id).problem.variables[0]
    high = 0.5 * (variable.low + variable.high)
    for arguments, sentence in (
        (
            {"pool": dataclasses.replace(pool, hash="0" * 64)},
            r"the pool .* belongs to another problem",
        ),
        ({"pool": dataclasses.replace(pool, starts=pool.starts[:1])}, "the pool .* starts is"),
        ({"pool": pool, "start": "interpolated"}, r"the pool has \d solvable tasks: interpolation"),
        ({"start": "interpolated"}, "start='interpolated' needs solved tasks: give pool="),
        ({"pool": "train", "bounds": {variable.name: (variable.low, high)}}, "'train'|splits"),
        ({"pool": "trian"}, "'trian' does not exist"),
    ):
        with pytest.raises(ValueError, match=sentence) as refusal:
            make(family_id, **arguments)
        assert "\n" not in str(refusal.value)


def test_pool_leaves_another_start_alone(family_id, make, pools):
    _, file = pools
    env = make(family_id, pool=str(file))
    np.testing.assert_allclose(start_of(env), (env.problem.low + env.problem.high) / 2)


def test_bad_pool_is_refused_at_construction(family_id, make, pools, tmp_path):
    pool, file = pools
    variable = make(family_id).problem.variables[0]
    with pytest.raises(ValueError, match="belongs to another problem"):
        make(
            family_id, pool=str(file), bounds={variable.name: (variable.low, variable.high - 0.01)}
        )
    unsolvable = dataclasses.replace(pool, solvable=np.zeros(len(pool), dtype=bool))
    unsolvable.save(tmp_path / "none.npz")
    with pytest.raises(ValueError, match=r"none.npz' has no solvable task"):
        make(family_id, pool=tmp_path / "none.npz")


def test_given_task_and_design_are_used(env_id, make, rng):
    env = make(env_id)
    problem = env.problem
    design = problem.low + 0.25 * (problem.high - problem.low)
    row = problem.draw_tasks(1, rng)[0]
    for task in (
        row,
        list(row),
        problem.unpack(row),
        dict(zip(problem.task_type.names(), row, strict=True)),
    ):
        for given in (design, list(design), problem.named(design)):
            start = start_of(env, options={"task": task, "design": given})
            np.testing.assert_array_equal(start, design)
            np.testing.assert_array_equal(env.session.tasks[0], row)


def test_what_is_given_does_not_change_what_is_drawn_later(family_id, make):
    plain, given = make(family_id, start="random"), make(family_id, start="random")
    plain.reset(seed=9)
    options = {"task": {}, "design": given.problem.low}
    given.reset(seed=9, options=options)
    one, other = plain.reset(), given.reset()
    np.testing.assert_array_equal(one[0], other[0])
    assert one[1] == other[1]


def test_bad_options_are_refused_in_one_sentence(fixed_id, make):
    env = make(fixed_id)
    problem = env.problem
    first = problem.variables[0]
    field = problem.task_variables[0]
    outside = problem.printed_design()
    outside[0] = first.high + 0.1
    unknown = {field.name + "x": 1.0}
    for options, sentence in (
        ({"desing": None}, "unknown reset option 'desing'; did you mean 'design'"),
        ({"task": {field.name: field.legal_high + 1.0}}, f"task.{field.name} is"),
        ({"task": unknown}, "unknown task field"),
        ({"task": [1.0, 2.0]}, "option task must be numbers of shape"),
        ({"task": "paper"}, "option task must be numbers of shape"),
        ({"design": outside}, f"option design: {first.name} is .* it must be from"),
        ({"design": outside[:-1]}, "option design must be numbers of shape"),
        ({"design": np.full(len(outside), np.nan)}, "option design must be finite"),
        ({"design": {first.name: first.low}}, "the design lacks"),
    ):
        env.reset(seed=0)
        before = env.session.best.designs.copy()
        with pytest.raises(ValueError, match=sentence) as refusal:
            env.reset(options=options)
        assert "\n" not in str(refusal.value)
        np.testing.assert_array_equal(env.session.best.designs, before)
