"""Designs of every kind that a picture must cope with."""

from __future__ import annotations

import numpy as np
import pytest

from pkm_gym.core.merit import NO_MACHINE
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

KINDS = ("feasible", "infeasible", "unreachable", "no machine")


@pytest.fixture(scope="session")
def designs(problem: DesignProblem, design: FloatArray) -> dict[str, FloatArray]:
    """One design of each kind that there is, found by evaluating the box and what is around it."""
    generator = np.random.default_rng(5)
    span = problem.high - problem.low
    drawn = problem.low + span * generator.random((400, len(span)))
    drawn = np.concatenate([drawn, design + generator.random((400, 1)) * (drawn - design)])
    around = problem.low + span * generator.uniform(-1.0, 2.0, (400, len(span)))
    every = problem.evaluate(np.concatenate([drawn, around]))
    undefined = (every.unreached > 0.0) & (every.unreached < NO_MACHINE)
    broken = ~every.feasible & (every.unreached == 0.0)
    found = {"feasible": design, "no machine": np.full(len(span), np.nan)}
    for kind, rows in (("infeasible", broken), ("unreachable", undefined)):
        if rows.any():
            found[kind] = every.designs[np.flatnonzero(rows)[0]]
    return found


@pytest.fixture(params=KINDS)
def kind(designs: dict[str, FloatArray], request: pytest.FixtureRequest) -> str:
    """Each kind of design."""
    if request.param not in designs:
        pytest.skip(f"no design found is {request.param}")
    return request.param
