"""What an agent does in its environment becomes a log of the benchmark."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from pkm_gym.benchmark import EvaluationLog, RecordEvaluations, regrets
from pkm_gym.benchmark.standings import standings
from pkm_gym.envs.wrappers import FixedTasks


def family(problem, **arguments):
    """The environment of a problem's Family."""
    return gym.make(f"PKM/{problem.declared.environment}Family-v0", **arguments)


def play(env, episodes, rng):
    """Act at random; return the designs by episode as the info tells them."""
    told, searched = [], env.unwrapped.problem.variable_names
    for _ in range(episodes):
        env.reset()
        over, designs = False, []
        while not over:
            *_, over, _, info = env.step(rng.uniform(-1, 1, env.action_space.shape))
            designs.append([info["design"][name] for name in searched])
        told.append(designs)
    return np.array(told)


def test_every_evaluation_of_every_episode_is_in_the_log(shipped, rng, tmp_path):
    problem, split = shipped
    env = RecordEvaluations(FixedTasks(family(problem, budget=7), split))
    told = play(env, 5, rng)
    log = env.log("val", method="at random", seed=2)
    np.testing.assert_array_equal(log.rows, np.flatnonzero(split.solvable)[:5])
    np.testing.assert_array_equal(log.designs, told)
    log.save(tmp_path / "log.npz")
    entry = standings([EvaluationLog.load(tmp_path / "log.npz")])[0]
    assert (entry.name, entry.track, entry.seeds) == ("at random", "free start, scratch", 1)
    np.testing.assert_array_equal(entry.regret[0], regrets(log, problem, split))


def test_an_unfinished_episode_counts_as_far_as_it_went(shipped, rng):
    problem, split = shipped
    env = RecordEvaluations(FixedTasks(family(problem), split))
    env.reset()
    env.step(rng.uniform(-1, 1, env.action_space.shape))
    env.reset()
    assert env.log("val", method="short").counts.tolist() == [1, 0]


def test_of_several_episodes_on_a_task_the_first_counts(shipped, rng):
    problem, split = shipped
    env = RecordEvaluations(FixedTasks(family(problem), split.first(2)))
    told = play(env, 4, rng)
    np.testing.assert_array_equal(env.log("val", method="again").designs, told[:2])


def test_tasks_of_no_split_are_refused(shipped):
    problem, _ = shipped
    env = RecordEvaluations(family(problem))
    env.reset(seed=0)
    with pytest.raises(ValueError, match="is not in val: use FixedTasks"):
        env.log("val", method="elsewhere")


def test_another_problem_than_the_benchmarks_is_refused(shipped):
    problem, split = shipped
    name = problem.variable_names[0]
    bounds = {name: (float(problem.low[0]), float(problem.high[0]) - 0.01)}
    env = RecordEvaluations(family(problem, bounds=bounds))
    env.reset(options={"task": split.tasks[0]})
    with pytest.raises(ValueError, match=f"{problem.name} differs from the benchmark's"):
        env.log("val", method="other")


def test_other_environments_are_refused():
    with pytest.raises(TypeError, match="RecordEvaluations wraps a design environment"):
        RecordEvaluations(gym.make("CartPole-v1"))
