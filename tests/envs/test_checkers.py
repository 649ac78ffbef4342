"""Gymnasium's and Stable-Baselines3's own checks, where a warning is an error."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as sb3_check_env

from pkm_gym.envs.design import DesignEnv

STARTS = 50


class Shifted(DesignEnv):
    """The same environment with other seeds, so that fixed seeds of a checker give other starts."""

    shift = 0

    def reset(self, *, seed=None, options=None):
        return super().reset(seed=None if seed is None else seed + self.shift, options=options)


@pytest.fixture
def shifted(env_id):
    env = Shifted(**gym.spec(env_id).kwargs, start="random")
    env.spec = gym.spec(env_id)
    return env


def test_gymnasium_accepts_random_starts(shifted):
    starts = set()
    for shift in range(STARTS):
        shifted.shift = 1000 * shift
        check_env(shifted, skip_render_check=True)
        starts.add(tuple(shifted.reset(seed=123)[1]["best_design"].values()))
    assert len(starts) == STARTS


def test_stable_baselines3_accepts_random_starts(shifted):
    for shift in range(STARTS):
        shifted.shift = 1000 * shift
        sb3_check_env(shifted)


@pytest.mark.usefixtures("window")
@pytest.mark.parametrize("mode", [None, "rgb_array", pytest.param("human", marks=pytest.mark.slow)])
def test_both_accept_every_way_of_rendering(fixed_id, make, mode):
    env = make(fixed_id, render_mode=mode)
    check_env(env)
    sb3_check_env(env, skip_render_check=False)


@pytest.mark.parametrize("reward", ["final", "regret"])
@pytest.mark.parametrize("action_mode", ["relative", "absolute"])
def test_both_accept_other_rules(fixed_id, make, paper_pool, reward, action_mode):
    env = make(fixed_id, reward=reward, action_mode=action_mode, budget=3, pool=str(paper_pool[1]))
    check_env(env, skip_render_check=True)
    sb3_check_env(env)


def test_vector_spaces_hold_what_the_vector_environment_returns(env_id):
    envs = gym.make_vec(env_id, num_envs=5)
    observations, _ = envs.reset(seed=0)
    assert observations in envs.observation_space
    for _ in range(30):
        observations, rewards, *_ = envs.step(envs.action_space.sample())
        assert observations in envs.observation_space
        assert np.isfinite(rewards).all()
