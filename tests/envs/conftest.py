"""Environments to test: every registered design environment, and a small pool of solved tasks."""

from __future__ import annotations

import dataclasses
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from matplotlib.backend_bases import FigureManagerBase
from matplotlib.backends.backend_agg import FigureCanvasAgg

from pkm_gym.core.pool import ARRAYS, Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, solve_tasks
from pkm_gym.envs import rendering
from pkm_gym.envs.design import DesignEnv


@pytest.fixture(params=["", "Family"])
def env_id(problem: DesignProblem, request: pytest.FixtureRequest) -> str:
    """Each registered id of a design environment."""
    return f"PKM/{problem.declared.environment}{request.param}-v0"


@pytest.fixture
def fixed_id(problem: DesignProblem) -> str:
    """Each id of a paper's task."""
    return f"PKM/{problem.declared.environment}-v0"


@pytest.fixture
def family_id(problem: DesignProblem) -> str:
    """Each id of a Family."""
    return f"PKM/{problem.declared.environment}Family-v0"


@pytest.fixture(scope="session")
def other_task() -> Callable[[DesignProblem], dict[str, float]]:
    """A function that returns a legal task other than the paper's."""

    def other(problem: DesignProblem) -> dict[str, float]:
        for field in problem.task_variables:
            for value in (field.legal_low, field.legal_high):
                if value != field.default:
                    return {field.name: value}
        raise AssertionError(f"{problem.name} has one task only")

    return other


@pytest.fixture
def window(monkeypatch):
    """A toolkit that opens windows without a display: the managers of those that are open."""
    opened = []

    class Manager(FigureManagerBase):
        def show(self):
            opened.append(self)

        def destroy(self):
            opened.remove(self)

    class Canvas(FigureCanvasAgg):
        manager_class = Manager

    toolkit = ModuleType("toolkit_of_the_tests")
    toolkit.FigureCanvas = Canvas
    monkeypatch.setitem(sys.modules, toolkit.__name__, toolkit)
    monkeypatch.setattr(rendering, "TOOLKITS", ("no_toolkit", f"module://{toolkit.__name__}"))
    monkeypatch.setenv("DISPLAY", ":0")
    return opened


@pytest.fixture(scope="session")
def make():
    """A function that makes the bare environment of an id."""

    def made(env_id: str, **arguments: Any) -> DesignEnv:
        return gym.make(env_id, **arguments).unwrapped

    return made


@pytest.fixture(scope="session")
def play():
    """A function that plays whole episodes: the (observation, reward, flags, info) of each step.

    A design that is given in the options is the first that is evaluated.
    """

    def played(env: gym.Env, seed: int, episodes: int = 1, options: Any = None) -> list[tuple]:
        actions = np.random.default_rng(seed)
        steps = []
        for episode in range(episodes):
            env.reset(seed=seed if episode == 0 else None, options=options)
            ended = False
            while not ended:
                action = actions.uniform(-1.0, 1.0, env.action_space.shape)
                steps.append(env.step(0.0 * action if options and not steps else action))
                ended = steps[-1][2]
        return steps

    return played


@pytest.fixture(scope="session")
def pools(
    family_problem: DesignProblem, solved: Solutions, tmp_path_factory: Any
) -> tuple[Pool, Path]:
    """A pool of the Family, with its file: the paper's task and six more, solved, and one not."""
    problem, rows = family_problem, np.flatnonzero(solved.solvable)[:7]
    paper = solve_tasks(problem, problem.pack(None)[None])
    first, more = (Pool.from_solutions(s, s.designs, problem, "a test") for s in (paper, solved))
    joined = {
        name: np.concatenate([getattr(first, name), getattr(more, name)[rows]]) for name in ARRAYS
    }
    pool = dataclasses.replace(more, **joined)
    rng = np.random.default_rng(5)
    pool.starts[:] = problem.low + (problem.high - problem.low) * rng.random(pool.starts.shape)
    pool.solvable[3] = False
    file = tmp_path_factory.mktemp("pools") / f"{problem.name}.npz"
    pool.save(file)
    return pool, file


@pytest.fixture(scope="session")
def paper_pool(
    problem: DesignProblem, paper: Solutions, tmp_path_factory: Any
) -> tuple[Pool, Path]:
    """A pool of the problem as it comes, with its file: the paper's task alone, solved."""
    pool = Pool.from_solutions(
        paper, 0.7 * problem.low + 0.3 * problem.high[None], problem, "a test"
    )
    file = tmp_path_factory.mktemp("paper_pools") / f"{problem.name}.npz"
    pool.save(file)
    return pool, file
