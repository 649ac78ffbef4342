"""Wrappers: tasks in a given order, a vector of objectives, a grid of designs by number."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3 import DQN
from stable_baselines3.common.env_checker import check_env as sb3_check_env

import pkm_gym
from pkm_gym.core.trial import trial_values
from pkm_gym.envs.wrappers import DesignGrid, FixedTasks, MultiObjective
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
    with pytest.raises(ValueError, match="the pool belongs to another problem"):
        FixedTasks(env, other)


def test_the_reward_is_the_vector_of_objectives(problem, fixed_id, design, rng):
    names = [objective.name for objective in problem.all_objectives]
    env = MultiObjective(made(fixed_id, objective=names))
    plain = made(fixed_id, objective=names)
    problem = env.unwrapped.problem
    signs = np.where([o.direction == "maximise" for o in problem.objectives], 1.0, -1.0)
    feasible = 0
    for episode in range(4):
        options = {"design": design} if episode % 2 else None
        env.reset(seed=episode, options=options)
        plain.reset(seed=episode, options=options)
        terminated = False
        while not terminated:
            action = rng.uniform(-1.0, 1.0, env.action_space.shape) * (episode > 1)
            _, reward, terminated, _, info = env.step(action)
            _, scalar, _, _, _ = plain.step(action)
            tried = problem.design({n: info["design"][n] for n in problem.variable_names})
            expected = trial_values(problem.evaluate(tried[None]))[0]
            np.testing.assert_allclose(reward, signs * expected, rtol=1e-6)
            assert env.reward_space.contains(reward)
            assert info["scalar_reward"] == scalar
            if info["feasible"]:
                feasible += 1
                indices = [info["indices"][name] for name in names]
                np.testing.assert_allclose(reward, signs * indices, rtol=1e-6)
    assert feasible


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


@pytest.mark.parametrize("wrapper", [MultiObjective, DesignGrid, lambda env: FixedTasks(env, [])])
def test_only_a_design_environment_is_wrapped(wrapper):
    with pytest.raises(TypeError, match=r"wraps a design environment, .* got CartPoleEnv"):
        wrapper(gym.make("CartPole-v1"))
    with pytest.raises(TypeError, match=r"wraps a design environment, .* got DesignVectorEnv"):
        wrapper(gym.make_vec("PKM/Diamond-v0", num_envs=2))
