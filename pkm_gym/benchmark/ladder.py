"""Ladder: interpolated optima of a task whose limits are corrected by what evaluations say."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from pkm_gym.benchmark.interpolation import Cubic, Interpolation, Part, check_size, task_points
from pkm_gym.benchmark.optima import KnownOptima
from pkm_gym.benchmark.session import Session
from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import View
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.observation import FAMILY_EDGE

# By how much of a constraint the active limits are first tightened, and the share of it that is
# left at each further rung.
MARGIN, SHRINK = 2e-4, 0.4


class Rung(NamedTuple):
    """Where the next design is taken from.

    Attributes:
        point: array (k,), of a task with corrected limits.
        shift: array (d,), by which its optimum is moved in a box of width 1, for constraints that
            no field of the task limits.
    """

    point: FloatArray
    shift: FloatArray


class Ladder:
    """What is known of the training tasks, and how to climb from it to a new task's optimum.

    Args:
        view: of the problem.
        training: solved tasks.

    Raises:
        ValueError: if there are too few solvable tasks.
    """

    def __init__(self, view: View, training: Training) -> None:
        drawn = [variable.drawn for variable in view.task_variables]
        check_size(view, training)
        self.interpolation = Interpolation(view, training)
        self.optima = KnownOptima(view, training)
        self.optima.measure()
        self._column = np.cumsum(drawn) - 1  # of a task's field among those that are drawn
        self._plain = self._all_tasks(view, training)

    def climb(self, session: Session, rungs: int) -> None:
        """Evaluate the rungs of a task, at most so many.

        What an evaluation says of the active constraints is laid on their limits: where one is
        broken, the optimum of a task is tried whose limit is that much tighter; where one is not
        reached, of a task whose limit is looser. A limit that is broken unforeseen asks for another
        part of the interpolation.
        """
        task = session.task
        point = task_points(session.view, task[None])[0]
        parts = self._parts(point)
        part = next(parts)
        margin = MARGIN
        rung = self._tightened(task, point, part, margin)
        for _ in range(rungs):
            places = part.designs(rung.point[None]) + rung.shift
            design = self.interpolation.in_box(places)[0]
            constraints = session.evaluate(design).constraints[0]
            broken = constraints > margin
            if part is not self._plain and (broken & ~part.active).any():
                part = next(p for p in parts if p is self._plain or not (broken & ~p.active).any())
                rung = self._tightened(task, point, part, MARGIN)
                continue
            margin *= SHRINK
            for j in np.flatnonzero(broken | part.active).tolist():
                self._move(rung, task, part, j, constraints[j] + margin)

    def _parts(self, point: FloatArray) -> Iterator[Part]:
        """Yield the parts, the least doubtful at a point (k,) first, and what holds for all."""
        order: Iterable[int] = self.interpolation.doubts(point[None])[:, 0].argsort().tolist()
        yield from (self.interpolation.parts[at] for at in order)
        yield self._plain

    def _tightened(self, task: FloatArray, point: FloatArray, part: Part, margin: float) -> Rung:
        """Return the rung of a task whose active limits are tighter by a margin."""
        rung = Rung(point.copy(), np.zeros(len(self.interpolation.problem.low)))
        for j in np.flatnonzero(part.active).tolist():
            self._move(rung, task, part, j, margin)
        return rung

    def _move(
        self, rung: Rung, task: FloatArray, part: Part, constraint: int, amount: float
    ) -> None:
        """Move a rung in place, so that a constraint's limit is tighter by an amount."""
        field = self.optima.limit_of(constraint)
        if field is None:
            rung.shift[:] += amount * self.optima.way(task, constraint, part.active)
        else:
            width = 2.0 * FAMILY_EDGE  # of the Family's range, among the points
            slope = self.optima.slope(task, constraint)
            rung.point[self._column[field]] += amount * width / slope

    def _all_tasks(self, view: View, training: Training) -> Part:
        """Return the part of all solvable tasks, whatever limits are active: kinks and all."""
        kept = training.solvable
        points = task_points(view, training.tasks[kept])
        places = (training.designs[kept] - view.low) / (view.high - view.low)
        through = Cubic.through(points, places)
        return Part(np.zeros(len(view.constraint_names), dtype=bool), through, through)
