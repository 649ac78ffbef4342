"""A problem that answers for machines built with errors: what a robust search searches."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from pkm_gym.core.arguments import checked_designs, packed_tasks
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import TaskLike
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.core.units import show
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.errors import normal, power_of, sobol_points
from pkm_gym.studies.buildable.tolerance import check_share

MACHINES = 64  # of each design


@dataclass(frozen=True)
class Errors:
    """How the machines of a design are built.

    Attributes:
        share: of the machines, of which all that is told holds.
        sigma: dimension -> standard deviation of its error, SI.
        units: of those dimensions, SI.
        machines: how many a design stands for.
        seed: of the Sobol points.
    """

    share: float
    sigma: dict[str, float]
    units: dict[str, str]
    machines: int
    seed: int

    @property
    def words(self) -> str:
        """What distinguishes it from others."""
        sizes = ", ".join(f"{name} {show(x, self.units[name])}" for name, x in self.sigma.items())
        more = f"{self.machines} machines a design, seed {self.seed}"
        return f"{self.share:g} with sigma of {sizes}, {more}"


class RobustProblem(DesignProblem):
    """A problem that answers for a share of the machines that are built of a design.

    Its objective is the quantile over those that hold every limit: no more (where it is minimised)
    of that share. Its constraints are those of one machine: the one that as large a share of them
    holds better, by its worst limit; so a design is feasible where the yield is that share.
    """

    errors: Errors | None = None
    _plain: DesignProblem
    _dimensions: Dimensions
    _offsets: FloatArray

    def evaluate(self, designs: FloatArray, tasks: Any = None) -> Evaluation:
        """Evaluate designs (n, d), each by its machines, for the problem's own task."""
        if self.errors is None:
            return super().evaluate(designs, tasks)
        designs = checked_designs(designs, self.variables)
        own, shape = self._task_row, (len(designs), self._task_row.shape[1])
        if tasks is not None and (packed_tasks(tasks, self.task_type, shape) != own).any():
            raise ValueError("a robust problem answers for its own task only: make another one")
        built = self._built(designs)
        n, count = len(designs), self.errors.machines
        order = np.argsort(built.constraints.max(axis=1).reshape(n, count), axis=1, kind="stable")
        chosen = order[:, math.ceil(self.errors.share * count) - 1] + count * np.arange(n)
        told = built.standing_for(self, designs, chosen)
        values = self._quantiles(built, n)
        values = np.where(np.isfinite(values), values, told.objectives[:, 0])
        first = self.objectives[0]
        with np.errstate(invalid="ignore", divide="ignore"):
            logs = np.log(first.offset + values) - np.log(first.offset + told.objectives[:, 0])
        worse = np.where(np.isfinite(logs) & (told.unreached <= 0.0), first.sign * logs, 0.0)
        return told.told(values, told.constraints, told.log_merit + worse)

    def pieces(self, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        """Return the log objective and what limits are broken by, as ``evaluate`` tells them."""
        return DesignProblem.pieces(self, designs, tasks)

    def with_task(self, task: TaskLike, **options: Any) -> Any:
        """Return the same with another task, and other options if any are given."""
        if self.errors is None:
            return super().with_task(task, **options)
        own = self.errors
        other = self._plain.with_task(task, **options)
        return robust(other, own.sigma, own.share, machines=own.machines, seed=own.seed)

    def yields(self, designs: FloatArray) -> FloatArray:
        """Return the share of the machines of designs (n, d) that hold every limit: array (n,)."""
        assert self.errors is not None
        feasible: BoolArray = self._built(designs).feasible.reshape(-1, self.errors.machines)
        return np.asarray(feasible.mean(axis=1))

    def hash(self) -> str:
        """Return the problem's hash, of the errors, too."""
        own = super().hash()
        if self.errors is None:
            return own
        return hashlib.sha256(f"{own} {self.errors!r}".encode()).hexdigest()

    def _built(self, designs: FloatArray) -> Evaluation:
        """Return what is said of all machines (n machines,) of designs (n, d)."""
        points = np.stack([self._point(full) for full in self.complete(designs)])
        machines = points[:, None] + self._offsets
        return self._dimensions.evaluate(machines.reshape(-1, machines.shape[2]))

    def _point(self, full: FloatArray) -> FloatArray:
        try:
            return self._dimensions.of(full)
        except ValueError:  # it makes no machine
            return np.full(len(self._dimensions.names), np.nan)

    def _quantiles(self, built: Evaluation, n: int) -> FloatArray:
        """Return the objective (n,) that a share of the machines that hold every limit keeps."""
        assert self.errors is not None
        sign = self.objectives[0].sign
        values = np.where(built.feasible, sign * built.objectives[:, 0], np.inf).reshape(n, -1)
        values.sort(axis=1)
        held = np.isfinite(values).sum(axis=1)
        at = np.maximum(np.ceil(self.errors.share * held).astype(int) - 1, 0)
        return np.asarray(sign * values[np.arange(n), at])


def robust(
    problem: DesignProblem,
    sigma: Mapping[str, float],
    share: float,
    *,
    machines: int = MACHINES,
    seed: int = 0,
) -> RobustProblem:
    """Return a problem that answers for a share of the machines built with normal errors.

    Args:
        problem: the problem, of one objective, with its task.
        sigma: dimension -> standard deviation, SI; see ``Dimensions``.
        share: of the machines, such as 0.9.
        machines: of each design, a power of two: the same errors for all designs.
        seed: of the scrambled Sobol points.

    Raises:
        ValueError: in one sentence, for what is not allowed.
    """
    check_share("--robust", share)
    if len(problem.objectives) > 1:
        raise ValueError("a robust search has one objective: leave the others out")
    dimensions = Dimensions(problem, problem.printed_design())
    check_known("dimension", sigma, dimensions.names)
    names = [name for name in dimensions.names if name in sigma]
    if not names:
        raise ValueError("a robust search needs --sigma: --sigma 0.1mm, or --sigma l1=0.1mm")
    offsets = np.zeros((machines, len(dimensions.names)))
    columns = [dimensions.names.index(name) for name in names]
    errors = normal(sobol_points(power_of(machines), len(names), seed))
    offsets[:, columns] = errors * np.array([sigma[name] for name in names])
    units = {name: dimensions.units[name] for name in names}
    made: Any = copy(problem)
    made.__class__ = type("RobustProblem", (RobustProblem, type(problem)), {"__module__": __name__})
    made.errors = Errors(share, {name: sigma[name] for name in names}, units, machines, seed)
    made._plain, made._dimensions, made._offsets = problem, dimensions, offsets
    answer: RobustProblem = made
    return answer


def words_of(problem: DesignProblem) -> str | None:
    """Return what distinguishes a robust problem from others, None of any other problem."""
    errors = problem.errors if isinstance(problem, RobustProblem) else None
    return errors.words if errors else None
