"""What every test may ask for: each registered problem, and the optima of its Family."""

from __future__ import annotations

import hypothesis
import numpy as np
import pytest

import pkm_gym
import pkm_gym.twin  # before any test imports mujoco: it chooses how to draw without a screen
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, solve_tasks

FEW, MANY = 64, 256  # tasks of a Family

# Kernels compile at their first call, so no deadline; derandomised, so that a failure repeats.
hypothesis.settings.register_profile("pkm_gym", deadline=None, derandomize=True, max_examples=60)
hypothesis.settings.load_profile("pkm_gym")


@pytest.fixture(scope="session", params=pkm_gym.problems())
def problem(request: pytest.FixtureRequest) -> DesignProblem:
    """Each registered problem as it comes, with the paper's task."""
    return pkm_gym.make_problem(request.param)


@pytest.fixture(scope="session", params=[FEW, pytest.param(MANY, marks=pytest.mark.slow)])
def family(problem: DesignProblem, request: pytest.FixtureRequest) -> Solutions:
    """Solved tasks of the problem's Family: a few, and many among the slow tests."""
    return solve_tasks(problem, problem.draw_tasks(request.param, np.random.default_rng(2010)))


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator of fixed seed, new for each test."""
    return np.random.default_rng(43)
