"""What an agent does in its environment becomes a log of the benchmark."""

from __future__ import annotations

import re

import gymnasium as gym
import numpy as np
import pytest

from pkm_gym.benchmark import Cost, EvaluationLog, RecordEvaluations, regrets
from pkm_gym.benchmark.standings import standings
from pkm_gym.envs.wrappers import FixedTasks

FREE = {"start": "free", "knowledge": "scratch"}


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
    log = env.log("val", method="at random", **FREE, seed=2)
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
    assert env.log("val", method="short", **FREE).counts.tolist() == [1, 0]


def test_of_several_episodes_on_a_task_the_first_counts(shipped, rng):
    problem, split = shipped
    solvable = split.only(np.flatnonzero(split.solvable))
    env = RecordEvaluations(FixedTasks(family(problem), solvable.first(2)))
    told = play(env, 4, rng)
    np.testing.assert_array_equal(env.log("val", method="again", **FREE).designs, told[:2])


def test_tasks_of_no_split_are_refused(shipped):
    problem, _ = shipped
    env = RecordEvaluations(family(problem))
    env.reset(seed=0)
    with pytest.raises(ValueError, match="is not in val: use FixedTasks"):
        env.log("val", method="elsewhere", **FREE)


def test_another_problem_than_the_benchmarks_is_refused(shipped):
    problem, split = shipped
    name = problem.variable_names[0]
    bounds = {name: (float(problem.low[0]), float(problem.high[0]) - 0.01)}
    env = RecordEvaluations(family(problem, bounds=bounds))
    env.reset(options={"task": split.tasks[0]})
    with pytest.raises(ValueError, match=f"{problem.name} differs from the benchmark's"):
        env.log("val", method="other", **FREE)


def test_other_environments_are_refused():
    with pytest.raises(TypeError, match="RecordEvaluations wraps a design environment"):
        RecordEvaluations(gym.make("CartPole-v1"))


def begun(problem, split, starts, **arguments):
    """A record of one step of an episode on each of the first tasks, begun at given starts."""
    env = RecordEvaluations(FixedTasks(family(problem, **arguments), split))
    for start in starts:
        env.reset(options=None if start is None else {"design": start})
        env.step(np.zeros(env.action_space.shape))
    return env


def test_episodes_begin_where_their_track_says(shipped):
    problem, split = shipped[0], shipped[1].only(np.flatnonzero(shipped[1].solvable))
    handed = begun(problem, split, split.starts[:2])
    assert handed.log("val", method="m", start="given", knowledge="scratch").counts.sum() == 2
    handed.log("val", method="m", start="free", knowledge="transfer", pool=10)
    with pytest.raises(ValueError, match="task 0 began at a design that was handed over"):
        handed.log("val", method="m", **FREE)
    with pytest.raises(ValueError, match="task 0 did not begin at the split's start"):
        begun(problem, split, [None]).log("val", method="m", start="given", knowledge="scratch")
    drawn = begun(problem, split, [None, None], start="random")
    assert len(drawn.log("val", method="m", **FREE)) == 2


@pytest.mark.parametrize("knowledge", [{}, {"knowledge": "transfer", "pool": 10}])
def test_an_optimum_is_no_free_start(shipped, knowledge):
    problem, split = shipped
    env = begun(problem, split, [split.designs[0]], start="random")
    with pytest.raises(ValueError, match="task 0 began at the split's optimum"):
        env.log("val", method="m", **{**FREE, **knowledge})


@pytest.mark.parametrize(
    ("said", "sentence"),
    [
        ({"knowledge": "transfer"}, "knowledge is 'transfer' with a pool of 0 and a training of 0"),
        ({"pool": 3}, "knowledge is 'scratch' with a pool of 3"),
        ({"training": Cost(9)}, "knowledge is 'scratch' with a pool of 0 and a training of 9"),
        ({"start": "gven"}, "unknown start 'gven'; did you mean 'given'?"),
        ({"knowledge": "all"}, "unknown knowledge 'all'"),
    ],
)
def test_a_track_that_contradicts_the_costs_is_refused(shipped, said, sentence):
    problem, split = shipped
    env = begun(problem, split, [None])
    with pytest.raises(ValueError, match=re.escape(sentence)):
        env.log("val", method="m", **{**FREE, **said})
    with pytest.raises(TypeError, match="start"):
        env.log("val", method="m")


def test_what_is_evaluated_beside_the_environment_is_seen(shipped, rng):
    problem, split = shipped
    env = RecordEvaluations(FixedTasks(family(problem), split))
    problem.evaluate(split.designs[:1])  # before it began: that is a training
    env.reset()
    problem.evaluate(split.designs[:3])
    env.step(rng.uniform(-1, 1, env.action_space.shape))
    env.reset()
    env.step(rng.uniform(-1, 1, env.action_space.shape))
    assert env.log("val", method="m", **FREE).outside.tolist() == [3, 0]
