"""Interpolation: the optimal designs of a pool, continued to tasks that it doesn't hold."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import View
from pkm_gym.core.pool import Pool
from pkm_gym.core.reading import check_arrays
from pkm_gym.core.solve import ACTIVE
from pkm_gym.core.statement import ProblemStatement
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.envs.observation import FAMILY_EDGE

NEIGHBOUR = 3  # the fourth nearest point says how well an input is surrounded
DISTANCE = 0.1  # a distance of 1 counts like a violation of this
TINY = 1e-300
FOLDS = 8  # that a pool is cut into
LEAST_STRETCH = 1e-3  # of an input to which nothing reacts, beside that of the strongest one

PART = (
    "active", "points",
    "designs.stretch", "designs.weights",
    "constraints.stretch", "constraints.weights",
)  # fmt: skip


@dataclass(frozen=True)
class Cubic:
    """Cubic radial basis functions and a linear polynomial through given points.

    Attributes:
        points: array (n, m), where the values are given.
        stretch: array (m,), by which coordinates are multiplied before distances are taken.
        weights: array (n + 1 + m, k), of the basis functions, the constant and the coordinates.
    """

    points: FloatArray
    stretch: FloatArray
    weights: FloatArray

    @classmethod
    def through(cls, points: FloatArray, values: FloatArray) -> Cubic:
        """Return the interpolant of values (n, k) at points (n, m).

        Each coordinate is stretched by how strongly the values react to it, so that points count
        as near if their values are.
        """
        n, m = points.shape
        stretched = stretch(points, values)
        nodes = points * stretched
        polynomial = np.c_[np.ones(n), nodes]
        matrix = np.block(
            [[_cubes(nodes, nodes), polynomial], [polynomial.T, np.zeros((m + 1, m + 1))]]
        )
        right = np.vstack([values, np.zeros((m + 1, values.shape[1]))])
        return cls(points, stretched, np.linalg.solve(matrix, right))

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the values (n, k) at points (n, m)."""
        stretched = points * self.stretch
        cubes = _cubes(stretched, self.points * self.stretch)
        basis = np.c_[cubes, np.ones(len(points)), stretched]
        values: FloatArray = basis @ self.weights
        return values

    def distance(self, points: FloatArray) -> FloatArray:
        """Return how far points (n, m) lie from the given ones (n,): from the fourth nearest."""
        cubes = _cubes(points * self.stretch, self.points * self.stretch)
        fourth: FloatArray = np.cbrt(np.partition(cubes, NEIGHBOUR, axis=1)[:, NEIGHBOUR])
        return fourth


@dataclass(frozen=True)
class Part:
    """The tasks of a pool whose optima are held back by the same limits.

    Attributes:
        active: array (c,), the constraints among those limits.
        designs: task -> optimal design, the box to 0...1.
        constraints: task -> constraints there.
    """

    active: BoolArray
    designs: Cubic
    constraints: Cubic


def check_size(problem: View | ProblemStatement, pool: Training | Pool) -> None:
    """Refuse a pool with too few solvable tasks.

    Raises:
        ValueError: saying how many it has and how many are needed.
    """
    drawn = sum(variable.drawn for variable in problem.task_variables)
    solvable, needed = int(pool.solvable.sum()), max(FOLDS, 2 * (drawn + 1))
    if solvable < needed:
        raise ValueError(f"the pool has {solvable} solvable tasks: interpolation needs {needed}")


class Interpolation:
    """What a pool says of the optimal design of any task.

    As long as the same limits hold it back, an optimum moves smoothly with the task; where they
    change, it bends. So the tasks of a pool are parted by the limits that are active at their
    optima, the bounds of the box among them, and each part is interpolated by itself. A task gets
    the design of the part whose other limits are predicted to hold, and whose tasks are near.
    """

    def __init__(self, problem: View | ProblemStatement, pool: Training | Pool) -> None:
        """Interpolate the solvable tasks of a pool; nothing is evaluated."""
        self.problem = problem
        kept = pool.solvable
        points = task_points(problem, pool.tasks[kept])
        places = (pool.designs[kept] - problem.low) / (problem.high - problem.low)
        constraints = pool.constraints[kept]
        active = constraints > -ACTIVE
        limits = np.c_[active, places < ACTIVE, places > 1.0 - ACTIVE]
        self.parts = [
            Part(
                active=active[rows[0]],
                designs=Cubic.through(points[rows], places[rows]),
                constraints=Cubic.through(points[rows], np.clip(constraints[rows], -1.0, 1.0)),
            )
            for rows in _parted(limits, least=2 * (points.shape[1] + 1))
        ]

    @classmethod
    def of_tensors(cls, problem: View | ProblemStatement, tensors: Mapping[str, Any]) -> Self:
        """Return the interpolation of what ``tensors()`` returned.

        Raises:
            ValueError: in one sentence, for arrays that are missing or don't fit the problem.
        """
        m = sum(variable.drawn for variable in problem.task_variables)
        d, c = len(problem.low), len(problem.constraint_names)
        made = cls.__new__(cls)
        made.problem = problem
        made.parts = []
        while (at := f"starts.{len(made.parts)}.") + "points" in tensors:
            n = len(tensors[at + "points"])
            kinds = ("b", *["f"] * 5)
            shapes = ((c,), (n, m), (m,), (n + 1 + m, d), (m,), (n + 1 + m, c))
            names = [at + name for name in PART]
            check_arrays(tensors, dict(zip(names, zip(kinds, shapes, strict=True), strict=True)))
            part = {name: tensors[at + name] for name in PART}
            made.parts.append(
                Part(
                    part["active"],
                    Cubic(part["points"], part["designs.stretch"], part["designs.weights"]),
                    Cubic(part["points"], part["constraints.stretch"], part["constraints.weights"]),
                )
            )
        if not made.parts:
            raise ValueError("it lacks starts.0.points")
        return made

    def tensors(self) -> dict[str, Any]:
        """Return all arrays by name, for a file."""
        return {
            f"starts.{i}.{name}": array
            for i, part in enumerate(self.parts)
            for name, array in zip(
                PART,
                (
                    part.active, part.designs.points,
                    part.designs.stretch, part.designs.weights,
                    part.constraints.stretch, part.constraints.weights,
                ),
                strict=True,
            )
        }  # fmt: skip

    def designs(self, tasks: FloatArray) -> FloatArray:
        """Return the designs (n, d) for packed tasks (n, m), clipped to the box."""
        points = task_points(self.problem, tasks)
        places = np.array([part.designs(points) for part in self.parts])
        return self.in_box(places[self.doubts(points).argmin(axis=0), np.arange(len(tasks))])

    def doubts(self, points: FloatArray) -> FloatArray:
        """Return how doubtful each part (p, n) is at points (n, k) of the space of the tasks."""
        return np.array([_doubt(part, points, part.designs(points)) for part in self.parts])

    def in_box(self, places: FloatArray) -> FloatArray:
        """Return the designs (n, d) at places (n, d) of the unit cube, clipped to the box."""
        low, high = self.problem.low, self.problem.high
        return np.clip(low + (high - low) * places, low, high)


