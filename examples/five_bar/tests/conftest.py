"""The example is found where it stands, without being installed."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parents[1]))

import pkm_gym
import pkm_gym.twin  # before any test imports mujoco: it chooses how to draw without a screen
from pkm_gym.core.problem import DesignProblem

FIVE_BAR = "five_bar.problem:FiveBarProblem"


@pytest.fixture(scope="session")
def problem() -> DesignProblem:
    """The five-bar's problem with its default task."""
    return pkm_gym.make_problem(FIVE_BAR)


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator of fixed seed, new for each test."""
    return np.random.default_rng(5)
