"""The machines whose twins are tried."""

from __future__ import annotations

import pytest

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem


@pytest.fixture
def machine(twinned: DesignProblem) -> Mechanism:
    """The machine of the printed design, of each problem that drives a twin."""
    return twinned.mechanism(twinned.printed_design())
