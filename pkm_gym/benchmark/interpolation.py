"""Interpolation: the optimal design of a task, from the optima of other tasks."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import KDTree

from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

NEIGHBOURS = 64
KERNEL = "cubic"


class Interpolation:
    """Radial basis functions over a pool's optimal designs.

    Tasks are measured in the widths of the Family's ranges; each design is interpolated from the
    nearest solvable tasks.

    Args:
        problem: the pool's problem.
        pool: solved tasks.
        neighbours: how many tasks each interpolation uses.

    Raises:
        ValueError: if the pool has fewer solvable tasks than that.
    """

    def __init__(self, problem: DesignProblem, pool: Pool, neighbours: int = NEIGHBOURS) -> None:
        known = pool.solvable
        if known.sum() < neighbours:
            raise ValueError(
                f"the pool has {known.sum()} solvable tasks: interpolation needs {neighbours}"
            )
        self.problem = problem
        drawn = np.array([variable.drawn for variable in problem.task_variables])
        ranges = np.array([(v.low, v.high - v.low) for v in problem.task_variables])[drawn]
        self._drawn, (self._low, self._span) = drawn, ranges.T
        self._designs = pool.designs[known]
        places = self.place(pool.tasks[known])
        self._tree = KDTree(places)
        self._function = RBFInterpolator(places, self._designs, neighbors=neighbours, kernel=KERNEL)

    def place(self, tasks: FloatArray) -> FloatArray:
        """Return where packed tasks (n, m) lie in the unit cube of the fields that are drawn."""
        return (tasks[:, self._drawn] - self._low) / self._span

    def designs(self, tasks: FloatArray) -> FloatArray:
        """Return interpolated optima (n, d) for packed tasks (n, m), clipped to the box."""
        found = self._function(self.place(tasks))
        return np.clip(found, self.problem.low, self.problem.high)

    def nearest(self, task: FloatArray, n: int) -> FloatArray:
        """Return the optimal designs (n, d) of the tasks nearest to a packed task (m,)."""
        _, rows = self._tree.query(self.place(task[None])[0], k=n)
        return self._designs[np.atleast_1d(rows)]
