"""Designs that a search starts from, and the grids."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np
from optuna import Study

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.report import ranking
from pkm_gym.studies.samplers import called
from pkm_gym.studies.storage import designs_of, load_study, open_storage

WARM_STARTS = 10  # how many designs of a grid or a study a warm start takes over
STEP = 0.01  # of our grid, in the variables' own units, where the paper has none
PROPOSALS = "pkm_gym.agents.sampler:proposals"  # of a trained designer: a higher room
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


def warm_designs(problem: DesignProblem, source: str, where: str) -> FloatArray:
    """Return the designs (n, d), within the bounds, that a search starts from.

    Args:
        problem: what is searched.
        source: "paper", "grid", "designer:N" or the name of a study.
        where: the storage of that study.

    Raises:
        ValueError: in one sentence, if there are none.
    """
    if source == "paper":
        designs = problem.printed_design()[None]
    elif source == "grid":
        designs = grid_designs(problem)
    elif match := re.fullmatch(r"designer:(\d+)", source):
        return np.asarray(called(PROPOSALS, problem, int(match[1])))
    else:
        designs = designs_of(load_study(open_storage(where, create=False), source), problem)
    inside = designs[((designs >= problem.low) & (designs <= problem.high)).all(axis=1)]
    if len(inside) == 0:
        raise ValueError(f"no design of {source!r} lies within the search bounds")
    return inside[ranking(problem.evaluate(inside))[:WARM_STARTS]]


def enqueue(study: Study, problem: DesignProblem, starts: Sequence[FloatArray]) -> None:
    """Have a study try these designs (n, d) first, those that it doesn't have yet."""
    for design in [design for designs in starts for design in designs]:
        params = dict(zip(problem.variable_names, map(float, design), strict=True))
        study.enqueue_trial(params, skip_if_exists=True)
