"""Which dimensions make a machine, and the sentence that refuses the others."""

from __future__ import annotations

import math

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.dimensions import LARGEST, SMALLEST, dimensions_violation
from pkm_gym.core.merit import TOLERANCE


@pytest.mark.parametrize("shortfall", [1.0, SMALLEST])
def test_what_makes_no_machine_is_beyond_any_tolerance(shortfall: float) -> None:
    assert dimensions_violation((0.5, 2.0), shortfall) < 0.0
    assert dimensions_violation((SMALLEST, LARGEST), shortfall) <= 0.0
    just_no_machine = (SMALLEST * (1.0 - 1e-12), LARGEST * (1.0 + 1e-12))
    for bad in (*just_no_machine, 0.0, -1.0, 1e30, math.inf, -math.inf, math.nan):
        for values in ((bad, 2.0), (2.0, bad)):
            assert TOLERANCE < dimensions_violation(values, shortfall) <= 1.0


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_the_machine_and_the_explanation_say_the_same(name: str) -> None:
    problem = pkm_gym.make_problem(name)
    design = -problem.printed_design()
    with pytest.raises(ValueError, match="make no machine: each must lie between") as refused:
        problem.mechanism(design)
    evaluation = problem.evaluate(np.array([design]))
    assert evaluation.explain(0) == f"dimensions: {refused.value}"
