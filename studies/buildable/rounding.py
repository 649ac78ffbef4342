"""The best feasible design on a lattice of dimensions, near a design that lies on none."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.buildable.dimensions import BUILT, Dimensions
from pkm_gym.studies.buildable.lattice import EXACT, Axis, Lattice, grid_of, values_of
from pkm_gym.studies.buildable.relaxed import relaxed

POINTS = 5_000  # lattice points that are evaluated, at most
WINDOW = 60_000  # lattice points that are looked at, at most
REACH = 40  # steps
BATCH = 512
SIDES = 2  # values in stock that are tried on each side of the start's

Numbers = npt.NDArray[np.intp]
Report = Callable[[int], None]


@dataclass(frozen=True)
class Rounded:
    """What a search of a lattice found.

    Attributes:
        start: evaluation of the design that it began with, one design.
        best: evaluation of the answer, one design with every variable free, for the task that its
            dimensions settle; of the lowest merit where none is feasible.
        dimensions: name -> before, after, in SI: lengths, angles, and what else has an axis.
        lattice: the names of those on the lattice; the others have any value.
        units: of each dimension, SI.
        touched: limits that a step of one dimension breaks, with the step: ("l1", +1).
        reach: how many steps to each side of where it looked every point was evaluated.
        window: how many points that are, whose dimensions make a machine of the task.
        examined: points that were evaluated, the most promising ones farther off among them.
    """

    start: Evaluation
    best: Evaluation
    dimensions: dict[str, tuple[float, float]]
    lattice: tuple[str, ...]
    units: dict[str, str]
    touched: dict[str, tuple[tuple[str, int], ...]]
    reach: int
    window: int
    examined: int

    @property
    def cost(self) -> float:
        """By which share of the start's the objective is worse."""
        sign = self.start.problem.objectives[0].sign
        before, after = (float(e.objectives[0, 0]) for e in (self.start, self.best))
        return sign * (after - before) / abs(before)


def round_design(
    problem: DesignProblem,
    design: FloatArray,
    axes: Lattice,
    *,
    points: int = POINTS,
    report: Report | None = None,
) -> Rounded:
    """Return the best feasible design on a lattice near a design (d,).

    A window grows by a step to each side while all its points may be evaluated for half of what is
    allowed; the other half goes to the points farther off that slopes at the start promise most,
    and then the best moves on to better neighbours, a step of one dimension or of two, until there
    are none. Where values are in stock, the other dimensions start from the optimum for each of the
    next ones.

    Args:
        problem: the problem, with its task.
        design: array (d,), an optimum as a rule.
        axes: dimension -> the values that it can have; see ``Dimensions`` and ``lattice``.
        points: how many designs may be evaluated.
        report: called with the number of designs evaluated so far.

    Raises:
        ValueError: in one sentence, for a design that makes no machine, an unknown dimension or a
            window without a point.
    """
    dimensions = Dimensions(problem, design)
    check_known("dimension", axes, dimensions.names)
    begin = dimensions.of(dimensions.full)
    own = [
        _moved(dimensions, name, axes.get(name), x)
        for name, x in zip(dimensions.names, begin.tolist(), strict=True)
    ]
    searches = [
        _Search(dimensions, own, centre, held, report or (lambda _: None))
        for centre, held in _centres(dimensions, own, begin)
    ]
    for i, search in enumerate(searches):
        spent = sum(other.examined for other in searches)
        search.run((points - spent) // (len(searches) - i), spent)
    for search in searches:
        search.settle()
    found = [search for search in searches if search.best is not None]
    if not found:
        raise ValueError(
            f"no lattice point within {REACH} steps makes a machine of the task: choose finer steps"
        )
    best = min(found, key=lambda search: search.rank)
    names = dimensions.names
    kept = {*axes, *(name for name, source in dimensions.following.items() if source in axes)}
    pairs = zip(names, begin.tolist(), best.answer.tolist(), strict=True)
    return Rounded(
        problem.evaluate(np.asarray(design)[None]),
        dimensions.one(best.answer),
        {name: (x, y) for name, x, y in pairs if name in kept or dimensions.units[name] in BUILT},
        tuple(name for name in names if name in kept),
        dimensions.units,
        best.touched(),
        min(search.reach for search in searches),
        sum(search.window for search in searches),
        sum(search.examined for search in searches),
    )


def _moved(dimensions: Dimensions, name: str, axis: Axis | None, value: float) -> Axis | None:
    """Return the axis of a dimension that is moved, None of one that stays or follows another."""
    if axis is None or name in dimensions.following:
        return None
    stays = name not in dimensions.searched and axis.holds(value)
    return None if stays else axis


def _centres(
    dimensions: Dimensions, own: Sequence[Axis | None], begin: FloatArray
) -> Iterator[tuple[FloatArray, dict[int, int]]]:
    """Yield where to search (k,), and which numbers of which axes are held: those in stock."""
    stocked = [k for k, axis in enumerate(own) if axis is not None and axis.stock]
    choices = [own[k].near(begin[k], SIDES).tolist() for k in stocked]  # type: ignore[union-attr]
    for numbers in product(*choices):
        held = dict(zip(stocked, numbers, strict=True))
        values = {k: own[k].value(number) for k, number in held.items()}  # type: ignore[union-attr]
        yield (relaxed(dimensions, begin, values) if held else begin), held


class _Search:
    """The search of a window about one centre (k,) that grows."""

    def __init__(
        self,
        dimensions: Dimensions,
        own: Sequence[Axis | None],
        centre: FloatArray,
        held: dict[int, int],
        report: Report,
    ) -> None:
        self._dimensions, self._axes, self._centre = dimensions, own, centre
        self._held, self._report, self._slack = held, report, _slack(dimensions, own, centre, held)
        self._low, self._high = dimensions.box()
        self._spent = 0
        self.best: Numbers | None = None
        self.rank = (True, np.inf)
        self.reach = self.examined = self.window = 0

    def run(self, most: int, spent: int) -> None:
        """Evaluate whole rings up to half of ``most`` designs, then the most promising farther."""
        self._spent = spent
        rings = []
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
        if not len(steps):
            return {}
        broken = self._dimensions.evaluate(self.points(self.best + steps)).constraints > 0.0
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
        numbers = grid_of(near, WINDOW)
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
        weight = self._dimensions.problem.declared.penalty_weight
        penalty = weight * np.maximum(guess[:, 1:], 0.0).sum(axis=1)
        return np.argsort(guess[:, 0] + penalty, kind="stable")


def _slack(
    dimensions: Dimensions, own: Sequence[Axis | None], centre: FloatArray, held: dict[int, int]
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
