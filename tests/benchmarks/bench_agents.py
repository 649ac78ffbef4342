"""How fast an agent trains on the Diamond's Family: its sessions alone, and PPO as a whole."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.agents.runs.run import Run
from pkm_gym.agents.sb3.session_env import SessionVecEnv
from pkm_gym.agents.sb3.trainer import make_model
from pkm_gym.envs.vector import DesignVectorEnv

ENVS, STEPS = 512, 24


def sessions() -> DesignVectorEnv:
    return DesignVectorEnv("diamond", ENVS, family=True, infos=False)


def test_sessions(benchmark, rng):
    """12,288 steps of the environment."""
    env = SessionVecEnv(sessions())
    env.reset()
    actions = rng.uniform(-0.1, 0.1, (STEPS, ENVS, 3)).astype(np.float32)
    benchmark.extra_info.update(row="agent's sessions", unit="steps", count=ENVS * STEPS)
    benchmark(lambda: [env.step(action) for action in actions])


@pytest.mark.parametrize("threads", [1, 2])
def test_ppo(benchmark, tmp_path, threads):
    """12,288 steps of PPO: a rollout and its update, as the shipped designers are trained."""

    class Plain:
        def vec_env(self, n: int) -> SessionVecEnv:
            assert n == ENVS
            return SessionVecEnv(sessions())

    torch.set_num_threads(threads)
    recipe = read_recipe("ppo", "PKM/DiamondFamily-v0")
    run = Run("PKM/DiamondFamily-v0", "ppo", 0, recipe, None, None, tmp_path)
    model = make_model(run, Plain())
    model.learn(ENVS * STEPS)
    name, target = f"PPO, {threads} threads", ">= 14 thousand" if threads == 2 else ""
    benchmark.extra_info.update(row=name, unit="steps", count=ENVS * STEPS, target=target)
    benchmark.pedantic(model.learn, args=(ENVS * STEPS,), rounds=5)
