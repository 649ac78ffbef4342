"""KnownOptima: the training tasks' optima, the nearest of them, and what their limits move."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

PROBE = 1e-4  # by which share of its range a limit is moved to see which constraints follow


class KnownOptima:
    """Solved tasks, measured in the widths of the Family's ranges.

    Args:
        problem: the pool's problem.
        pool: solved tasks, at least one of them solvable.
    """

    def __init__(self, problem: DesignProblem, pool: Pool) -> None:
        self._problem = problem
        self._low, high = np.array([(v.low, v.high) for v in problem.task_variables]).T
        self._width = np.where(high > self._low, high - self._low, 1.0)
        self._tasks, self._designs = pool.tasks[pool.solvable], pool.designs[pool.solvable]
        self._tree = KDTree((self._tasks - self._low) / self._width)
        self._slopes = {
            i: self._slope_of(i)
            for i, variable in enumerate(problem.task_variables)
            if variable.drawn and variable.limit
        }
        self._limits = {
            int(j): i
            for i, slopes in self._slopes.items()
            for j in np.flatnonzero(slopes.any(axis=0))
        }

    def nearest(self, task: FloatArray, n: int) -> FloatArray:
        """Return the optimal designs (n, d) of the tasks nearest to a packed task (m,)."""
        return self._designs[self._near(task, n)]

    def limit_of(self, constraint: int) -> int | None:
        """Return the field (column) of the limit that moves a constraint, None if none does."""
        return self._limits.get(constraint)

    def slope(self, task: FloatArray, constraint: int) -> float:
        """Return by how much a constraint changes when its limit moves by its range's width.

        As measured at the optimum of the nearest known task.
        """
        slopes = self._slopes[self._limits[constraint]]
        return float(slopes[self._near(task, 1)[0], constraint])

    def _near(self, task: FloatArray, n: int) -> npt.NDArray[np.intp]:
        n = min(n, len(self._designs))
        return np.atleast_1d(self._tree.query((task - self._low) / self._width, k=n)[1])

    def _slope_of(self, field: int) -> FloatArray:
        """Return the slope of each constraint (n, c) over a limit, at the known optima."""
        middle = self._low[field] + 0.5 * self._width[field]
        inward = np.where(self._tasks[:, field] > middle, -PROBE, PROBE)
        moved = self._tasks.copy()
        moved[:, field] += inward * self._width[field]
        before, after = (
            self._problem.evaluate(self._designs, tasks).constraints
            for tasks in (self._tasks, moved)
        )
        return (after - before) / inward[:, None]
