"""Environment steps a second: the native vector environment against SyncVectorEnv."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pkm_gym  # noqa: F401  # registers the environments

STEPS = 12  # one session
MODES = {"SyncVectorEnv": "sync", "native": "vector_entry_point"}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("count", [64, 256])
@pytest.mark.parametrize("env_id", ["PKM/Diamond-v0", "PKM/DiamondFamily-v0"])
def test_steps(benchmark: Any, env_id: str, count: int, mode: str) -> None:
    envs = gym.make_vec(env_id, num_envs=count, vectorization_mode=MODES[mode])
    envs.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = rng.uniform(-1.0, 1.0, (STEPS, *envs.action_space.shape)).astype(np.float32)

    def session() -> None:
        for action in actions:
            envs.step(action)

    name = f"{env_id}, {count} envs"
    info: dict[str, Any] = {"row": f"{name}, {mode}", "unit": "steps", "count": STEPS * count}
    if mode == "native":
        info["versus"] = {f"{name}, SyncVectorEnv": "SyncVectorEnv"}
        info["target"] = ">= 20x" if count == 256 else ""
    benchmark.extra_info.update(info)
    benchmark.pedantic(session, rounds=3 if mode == "SyncVectorEnv" else 30, warmup_rounds=1)
    envs.close()
