"""MotionEnv: steps a second, and how long a change of the design takes."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import gymnasium as gym
import pytest

from pkm_gym.envs.baselines import servo
from pkm_gym.envs.motion import MotionEnv
from pkm_gym.mechanisms import own_declarations
from pkm_gym.twin.check import random_designs

DESIGNS = 20
MOTIONS = [
    f"PKM/{said.environment}Motion-v0" for said in own_declarations() if said.motion is not None
]


@pytest.fixture(params=MOTIONS)
def env(request: pytest.FixtureRequest) -> MotionEnv:
    return gym.make(request.param).unwrapped


def name_of(env: MotionEnv) -> str:
    return f"PKM/{env.problem.declared.environment}Motion-v0"


def test_steps(benchmark: Any, env: MotionEnv) -> None:
    """Whole runs along the path, with actions that were taken down before."""
    env.reset(seed=0)
    actions, ended = [], False
    while not ended:
        actions.append(servo(env))
        *_, ended, _, _ = env.step(actions[-1])

    def again() -> None:
        env.reset()
        for action in actions:
            env.step(action)

    row = f"{name_of(env)}, {env.rules.frame_skip} simulation steps a step"
    benchmark.extra_info.update(row=row, unit="steps", count=len(actions))
    benchmark.pedantic(again, rounds=5, warmup_rounds=1)


def test_changing_the_design(benchmark: Any, env: MotionEnv) -> None:
    """A reset with another design each time: new path, new model, new scales."""
    designs = cycle(random_designs(env.problem, DESIGNS, seed=0))
    benchmark.extra_info.update(row=f"{name_of(env)}, design changed", target="<= 5 ms")
    benchmark.pedantic(
        lambda: env.reset(options={"design": next(designs)}), rounds=100, warmup_rounds=5
    )
