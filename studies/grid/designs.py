"""The designs of a grid: the paper's, or ours."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import Variable
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import show

LARGEST = 1_000_000  # designs in a grid


def grid_name(problem: DesignProblem, step: float | None = None) -> str:
    """Return whose grid ``grid_designs`` returns: "the paper's grid" or "our grid".

    It is the paper's where that prints the values of every variable that is searched.
    """
    scanned = all(variable.scanned for variable in problem.all_variables if variable.searched)
    return "the paper's grid" if step is None and scanned else "our grid"


def grid_in_words(problem: DesignProblem, step: float | None = None) -> str:
    """Return whose grid ``grid_designs`` returns, and which of its steps are ours."""
    name = grid_name(problem, step)
    if step is not None or problem.grid() is None:
        return f"{name} (a step of {steps_in_words(problem, step)} over the bounds)"
    if name == "the paper's grid":
        return name
    own = f"a step of {_named_steps(v for v in problem.variables if v.searched and not v.scanned)}"
    scanned = ", ".join(v.name for v in problem.all_variables if v.scanned)
    if scanned:
        return f"{name} (the paper's values of {scanned}, {own})"
    return f"{name} ({own} over the paper's ranges)"


def grid_designs(problem: DesignProblem, step: float | None = None) -> FloatArray:
    """Return the problem's own grid (n, d) within its bounds, or an even one over the bounds.

    The latter with a step, or where there is no other: then with the one that each variable
    declares.

    Raises:
        ValueError: in one sentence, for a step that makes no grid or too large a one, or if none of
            the problem's own grid is within the bounds.
    """
    designs = problem.grid() if step is None else None
    if designs is None:
        return _even_grid(problem, steps_of(problem, step))
    if len(designs) == 0:
        raise ValueError(
            f"no design of {grid_name(problem)} lies in this search space: {_space(problem)}"
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
    return _named_steps(problem.variables)


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


def _named_steps(variables: Iterable[Variable]) -> str:
    return ", ".join(f"{v.name} {show(v.step, v.unit)}" for v in variables)


def _space(problem: DesignProblem) -> str:
    ranges = [f"{v.name} {v.low:g} to {v.high:g}" for v in problem.variables]
    return ", ".join([*ranges, *(f"{name} = {x:g}" for name, x in problem.fixed.items())])
