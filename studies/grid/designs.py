"""The designs of the paper's grid, or of ours."""

from __future__ import annotations

import math

import numpy as np

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

LARGEST = 1_000_000  # designs in a grid


def grid_name(problem: DesignProblem, step: float | None = None) -> str:
    """Return whose grid ``grid_designs`` returns: "the paper's grid" or "our grid"."""
    return "the paper's grid" if step is None and problem.grid() is not None else "our grid"


def grid_designs(problem: DesignProblem, step: float | None = None) -> FloatArray:
    """Return the paper's grid (n, d) within the bounds; with a step, or where there is none, ours.

    Without a step, ours has in each variable the one that it declares.

    Raises:
        ValueError: in one sentence, for a step that makes no grid or too large a one, or if none of
            the paper's grid is within the bounds.
    """
    designs = problem.grid() if step is None else None
    if designs is None:
        return _even_grid(problem, steps_of(problem, step))
    if len(designs) == 0:
        raise ValueError(
            f"no design of the paper's grid lies in this search space: {_space(problem)}"
        )
    return designs


def steps_of(problem: DesignProblem, step: float | None = None) -> FloatArray:
    """Return the steps (d,) of our grid: the one given, or those that the variables declare.

    Raises:
        ValueError: for a step that makes no grid.
    """
    if step is not None and not (0.0 < step < math.inf):
        raise ValueError(f"the grid's step is {step:g}: it must be finite and > 0")
    return np.array([v.step if step is None else step for v in problem.variables])


def steps_in_words(problem: DesignProblem, step: float | None = None) -> str:
    """Return the steps of our grid as people read them: one number if they are alike."""
    steps = steps_of(problem, step)
    if len(set(steps)) == 1:
        return f"{steps[0]:g}"
    return ", ".join(f"{v.name} {own:g}" for v, own in zip(problem.variables, steps, strict=True))


def _even_grid(problem: DesignProblem, steps: FloatArray) -> FloatArray:
    """Return the designs (n, d) so many steps (d,) apart, from the lower bounds."""
    counts = np.floor((problem.high - problem.low) / steps + 1e-9) + 1.0
    if np.prod(counts) > LARGEST:
        shown = ", ".join(f"{own:g}" for own in sorted(set(steps)))
        raise ValueError(
            f"a step of {shown} makes {np.prod(counts):,.0f} designs: choose a larger one, for at "
            f"most {LARGEST:,}"
        )
    axes = [
        np.append(low, np.minimum((low + step * np.arange(1, int(count))).round(12), high))
        for low, high, step, count in zip(problem.low, problem.high, steps, counts, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def _space(problem: DesignProblem) -> str:
    ranges = [f"{v.name} {v.low:g} to {v.high:g}" for v in problem.variables]
    return ", ".join([*ranges, *(f"{name} = {x:g}" for name, x in problem.fixed.items())])
