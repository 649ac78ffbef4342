"""Designs of every kind that a picture must cope with."""

from __future__ import annotations

import numpy as np
import pytest

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

KINDS = ("feasible", "infeasible", "unreachable", "no machine")


@pytest.fixture
def designs(problem: DesignProblem) -> dict[str, FloatArray]:
    """One design of each kind, found by evaluating the drawn points of the box and around it."""
    generator = np.random.default_rng(5)
    drawn = problem.low + (problem.high - problem.low) * generator.random((400, len(problem.low)))
    evaluation = problem.evaluate(drawn)
    defined = np.isfinite(evaluation.objectives[:, 0])
    wide = problem.high * (0.05 + 1.5 * generator.random((400, len(problem.low))))
    nowhere = np.isnan(problem.evaluate(wide).objectives[:, 0])
    unreachable = np.concatenate([drawn[~defined], wide[nowhere]])
    return {
        "feasible": problem.printed_design(),
        "infeasible": drawn[np.flatnonzero(defined & ~evaluation.feasible)[0]],
        "unreachable": unreachable[0],
        "no machine": np.full(len(problem.low), np.nan),
    }


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    """Each kind of design."""
    return request.param
