"""MotionVecEnv: n motion environments as Stable-Baselines3 wants them, state and all."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import DummyVecEnv

from pkm_gym.envs.motion import MotionEnv


class MotionVecEnv(DummyVecEnv):
    """Motion environments one after the other, whose state can be saved and restored.

    Each keeps its design.
    """

    def __init__(self, envs: Sequence[MotionEnv]) -> None:
        self.machines = list(envs)
        makers: list[Any] = [lambda env=env: env for env in envs]
        super().__init__(makers)

    def state(self) -> dict[str, Any]:
        """Return copies of what the next steps depend on: arrays, and the generators as text."""
        generators = [env.np_random.bit_generator.state for env in self.machines]
        return {
            "machines": np.stack([env.save() for env in self.machines]),
            "generators": json.dumps(generators),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from what ``state`` returned."""
        kept = json.loads(state["generators"])
        for env, saved, generator in zip(self.machines, state["machines"], kept, strict=True):
            env.load(saved)
            env.np_random.bit_generator.state = generator
