"""Environments of a mechanism from outside, in this process and in children."""

from __future__ import annotations

from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import pkm_gym
from pkm_gym import mechanisms
from pkm_gym.core.problem import DesignProblem
from pkm_gym.envs.vector import DesignVectorEnv

WHERE = "biglide.problem:BiglideProblem"
FAMILY = "PKM/BiglideFamily-v0"
METHODS = ("spawn", "forkserver")


@pytest.fixture(autouse=True)
def problem_type() -> type[DesignProblem]:
    """Register the mechanism, as a user of its package does."""
    kind = mechanisms.problem_type(WHERE)
    pkm_gym.register(kind)
    return kind


def test_ids_keep_the_address_and_pass_the_checker():
    for env_id in ("PKM/Biglide-v0", FAMILY):
        spec = gym.spec(env_id)
        assert spec.kwargs["problem"] == WHERE
        env = gym.make(env_id)
        check_env(env.unwrapped, skip_render_check=True)
        assert gym.make(gym.spec(env_id).from_json(env.spec.to_json())).reset(seed=0)
    assert "PKM/BiglideMotion-v0" not in gym.registry


def test_its_name_and_its_address_are_one_problem():
    by_name, by_address = pkm_gym.make_problem("biglide"), pkm_gym.make_problem(WHERE)
    assert by_name.hash() == by_address.hash()
    assert "biglide" in pkm_gym.problems()


def test_another_problem_of_its_name_is_refused():
    from biglide.problem import BiglideProblem

    with pytest.raises(TypeError, match="define it at the top of a module"):
        pkm_gym.register(
            type("BiglideProblem", (BiglideProblem,), {"__module__": "biglide.problem"})
        )


def test_the_native_vector_environment_plays_it():
    envs = DesignVectorEnv(WHERE, 3, family=True)
    assert isinstance(gym.make_vec(FAMILY, 2).unwrapped, DesignVectorEnv)
    envs.reset(seed=0)
    observations, rewards, *_ = envs.step(np.zeros((3, 2)))
    assert np.isfinite(observations).all()
    assert np.isfinite(rewards).all()


@pytest.mark.parametrize("method", METHODS)
def test_children_of_gymnasium_know_it(method):
    envs = gym.make_vec(FAMILY, 2, vectorization_mode="async", vector_kwargs={"context": method})
    try:
        assert envs.reset(seed=0)[0].shape[0] == 2
        assert envs.step(envs.action_space.sample())[1].shape == (2,)
    finally:
        envs.close()


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
def test_children_of_stable_baselines_know_it(method):
    from stable_baselines3.common.vec_env import SubprocVecEnv

    envs = SubprocVecEnv([partial(gym.make, gym.spec(FAMILY))] * 2, start_method=method)
    try:
        assert envs.reset().shape[0] == 2
        assert envs.step(np.zeros((2, 2)))[1].shape == (2,)
    finally:
        envs.close()
