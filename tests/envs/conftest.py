"""Environments to test: every registered design environment, and a small pool of solved tasks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.pool import Pool
from pkm_gym.core.solve import solve_tasks
from pkm_gym.envs.design import DesignEnv
from pkm_gym.envs.registration import DESIGN

FIXED = [env_id for env_id, (_, family) in DESIGN.items() if not family]
FAMILY = [env_id for env_id, (_, family) in DESIGN.items() if family]


@pytest.fixture(params=FIXED + FAMILY)
def env_id(request: pytest.FixtureRequest) -> str:
    """Each registered id."""
    return request.param


@pytest.fixture(params=FIXED)
def fixed_id(request: pytest.FixtureRequest) -> str:
    """Each id of a paper's task."""
    return request.param


@pytest.fixture(params=FAMILY)
def family_id(request: pytest.FixtureRequest) -> str:
    """Each id of a Family."""
    return request.param


@pytest.fixture(scope="session")
def make():
    """A function that makes the bare environment of an id."""

    def made(env_id: str, **arguments: Any) -> DesignEnv:
        return gym.make(env_id, **arguments).unwrapped

    return made


@pytest.fixture(scope="session")
def play():
    """A function that plays whole episodes: the (observation, reward, flags, info) of each step."""

    def played(env: gym.Env, seed: int, episodes: int = 1) -> list[tuple]:
        actions = np.random.default_rng(seed)
        steps = []
        for episode in range(episodes):
            env.reset(seed=seed if episode == 0 else None)
            ended = False
            while not ended:
                steps.append(env.step(actions.uniform(-1.0, 1.0, env.action_space.shape)))
                ended = steps[-1][2]
        return steps

    return played


@pytest.fixture(scope="session")
def pools(tmp_path_factory: pytest.TempPathFactory):
    """A function that returns the pool of a problem and its file: seven solved tasks, one not."""
    known: dict[str, tuple[Pool, Path]] = {}

    def pool_of(name: str) -> tuple[Pool, Path]:
        if name not in known:
            problem = pkm_gym.make_problem(name)
            rng = np.random.default_rng(5)
            tasks = np.vstack([problem.pack(None), problem.draw_tasks(7, rng)])
            starts = problem.low + (problem.high - problem.low) * rng.random((8, len(problem.low)))
            pool = Pool.from_solutions(solve_tasks(problem, tasks), starts, problem, "a test")
            pool.solvable[3] = False
            known[name] = pool, tmp_path_factory.mktemp("pools") / f"{name}.npz"
            pool.save(known[name][1])
        return known[name]

    return pool_of
