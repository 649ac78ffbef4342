"""Wrappers: tasks in a given order, a grid of designs by number."""

from __future__ import annotations

import copy
import dataclasses
import pickle
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3 import DQN
from stable_baselines3.common.env_checker import check_env as sb3_check_env

import pkm_gym
from pkm_gym.envs.wrappers import DesignGrid, FixedTasks
from pkm_gym.mechanisms import declaration

GRIDS = [name for name in pkm_gym.problems() if pkm_gym.make_problem(name).grid() is not None]


def made(env_id: str, **arguments) -> gym.Env:
    return gym.make(env_id, disable_env_checker=True, **arguments)


def check_wrapped(env: gym.Env) -> None:
    """Run Gymnasium's check, which would rather not see a wrapper; any other warning fails."""
    with pytest.warns(UserWarning, match="is different from the unwrapped version"):
        check_env(env, skip_render_check=True)


@pytest.fixture
def tasks(family_id, make, rng):
    return make(family_id).problem.draw_tasks(3, rng)


@pytest.fixture(params=GRIDS)
def grid(request) -> DesignGrid:
    env_id = f"PKM/{declaration(request.param).environment}-v0"
    return DesignGrid(made(env_id, action_mode="absolute"))


def test_tasks_come_in_order_whatever_the_seed_and_begin_again(family_id, tasks):
    env = FixedTasks(made(family_id), tasks)
    assert env.row == -1
    for episode, seed in enumerate((5, 5, None, 0, 7, 7, 1)):
        env.reset(seed=seed)
        assert env.row == episode % 3
        np.testing.assert_array_equal(env.unwrapped.session.tasks[0], tasks[env.row])


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_of_wrapped_environments_go_on(family_id, tasks, copied):
    env = FixedTasks(made(family_id), tasks)
    env.reset(seed=1)
    other, action = copied(env), 0.3 * np.ones(env.action_space.shape)
    for one, two in ((env.step(action), other.step(action)), (env.reset(), other.reset())):
        np.testing.assert_array_equal(one[0], two[0])
        assert one[1:] == two[1:]
    assert other.row == env.row == 1


def test_a_start_may_still_be_given(family_id, tasks):
    env = FixedTasks(made(family_id), tasks)
    design = env.unwrapped.problem.low
    env.reset(options={"design": design})
    np.testing.assert_array_equal(env.unwrapped.session.best.designs[0], design)
    np.testing.assert_array_equal(env.unwrapped.session.tasks[0], tasks[0])


def test_a_reset_that_is_refused_skips_no_task(family_id, tasks):
    env = FixedTasks(made(family_id), tasks)
    with pytest.raises(ValueError, match="FixedTasks chooses the tasks itself"):
        env.reset(options={"task": tasks[0]})
    with pytest.raises(ValueError, match="unknown reset option 'desing'; did you mean 'design'"):
        env.reset(options={"desing": tasks[0]})
    env.reset()
    assert env.row == 0


def test_a_pool_gives_its_tasks(fixed_id, paper_pool):
    pool, _ = paper_pool
    env = FixedTasks(made(fixed_id), pool)
    np.testing.assert_array_equal(env.tasks, pool.tasks)


@pytest.mark.parametrize("arguments", [{}, {"reward": "regret"}, {"start": "pool"}])
def test_of_a_pool_the_tasks_that_are_solvable_are_gone_through(family_id, pools, arguments):
    pool, file = pools
    env = FixedTasks(made(family_id, pool=str(file), **arguments), pool)
    np.testing.assert_array_equal(env.tasks, pool.tasks[pool.solvable])
    assert 0 < len(env.tasks) < len(pool)
    for episode in range(len(pool) + 1):
        env.reset(seed=episode)
        task = env.unwrapped.session.tasks[0]
        np.testing.assert_array_equal(task, env.tasks[episode % len(env.tasks)])


def test_tasks_that_an_episode_would_stop_at_are_refused_at_once(family_id, pools, tasks):
    pool, file = pools
    env = made(family_id, pool=str(file), reward="regret")
    for those in (tasks, pool.tasks):
        with pytest.raises(ValueError, match=r"has no stored optimum: it isn't in .*npz"):
            FixedTasks(env, those)
    none = dataclasses.replace(pool, solvable=np.zeros(len(pool), dtype=bool))
    with pytest.raises(ValueError, match="the pool has no solvable task"):
        FixedTasks(env, none)


