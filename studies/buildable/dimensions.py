"""The dimensions that a shop builds of a problem's designs, and the way back to variables."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import Task
from pkm_gym.core.types import BoolArray, FloatArray

BUILT = ("m", "rad")  # units of what a shop builds
EDGE = 1e-9  # of the range: what is so far outside is on the edge
SAME = 1e-9  # a task field that dimensions settle, and one that was asked for


class Dimensions:
    """Coordinates (k,) of a problem's designs in which it is built: lengths, angles, the rest.

    They are the derived lengths and angles that can be given in place of variables, and the
    variables that those don't settle. Where the dimensions settle fields of the task, too (the size
    of a machine whose variables are ratios), each point has a task of its own; a field that is a
    share of such a size stays that share.

    Args:
        problem: whose designs they are of; what it holds or lets follow is a coordinate, too.
        design: array (d,), about which they are.

    Attributes:
        problem: the same with every variable free.
        full: array (all variables,), the complete design.
        names: of the coordinates.
        units: of each, by name.
        settled: the task fields that the dimensions settle, by name, as they are asked for.
        following: the coordinates that equal another one of the given problem's, by its name.
        searched: the names of those that the given problem searches.

    Raises:
        ValueError: for a design that makes no machine.
    """

    def __init__(self, problem: DesignProblem, design: FloatArray) -> None:
        self.problem = opened(problem)
        self.full = problem.complete(np.asarray(design, dtype=float)[None])[0]
        self.problem.mechanism(self.full)
        derived = self.problem.derived(self.full)
        lengths = {name: value for name, (value, unit) in derived.items() if unit in BUILT}
        values, changes = self.problem.from_dimensions(lengths, self.problem.task)
        self._derived = tuple(lengths)
        self._plain = tuple(n for n in self.problem.variable_names if n not in values)
        self.names = (*self._derived, *self._plain)
        self.units = {name: self.problem.unit(name) for name in self._plain}
        self.units |= {name: derived[name].unit for name in self._derived}
        self.following = problem.following
        self.searched = {*self._derived, *problem.variable_names}.intersection(self.names)
        self.settled = {name: float(getattr(self.problem.task, name)) for name in changes}

    def of(self, full: FloatArray) -> FloatArray:
        """Return the coordinates (k,) of a complete design.

        Raises:
            ValueError: for one that makes no machine.
        """
        self.problem.mechanism(full)
        known = {name: value for name, (value, _) in self.problem.derived(full).items()}
        known = self.problem.named(full) | known
        return np.array([known[name] for name in self.names])

    def designs(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the complete designs (n, all variables) of points (n, k), and their tasks (n, m).

        A row is NaN where the coordinates make no design, and so is its design where they settle
        what no task may be.
        """
        tasks = np.repeat(self.problem.pack(None)[None], len(points), axis=0)
        if not self._derived:
            return np.asarray(points), tasks
        designs = np.full((len(points), len(self.problem.variables)), np.nan)
        columns = {name: i for i, name in enumerate(self.problem.variable_names)}
        fields = {name: i for i, name in enumerate(self.problem.task_type.names())}
        for row, point in enumerate(points.tolist()):
            split = len(self._derived)
            given = dict(zip(self._derived, point[:split], strict=True))
            try:
                values, changes = self.problem.from_dimensions(given, self.problem.task)
            except ValueError:
                continue
            others = zip(self._plain, point[split:], strict=True)
            for name, value in (*values.items(), *others):
                designs[row, columns[name]] = value
            for name, value in changes.items():
                asked = self.settled[name]
                same = abs(value - asked) <= SAME * abs(asked)
                tasks[row, fields[name]] = asked if same else value
        return _legal(self.problem, designs, tasks)

    def box(self) -> tuple[FloatArray, FloatArray]:
        """Return the search bounds (all variables,), widened where the design lies outside."""
        span = self.problem.high - self.problem.low
        low, high = (
            np.minimum(self.problem.low, self.full),
            np.maximum(self.problem.high, self.full),
        )
        return low - EDGE * span, high + EDGE * span

    def followed(self, points: FloatArray) -> FloatArray:
        """Return points (n, k) in which what follows another coordinate equals it."""
        points = points.copy()
        for name, source in self.following.items():
            points[:, self.names.index(name)] = points[:, self.names.index(source)]
        return points

    def evaluate(self, points: FloatArray) -> Evaluation:
        """Evaluate points (n, k) in one compiled call."""
        return self.problem.evaluate(*self.designs(points))

    def one(self, point: FloatArray) -> Evaluation:
        """Evaluate a point (k,) as a design of its own problem, with the task that it settles."""
        designs, tasks = self.designs(np.asarray(point)[None])
        return self.problem.with_task(self.problem.unpack(tasks[0])).evaluate(designs)


def opened(problem: DesignProblem) -> DesignProblem:
    """Return the same problem with every variable free, within the bounds that it has."""
    return type(problem)(
        task=problem.task,
        objective=[objective.name for objective in problem.objectives],
        free="all",
        bounds={v.name: (v.low, v.high) for v in problem.variables},
        **asdict(problem.options),
    )


def _legal(
    problem: DesignProblem, designs: FloatArray, tasks: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the same with no design where the task isn't legal, and the asked task there."""
    low, high = np.array([(v.legal_low, v.legal_high) for v in problem.task_variables]).T
    bad: BoolArray = ~((tasks >= low) & (tasks <= high)).all(axis=1)
    designs[bad], tasks[bad] = np.nan, problem.pack(None)
    return designs, tasks


def settled_by(problem: DesignProblem, task: Task) -> dict[str, tuple[float, float]]:
    """Return the task fields that differ from the problem's: name -> asked for, as built."""
    names = problem.task_type.names()
    pairs = {name: (getattr(problem.task, name), getattr(task, name)) for name in names}
    return {name: pair for name, pair in pairs.items() if pair[0] != pair[1]}
