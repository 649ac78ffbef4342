"""observe: what a designer sees of its session, one pure function for everybody.

``DesignEnv`` documents the parts; all numbers lie in [-1, 1].
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
import numpy.typing as npt

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import Task
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.session import Session

FAMILY_EDGE = 0.6


def observation_layout(problem: DesignProblem) -> dict[str, slice]:
    """Return the parts of an observation, name -> slice, in order."""
    m, d, c = len(problem.task_variables), len(problem.low), len(problem.constraint_names)
    sizes = {
        "task": m,
        "best_design": d,
        "best_merit": 1,
        "best_constraints": c,
        "zoom_constraints": c,
        "other_design": d,
        "other_merit": 1,
        "other_constraints": c,
        "evaluated": 2,
        "budget_left": 1,
        "step_size": 1,
    }
    return slices(sizes)


def slices(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Return where parts of given sizes lie, one after the other."""
    ends = np.cumsum(list(sizes.values())).tolist()
    return {name: slice(end - sizes[name], end) for name, end in zip(sizes, ends, strict=True)}


def observe(problem: DesignProblem, tasks: FloatArray, session: Session) -> npt.NDArray[np.float32]:
    """Return the observations (n, size) of n sessions on packed tasks (n, m)."""
    span = problem.high - problem.low
    step = session.step_size[:, None]
    best, other = session.best, session.other
    compared = (session.evaluations > 1)[:, None]
    parts = (
        scaled_tasks(problem, tasks),
        2.0 * (best.designs - problem.low) / span - 1.0,
        np.tanh(best.log_merit / 3.0)[:, None],
        np.tanh(best.constraints),
        np.tanh(best.constraints / (2.0 * step)),
        compared * (other.designs - best.designs) / (4.0 * step * span),
        compared * np.tanh((other.log_merit - best.log_merit)[:, None] / step),
        compared * np.tanh(other.constraints / (2.0 * step)),
        session.evaluations[:, None] > 0,
        compared,
        session.left[:, None] / session.rules.budget,
        1.0 + 0.5 * np.log10(step),
    )
    return np.clip(np.hstack(parts), -1.0, 1.0).astype(np.float32)


def scaled_tasks(problem: DesignProblem, tasks: FloatArray) -> FloatArray:
    """Return packed tasks (n, m) on the scale of an observation, linear in each piece."""
    low, high, span, below, above = _pieces(problem.task_type)  # type: ignore[arg-type]  # a class can be hashed
    inside = np.clip((tasks - low) / span, 0.0, 1.0)
    outside = np.clip((tasks - high) / above, 0.0, 1.0) - np.clip((low - tasks) / below, 0.0, 1.0)
    scaled: FloatArray = FAMILY_EDGE * (2.0 * inside - 1.0) + (1.0 - FAMILY_EDGE) * outside
    return np.where(low < high, scaled, 0.0)


@cache
def _pieces(task: type[Task]) -> tuple[FloatArray, ...]:
    """Return low and high of the Family (m,) and the widths of it, of below it and of above it.

    A piece without width is never entered: its width is infinite.
    """
    edges = np.array([(v.legal_low, v.low, v.high, v.legal_high) for v in task.variables()]).T
    below, span, above = (np.where(width > 0.0, width, np.inf) for width in np.diff(edges, axis=0))
    return edges[1], edges[2], span, below, above
