"""A window of lattice points about a centre, and the best feasible one in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from pkm_gym.core.types import FloatArray
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.lattice import EXACT, Axis, grid_of, values_of
from pkm_gym.studies.buildable.relaxed import relaxed

MOST = 60_000  # lattice points that are looked at, more where more may be evaluated
REACH = 40  # steps
BATCH = 512
ROOMS = (0.0, 1e-6, 1e-5, 1e-4, 1e-3)  # to limits, that a refinement tries: limits have kinks

Numbers = npt.NDArray[np.intp]
Report = Callable[[int], None]


class Window:
    """The search of a window about one centre (k,) that grows."""

    def __init__(
        self,
        dimensions: Dimensions,
        own: Sequence[Axis | None],
        centre: FloatArray,
        held: Mapping[int, int],
        report: Report,
    ) -> None:
        self._dimensions, self._axes, self._centre = dimensions, own, centre
        self._held, self._report, self._slack = held, report, _slack(dimensions, own, centre, held)
        self._low, self._high = dimensions.box()
        self._spent, self._looked = 0, MOST
        self.best: Numbers | None = None
        self.rank = (True, np.inf)
        self.reach = self.examined = self.window = 0

    def run(self, most: int, spent: int) -> None:
        """Evaluate whole rings up to half of ``most`` designs, then the most promising farther."""
        self._spent, self._looked = spent, max(MOST, 2 * most)
        rings: list[Numbers] = []
        for reach in range(1, REACH + 1):
            numbers = self._ring(reach)
            if numbers is None or (reach > 1 and len(numbers) == 0):
                break
            found = self._possible(numbers)
            if not rings and self.examined + len(found) <= most // 2:
                self._try(found)
                self.reach = reach
                self.window += len(found)
            else:
                rings.append(found)
        if rings:
            far = np.concatenate(rings)
            self._try(far[self._promise(far)[: most - self.examined]])

    def settle(self) -> None:
        """Go on to better neighbours, a step of one dimension or of two, until there is none."""
        before = (False, -np.inf)
        while self.best is not None and self.rank != before:
            before = self.rank
            self._try(self._possible(self.best + self._steps(2)))

    def refine(self) -> None:
        """Let dimensions that have no axis move to where they are best with the answer's others."""
        names, axes = self._dimensions.names, self._axes
        plain = self._dimensions.searched - self._dimensions.following.keys()
        free = [k for k, axis in enumerate(axes) if axis is None and names[k] in plain]
        if self.best is None or not free:
            return
        answer = self.answer
        held = {k: float(answer[k]) for k, axis in enumerate(axes) if axis is not None}
        for room in ROOMS:
            before, rank = self._centre, self.rank
            self._centre = relaxed(self._dimensions, answer, held, room)
            self._try(self.best[None])
            if self.rank == rank:
                self._centre = before

    @property
    def answer(self) -> FloatArray:
        """The best point (k,) that was found."""
        assert self.best is not None
        return np.asarray(self.points(self.best[None])[0])

    def points(self, numbers: Numbers) -> FloatArray:
        """Return the points (n, k) of numbers (n, k)."""
        return self._dimensions.followed(values_of(self._axes, numbers, self._centre))

    def touched(self) -> dict[str, tuple[tuple[str, int], ...]]:
        """Return the limits that a step of one dimension from the best breaks, with the steps."""
        steps = self._steps(1)
        if self.best is None or not len(steps):
            return {}
        evaluation = self._dimensions.evaluate(self.points(self.best + steps))
        broken = evaluation.defined & (evaluation.constraints > 0.0)
        ways = [
            (self._dimensions.names[k], int(step[k])) for step in steps for k in step.nonzero()[0]
        ]
        names = self._dimensions.problem.constraint_names
        return {
            name: tuple(way for way, bad in zip(ways, column, strict=True) if bad)
            for name, column in zip(names, broken.T, strict=True)
            if column.any()
        }

    def _steps(self, most: int) -> Numbers:
        """Return the steps (n, k) to neighbours, of one dimension, or of up to ``most``."""
        moved = [k for k, a in enumerate(self._axes) if a is not None and k not in self._held]
        one = np.eye(len(self._axes), dtype=np.intp)[moved]
        single = np.concatenate([-one, one])
        if most == 1:
            return np.asarray(single)
        first, second = np.triu_indices(len(single), 1)
        pairs = single[first] + single[second]
        return np.concatenate([single, pairs[np.abs(pairs).sum(axis=1) > 0]])

    def _ring(self, reach: int) -> Numbers | None:
        """Return the numbers (n, k) of the points that a reach adds, None if there are too many."""
        near = [self._near(k, reach) for k in range(len(self._axes))]
        numbers = grid_of(near, self._looked)
        if numbers is None or reach == 1:
            return numbers
        inner = [self._near(k, reach - 1) for k in range(len(self._axes))]
        inside = [np.isin(column, known) for column, known in zip(numbers.T, inner, strict=True)]
        return np.asarray(numbers[~np.all(inside, axis=0)])

    def _near(self, k: int, reach: int) -> Numbers:
        axis = self._axes[k]
        if axis is None:
            return np.zeros(1, dtype=np.intp)
        if k in self._held:
            return np.array([self._held[k]], dtype=np.intp)
        return axis.near(self._centre[k], reach)

    def _possible(self, numbers: Numbers) -> Numbers:
        """Return those whose designs lie in the box and are of the task, but for the slack."""
        designs, tasks = self._dimensions.designs(self.points(numbers))
        fields = self._dimensions.problem.task_type.names()
        kept = ((designs >= self._low) & (designs <= self._high)).all(axis=1)
        for name, asked in self._dimensions.settled.items():
            kept &= np.abs(tasks[:, fields.index(name)] - asked) <= self._slack[name]
        return np.asarray(numbers[kept])

    def _try(self, numbers: Numbers) -> None:
        """Evaluate points and keep the best."""
        sign = self._dimensions.problem.objectives[0].sign
        for part in np.split(numbers, range(BATCH, len(numbers), BATCH)):
            if not len(part):
                continue
            evaluation = self._dimensions.evaluate(self.points(part))
            i = evaluation.best()
            feasible = bool(evaluation.feasible[i])
            value = sign * evaluation.objectives[i, 0] if feasible else evaluation.log_merit[i]
            if (not feasible, float(value)) < self.rank:
                self.best, self.rank = part[i], (not feasible, float(value))
            self.examined += len(part)
            self._report(self._spent + self.examined)

    def _promise(self, numbers: Numbers) -> Numbers:
        """Return the order (n,) of points in which slopes at the centre promise the best."""
        pitches = [axis.pitch if axis else 0.0 for axis in self._axes]
        moved = [k for k, pitch in enumerate(pitches) if pitch > 0.0]
        probes = np.repeat(self._centre[None], len(moved) + 1, axis=0)
        for row, k in enumerate(moved, 1):
            probes[row, k] += pitches[k]
        evaluation = self._dimensions.evaluate(probes)
        first = self._dimensions.problem.objectives[0]
        values = np.column_stack(
            [
                first.sign * np.log(np.abs(first.offset + evaluation.objectives[:, 0])),
                evaluation.constraints,
            ]
        )
        slopes = np.nan_to_num((values[1:] - values[0]) / np.array(pitches)[moved][:, None])
        guess = values[0] + (self.points(numbers) - self._centre)[:, moved] @ slopes
        weight = self._dimensions.problem.penalty_weight
        penalty = weight * np.maximum(guess[:, 1:], 0.0).sum(axis=1)
        return np.argsort(guess[:, 0] + penalty, kind="stable")


def _slack(
    dimensions: Dimensions, own: Sequence[Axis | None], centre: FloatArray, held: Mapping[int, int]
) -> dict[str, float]:
    """Return by how much task fields may differ: what half a step of one dimension makes."""
    slack = dict.fromkeys(dimensions.settled, 0.0)
    fields = dimensions.problem.task_type.names()
    for k, axis in enumerate(own):
        if axis is None or k in held or not slack:
            continue
        pair = np.repeat(centre[None], 2, axis=0)
        pair[:, k] += 0.5 * axis.pitch * np.array([-1.0, 1.0])
        tasks = dimensions.designs(pair)[1]
        for name in slack:
            low, high = tasks[:, fields.index(name)]
            slack[name] = max(slack[name], (0.5 + EXACT) * abs(high - low))
    return slack
