"""Designs of every kind that a picture must cope with."""

from __future__ import annotations

import numpy as np
import pytest

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

KINDS = ("feasible", "infeasible", "unreachable", "no machine")


@pytest.fixture
def designs(problem: DesignProblem) -> dict[str, FloatArray]:
    """One design of each kind, found by evaluating the corners and drawn points of the box."""
    generator = np.random.default_rng(5)
    drawn = problem.low + (problem.high - problem.low) * generator.random((400, len(problem.low)))
    evaluation = problem.evaluate(drawn)
    defined = np.isfinite(evaluation.objectives[:, 0])
    return {
        "feasible": problem.printed_design(),
        "infeasible": drawn[np.flatnonzero(defined & ~evaluation.feasible)[0]],
        "unreachable": drawn[np.flatnonzero(~defined)[0]],
        "no machine": np.full(len(problem.low), np.nan),
    }


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    """Each kind of design."""
    return request.param
