"""The recorded optimum of each problem, about which everything is asked."""

from __future__ import annotations

import pytest

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray


@pytest.fixture(scope="session")
def optimum(problem: DesignProblem) -> FloatArray:
    """The recorded optimum (d,) of the problem as it comes, the printed design without one."""
    return optimum_of(problem)


def optimum_of(problem: DesignProblem) -> FloatArray:
    first = problem.objectives[0].name
    for item in problem.reference.optima.values():
        if item.objective == first and not item.fixed:
            return problem.design(item.design)
    return problem.printed_design()