class Between:
    """Designs to start at: between the optima of a pool's tasks.

    A task of the pool gets the design that is interpolated from the seven eighths of the others, so
    that it learns nothing from its own optimum; any other task the one from them all.
    """

    def __init__(self, problem: ProblemStatement, pool: Pool) -> None:
        """Keep the solvable tasks of a pool; interpolations are made when they are needed.

        Raises:
            ValueError: if there are too few.
        """
        check_size(problem, pool)
        self.problem, self.pool = problem, pool.only(pool.solvable)

    @cached_property
    def whole(self) -> Interpolation:
        """The interpolation from all tasks."""
        return Interpolation(self.problem, self.pool)

    def designs(self, tasks: FloatArray) -> FloatArray:
        """Return the designs (n, d) for packed tasks (n, m), clipped to the box."""
        rows = [self._rows.get(task.tobytes(), -1) for task in tasks]
        known = np.array([row >= 0 for row in rows])
        designs = np.empty((len(tasks), len(self.problem.low)))
        if known.any():
            designs[known] = self._own[[row for row in rows if row >= 0]]
        if not known.all():
            designs[~known] = self.whole.designs(tasks[~known])
        return designs

    @cached_property
    def _rows(self) -> dict[bytes, int]:
        return {task.tobytes(): row for row, task in enumerate(self.pool.tasks)}

    @cached_property
    def _own(self) -> FloatArray:
        """The designs (n, d) of the pool's own tasks, once a process."""
        pool = self.pool
        content = (pool.hash.encode(), pool.tasks.tobytes(), pool.designs.tobytes())
        key = sha256(b"".join(content)).digest()
        if key not in _folded:
            fold = np.arange(len(pool)) % FOLDS
            _folded[key] = np.empty_like(pool.designs)
            for k in range(FOLDS):
                others = Interpolation(self.problem, pool.only(fold != k))
                _folded[key][fold == k] = others.designs(pool.tasks[fold == k])
        return _folded[key]


_folded: dict[bytes, FloatArray] = {}


def stretch(points: FloatArray, values: FloatArray) -> FloatArray:
    """Return by what to multiply each coordinate (m,) of points (n, m) with values (n, k).

    By how strongly the values react to it, so that points count as near if their values are.
    """
    slopes = np.linalg.lstsq(np.c_[np.ones(len(points)), points], values)[0][1:]
    size = np.linalg.norm(slopes, axis=1)
    return np.maximum(size / max(size.max(), TINY), LEAST_STRETCH)


def task_points(problem: View | ProblemStatement, tasks: FloatArray) -> FloatArray:
    """Return the fields that are drawn (n, k) of packed tasks: the Family's range to +-0.6.

    Unlike in an observation the scale has no bend at the ends of the range: what is smooth in the
    task stays smooth beyond it.
    """
    drawn = np.array([variable.drawn for variable in problem.task_variables])
    edges = [(v.low, v.high) for v in problem.task_variables if v.drawn]
    low, high = np.array(edges).reshape(-1, 2).T
    points: FloatArray = FAMILY_EDGE * (2.0 * (tasks[:, drawn] - low) / (high - low) - 1.0)
    return points


def _parted(limits: BoolArray, least: int) -> Iterator[npt.NDArray[np.intp]]:
    """Yield the rows of each pattern (n, limits) that at least so many share, the largest first."""
    _, pattern, counts = np.unique(limits, axis=0, return_inverse=True, return_counts=True)
    order = [at for at in np.argsort(-counts) if counts[at] >= least]
    if not order:
        yield np.arange(len(limits))
    for at in order:
        yield np.flatnonzero(pattern == at)


def _doubt(part: Part, points: FloatArray, places: FloatArray) -> FloatArray:
    """Return how doubtful a part is for each task (n,): its predicted violation, its distance."""
    constraints = part.constraints(points)[:, ~part.active]
    bounds = np.maximum(-places, places - 1.0)
    broken = np.maximum(0.0, np.c_[constraints, bounds].max(axis=1))
    return broken + DISTANCE * part.designs.distance(points)


def _cubes(points: FloatArray, nodes: FloatArray) -> FloatArray:
    squares = (points**2).sum(axis=1)[:, None] + (nodes**2).sum(axis=1) - 2.0 * points @ nodes.T
    return np.maximum(squares, 0.0) ** 1.5
