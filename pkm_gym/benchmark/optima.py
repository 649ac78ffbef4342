"""KnownOptima: the training tasks' optima, the nearest of them, and what their limits move."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import View
from pkm_gym.core.solve import ACTIVE
from pkm_gym.core.types import BoolArray, FloatArray

PROBE = 1e-4  # by which share of its range a limit is moved to see which constraints follow
STEP = 1e-5  # the same of a design
LEAST = 1e-3  # of the largest singular value: what is smaller is no independent constraint


class KnownOptima:
    """Solved tasks, measured in the widths of the Family's ranges.

    Args:
        view: of the problem.
        training: solved tasks, at least one of them solvable.
    """

    def __init__(self, view: View, training: Training) -> None:
        self._view, self._training = view, training
        self._low, high = np.array([(v.low, v.high) for v in view.task_variables]).T
        self._width = np.where(high > self._low, high - self._low, 1.0)
        self._rows = np.flatnonzero(training.solvable)
        self._tasks, self._designs = training.tasks[self._rows], training.designs[self._rows]
        self._tree = KDTree((self._tasks - self._low) / self._width)

    def measure(self) -> None:
        """Evaluate what the limits move, and what designs do where no limit moves a constraint.

        While a method prepares: what a session asks for is then known.
        """
        alone = self._training.active[self._rows].any(axis=0)
        if any(self.limit_of(j) is None for j in np.flatnonzero(alone).tolist()):
            _ = self._slopes_over_designs

    def nearest(self, task: FloatArray, n: int) -> FloatArray:
        """Return the optimal designs (n, d) of the tasks nearest to a packed task (m,)."""
        return self._designs[self._near(task, n)]

    def limit_of(self, constraint: int) -> int | None:
        """Return the field (column) of the limit that moves a constraint and no other, or None."""
        return self._limits.get(constraint)

    def slope(self, task: FloatArray, constraint: int) -> float:
        """Return by how much a constraint changes when its limit moves by its range's width.

        As measured at the optimum of the nearest known task.
        """
        slopes = self._slopes[self._limits[constraint]]
        return float(slopes[self._near(task, 1)[0], constraint])

    def way(self, task: FloatArray, constraint: int, active: BoolArray) -> FloatArray:
        """Return the shortest way (d,) in a box of width 1 that lowers a constraint by 1.

        The other active ones (c,) stay as they are; all this as the slopes at the optimum of the
        nearest known task have it.
        """
        held = active.copy()
        held[constraint] = True
        slopes = self._slopes_over_designs[self._near(task, 1)[0]]
        ways = np.linalg.pinv(slopes[held], rcond=LEAST)
        own = int(np.flatnonzero(np.flatnonzero(held) == constraint)[0])
        return np.asarray(-ways[:, own], dtype=float)

    @cached_property
    def _limits(self) -> dict[int, int]:
        """Constraint -> the field of the limit that moves it and no other."""
        moved = {i: np.flatnonzero(slopes.any(axis=0)) for i, slopes in self._slopes.items()}
        return {int(j[0]): i for i, j in moved.items() if len(j) == 1}

    @cached_property
    def _slopes(self) -> dict[int, FloatArray]:
        """Field of a limit -> the slope of each constraint (n, c) over it, at the known optima."""
        before = self._training.evaluate(self._designs, self._rows).constraints
        return {
            i: self._slope_of(i, before)
            for i, variable in enumerate(self._view.task_variables)
            if variable.drawn and variable.name in self._view.sides
        }

    @cached_property
    def _slopes_over_designs(self) -> FloatArray:
        """The slope of each constraint (n, c, d) over the box at the known optima.

        It is 0 where a bound is active.
        """
        low, span = self._view.low, self._view.high - self._view.low
        places = (self._designs - low) / span
        slopes = []
        for step in STEP * np.eye(len(low)):
            below, above = (
                self._training.evaluate(low + span * (places + way), self._rows).constraints
                for way in (-step, step)
            )
            slopes.append((above - below) / (2.0 * STEP))
        free = (places > ACTIVE) & (places < 1.0 - ACTIVE)
        return np.stack(slopes, axis=2) * free[:, None]

    def _near(self, task: FloatArray, n: int) -> npt.NDArray[np.intp]:
        n = min(n, len(self._designs))
        return np.atleast_1d(self._tree.query((task - self._low) / self._width, k=n)[1])

    def _slope_of(self, field: int, before: FloatArray) -> FloatArray:
        """Return the slope of each constraint (n, c), ``before`` at the optima, over a limit."""
        middle = self._low[field] + 0.5 * self._width[field]
        inward = np.where(self._tasks[:, field] > middle, -PROBE, PROBE)
        moved = self._tasks[:, field] + inward * self._width[field]
        name = self._view.task_variables[field].name
        after = self._training.evaluate(self._designs, self._rows, {name: moved}).constraints
        return (after - before) / inward[:, None]
