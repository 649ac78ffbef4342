"""Interpolation: the optimal design of a task, from the optima of other tasks.

The optimum as a function of the task has kinks where a limit becomes active or ceases to be, and
between them it depends on few fields: those that are no limit, and the limits that are active. So
there is one interpolation for each set of active limits (a branch), over the fields that matter to
it. An optimum under fewer limits is never worse; so of the branches that occur near a task the one
that predicts the worst optimum is the right one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, TypeAlias

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import KDTree

from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray

KERNEL: Final = "cubic"
NEIGHBOURS = 64  # optima that one interpolation uses
NEARBY = 8  # tasks whose sets of active limits are tried
PROBE = 1e-4  # by which share of its range a limit is moved to see which constraints follow

Active: TypeAlias = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Branch:
    """The optima with one set of active limits.

    Attributes:
        active: columns of the active constraints.
        fields: array (m,), which fields of a task matter to it.
        predict: places (n, fields) -> designs and log of the objective, worst highest (n, d + 1).
    """

    active: Active
    fields: BoolArray
    predict: RBFInterpolator

    def at(self, places: FloatArray) -> FloatArray:
        """Return designs and objective (n, d + 1) at places (n, m)."""
        found: FloatArray = self.predict(places[:, self.fields])
        return found


class Interpolation:
    """Radial basis functions over a pool's optimal designs.

    Args:
        problem: the pool's problem.
        pool: solved tasks.

    Attributes:
        branches: active limits -> their branch.
        plain: the optima of all tasks over all fields, kinks and all.

    Raises:
        ValueError: if the pool has too few solvable tasks.
    """

    def __init__(self, problem: DesignProblem, pool: Pool) -> None:
        known = pool.solvable
        self.problem = problem
        self._low, high = np.array([(v.low, v.high) for v in problem.task_variables]).T
        self._span = np.where(high > self._low, high - self._low, 1.0)
        self._tasks, self._designs = pool.tasks[known], pool.designs[known]
        self._places = self.place(self._tasks)
        self._active = [tuple(np.flatnonzero(row).tolist()) for row in pool.active[known]]
        self._tree = KDTree(self._places)
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
        drawn = np.array([variable.drawn for variable in problem.task_variables])
        needed = 2 * (int(drawn.sum()) + 1)
        if known.sum() < needed:
            raise ValueError(
                f"the pool has {known.sum()} solvable tasks: interpolation needs {needed}"
            )
        minimised = problem.objectives[0].direction == "minimise"
        self._values = np.log(pool.optima[known]) * (1.0 if minimised else -1.0)
        self.plain = self._branch((), drawn, np.ones(len(self._tasks), dtype=bool))
        self.branches = self._branches(drawn)

    def place(self, tasks: FloatArray) -> FloatArray:
        """Return packed tasks (n, m) in widths of the Family's ranges."""
        return (tasks - self._low) / self._span

    def nearest(self, task: FloatArray, n: int) -> FloatArray:
        """Return the optimal designs (n, d) of the tasks nearest to a packed task (m,)."""
        return self._designs[self._near(task, n)]

    def designs(self, tasks: FloatArray) -> FloatArray:
        """Return interpolated optima (n, d) for packed tasks (n, m), clipped to the box."""
        return np.array([self.design(self.branch(task), self.place(task)) for task in tasks])

    def design(self, branch: Branch, place: FloatArray) -> FloatArray:
        """Return a branch's optimum (d,) at a place (m,), clipped to the box."""
        found = branch.at(place[None])[0, :-1]
        return np.clip(found, self.problem.low, self.problem.high)

    def branch(self, task: FloatArray, among: Iterable[int] = ()) -> Branch:
        """Return the branch of a packed task (m,).

        Args:
            task: array (m,).
            among: constraints that must be active there; ``plain`` is returned if no branch has
                them.
        """
        wanted = set(among)
        nearby = {self._active[row] for row in self._near(task, NEARBY)} & self.branches.keys()
        fitting = {active for active in nearby or self.branches if wanted <= set(active)}
        fitting = fitting or {active for active in self.branches if wanted <= set(active)}
        place = self.place(task)[None]
        candidates = [self.branches[active] for active in sorted(fitting)]
        return max(candidates, key=lambda branch: branch.at(place)[0, -1], default=self.plain)

    def tightened(self, task: FloatArray, branch: Branch, margin: float) -> FloatArray:
        """Return the place (m,) of a task whose active limits are tighter by a margin."""
        place = self.place(task)
        for constraint in branch.active:
            field = self.limit_of(constraint)
            if field is not None:
                place[field] += margin / self.slope(task, field, constraint)
        return place

    def slope(self, task: FloatArray, field: int, constraint: int) -> float:
        """Return by how much a constraint changes when a limit moves by its range's width.

        As measured at the optimum of the nearest known task.
        """
        return float(self._slopes[field][self._near(task, 1)[0], constraint])

    def limit_of(self, constraint: int) -> int | None:
        """Return the field (column) that moves a constraint, None if no limit does."""
        return self._limits.get(constraint)

    def _near(self, task: FloatArray, n: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
        n = min(n, len(self._designs))
        return np.atleast_1d(self._tree.query(self.place(task), k=n)[1])

    def _slope_of(self, field: int) -> FloatArray:
        """Return the slope of each constraint (n, c) over a limit, at the known optima."""
        variable = self.problem.task_variables[field]
        inward = np.where(self._places[:, field] > 0.5, -PROBE, PROBE)
        moved = self._tasks.copy()
        moved[:, field] += inward * (variable.high - variable.low)
        before, after = (
            self.problem.evaluate(self._designs, tasks).constraints
            for tasks in (self._tasks, moved)
        )
        return (after - before) / inward[:, None]

    def _branches(self, drawn: BoolArray) -> dict[Active, Branch]:
        limits = np.array([bool(variable.limit) for variable in self.problem.task_variables])
        branches = {}
        for active in set(self._active):
            rows = np.array([own == active for own in self._active])
            fields = drawn & ~limits
            fields[[self._limits[j] for j in active if j in self._limits]] = True
            if rows.sum() >= 2 * (fields.sum() + 1):
                branches[active] = self._branch(active, fields, rows)
        return branches

    def _branch(self, active: Active, fields: BoolArray, rows: BoolArray) -> Branch:
        predict = RBFInterpolator(
            self._places[np.ix_(rows, fields)],
            np.column_stack([self._designs, self._values])[rows],
            kernel=KERNEL,
            neighbors=min(NEIGHBOURS, int(rows.sum())),
        )
        return Branch(active, fields, predict)
