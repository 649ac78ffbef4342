"""The best feasible design on a lattice of dimensions, near a design that lies on none."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.buildable.dimensions import BUILT, Dimensions
from pkm_gym.studies.buildable.lattice import Axis, Lattice
from pkm_gym.studies.buildable.relaxed import relaxed
from pkm_gym.studies.buildable.window import REACH, ROOMS, Report, Window

POINTS = 5_000  # lattice points that are evaluated, at most
WIDE = (3e-3, 1e-2, 3e-2)  # more room to limits, for descents from afar
SIDES = 2  # values in stock that are tried on each side of the start's


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
    next ones. What is searched and has no axis moves to where it is best with the others.

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
        Window(dimensions, own, centre, held, report or (lambda _: None))
        for centre, held in _centres(dimensions, own, begin)
    ]
    for i, search in enumerate(searches):
        spent = sum(other.examined for other in searches)
        search.run((points - spent) // (len(searches) - i), spent)
    for search in searches:
        search.settle()
        search.refine()
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
        yield (_begun(dimensions, begin, values) if held else begin), held


def _begun(dimensions: Dimensions, begin: FloatArray, held: Mapping[int, float]) -> FloatArray:
    """Return the best place (k,) found with some coordinates held.

    Descents may lose their way at a kink: several are made, with more and more room to the limits.
    """
    ends = np.array([relaxed(dimensions, begin, held, room) for room in (*ROOMS, *WIDE)])
    best: FloatArray = ends[dimensions.evaluate(ends).log_merit.argmin()]
    return best
