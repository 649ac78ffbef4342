"""The machines whose twins are tried."""

from __future__ import annotations

import pytest

import pkm_gym
from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem


@pytest.fixture(scope="session", params=["diamond", "spr3"])
def twinned(request: pytest.FixtureRequest) -> DesignProblem:
    """Each problem whose mechanism has a twin of its own."""
    return pkm_gym.make_problem(request.param)


@pytest.fixture
def machine(twinned: DesignProblem) -> Mechanism:
    return twinned.mechanism(twinned.printed_design())
