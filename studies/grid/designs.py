"""The designs of the paper's grid, or of ours."""

from __future__ import annotations

import math

import numpy as np

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

STEP = 0.01  # of our grid, in the variables' own units, where the paper has none
LARGEST = 1_000_000  # designs in a grid


def grid_name(problem: DesignProblem, step: float | None = None) -> str:
    """Return whose grid ``grid_designs`` returns: "the paper's grid" or "our grid"."""
    return "the paper's grid" if step is None and problem.grid() is not None else "our grid"


def grid_designs(problem: DesignProblem, step: float | None = None) -> FloatArray:
    """Return the paper's grid (n, d) within the bounds, or with a step, or without one, ours.

    Raises:
        ValueError: in one sentence, for a step that makes no grid or too large a one, or if none of
            the paper's grid is within the bounds.
    """
    designs = problem.grid() if step is None else None
    if designs is None:
        return _even_grid(problem, STEP if step is None else step)
    if len(designs) == 0:
        raise ValueError(
            f"no design of the paper's grid lies in this search space: {_space(problem)}"
        )
    return designs


def _even_grid(problem: DesignProblem, step: float) -> FloatArray:
    """Return the designs (n, d) a step apart in every variable, from its lower bound."""
    if not (0.0 < step < math.inf):
        raise ValueError(f"the grid's step is {step:g}: it must be finite and > 0")
    counts = np.floor((problem.high - problem.low) / step + 1e-9) + 1.0
    if np.prod(counts) > LARGEST:
        raise ValueError(
            f"a step of {step:g} makes {np.prod(counts):,.0f} designs: choose a larger one, for at "
            f"most {LARGEST:,}"
        )
    axes = [
        np.minimum(low + step * np.arange(int(count)), high).round(12)
        for low, high, count in zip(problem.low, problem.high, counts, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def _space(problem: DesignProblem) -> str:
    ranges = [f"{v.name} {v.low:g} to {v.high:g}" for v in problem.variables]
    return ", ".join([*ranges, *(f"{name} = {x:g}" for name, x in problem.fixed.items())])