def test_both_checkers_accept_a_fixed_task(family_id, tasks):
    check_wrapped(FixedTasks(made(family_id), tasks[:1]))
    sb3_check_env(FixedTasks(made(family_id), tasks))


def test_the_wrapped_environment_is_made_again_from_its_spec(family_id, tasks):
    env = FixedTasks(made(family_id), tasks)
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    np.testing.assert_array_equal(again.get_wrapper_attr("tasks"), tasks)


def test_bad_tasks_are_refused(family_id, tasks, pools):
    width, fields = tasks.shape[1], made(family_id).unwrapped.problem.task_variables
    env = made(family_id)
    with pytest.raises(ValueError, match=rf"tasks must be numbers of shape \(3, {width}\)"):
        FixedTasks(env, tasks[:, 1:])
    with pytest.raises(ValueError, match="tasks must be numbers of shape"):
        FixedTasks(env, tasks[:0])
    with pytest.raises(ValueError, match="task row 1: "):
        FixedTasks(env, np.vstack([tasks[0], [v.legal_high + 1.0 for v in fields]]))
    with pytest.raises(ValueError, match="tasks must be finite"):
        FixedTasks(env, tasks * np.nan)
    other = dataclasses.replace(pools[0], hash="0" * 64)
    with pytest.raises(ValueError, match=r"the pool .* belongs to another problem"):
        FixedTasks(env, other)


def test_each_action_evaluates_its_design_of_the_grid(grid, rng):
    problem = grid.unwrapped.problem
    np.testing.assert_array_equal(grid.designs, problem.grid())
    folder = problem.declared.package.rpartition(".")[2]
    page = Path(__file__).parents[2] / "docs" / "environments" / f"{folder}.md"
    assert f"`Discrete({grid.action_space.n})`" in page.read_text()
    for number in (0, grid.action_space.n - 1, *rng.integers(grid.action_space.n, size=20)):
        grid.reset(seed=0)
        grid.step(rng.integers(grid.action_space.n))
        grid.step(np.int64(number))
        np.testing.assert_allclose(
            grid.unwrapped.session.last[0], grid.designs[number], rtol=0.0, atol=1e-12
        )


def test_both_checkers_accept_the_grid(grid):
    check_wrapped(grid)
    sb3_check_env(grid)


def test_dqn_learns_on_the_grid(grid):
    arguments = {"learning_starts": 50, "buffer_size": 200, "device": "cpu", "seed": 0}
    model = DQN("MlpPolicy", grid, policy_kwargs={"net_arch": [16]}, **arguments)
    model.learn(200)
    action, _ = model.predict(grid.reset(seed=0)[0], deterministic=True)
    assert grid.action_space.contains(action)


@pytest.mark.parametrize("action", [-1, 10**6, 0.5, None])
def test_the_grid_refuses_what_is_no_number_of_a_design(grid, action):
    grid.reset(seed=0)
    with pytest.raises(ValueError, match="it must be a whole number from 0 to"):
        grid.step(action)
    assert grid.unwrapped.session.evaluations[0] == 0


def test_a_grid_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match="spr3 has no grid of designs"):
        DesignGrid(made("PKM/SPR3-v0", action_mode="absolute"))
    with pytest.raises(ValueError, match="action_mode is 'relative': DesignGrid needs"):
        DesignGrid(made("PKM/Diamond-v0"))
    between = {"lam_e": (0.30001, 0.30002)}
    nowhere = made("PKM/Diamond-v0", action_mode="absolute", bounds=between)
    with pytest.raises(ValueError, match="no design of the grid lies within the bounds"):
        DesignGrid(nowhere)


@pytest.mark.parametrize("wrapper", [DesignGrid, lambda env: FixedTasks(env, [])])
def test_only_a_design_environment_is_wrapped(wrapper):
    with pytest.raises(TypeError, match=r"wraps a design environment, .* got CartPoleEnv"):
        wrapper(gym.make("CartPole-v1"))
    with pytest.raises(TypeError, match=r"wraps a design environment, .* got DesignVectorEnv"):
        wrapper(gym.make_vec("PKM/Diamond-v0", num_envs=2))
