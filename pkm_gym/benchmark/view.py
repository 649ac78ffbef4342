"""View and Told: all that a method sees of a problem and of an evaluation, numbers and names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np

from pkm_gym.core.declaration import Objective
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import TaskVariable, Variable
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.mechanisms import lasting

Array = TypeVar("Array", FloatArray, BoolArray)


@dataclass(frozen=True)
class View:
    """What a method is told of a design problem: nothing in it evaluates a design.

    Attributes:
        problem: its name, or "module:Class" of one from outside.
        variables: of a design, with their search bounds and units.
        task_variables: the fields of a task, with their ranges and units.
        constraint_names: in the order of ``Told.constraints``.
        objective: that is optimised, with its direction.
        sides: field of a task -> "upper" or "lower", for those that are the bound of a limit.
        low: array (d,), the search bounds.
        high: array (d,), the search bounds.
    """

    problem: str
    variables: tuple[Variable, ...]
    task_variables: tuple[TaskVariable, ...]
    constraint_names: tuple[str, ...]
    objective: Objective
    sides: Mapping[str, str]
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, problem: DesignProblem) -> Self:
        """Return the view of a problem."""
        sides = {v.name: problem.declared.side_of(v.name) for v in problem.task_variables}
        return cls(
            lasting(problem),
            tuple(problem.variables),
            tuple(problem.task_variables),
            tuple(problem.constraint_names),
            problem.objectives[0],
            {name: side for name, side in sides.items() if side},
            fixed(problem.low),
            fixed(problem.high),
        )

    @property
    def variable_names(self) -> tuple[str, ...]:
        """The names of the variables."""
        return tuple(variable.name for variable in self.variables)

    @property
    def task_names(self) -> tuple[str, ...]:
        """The names of a task's fields, in the order of a packed task."""
        return tuple(variable.name for variable in self.task_variables)


@dataclass(frozen=True)
class Told:
    """What an evaluation of n designs tells.

    Attributes:
        designs: array (n, d), that were evaluated.
        values: array (n,), the objective, NaN where undefined.
        constraints: array (n, c), feasible when <= 0.
        log_merit: array (n,), see ``pkm_gym.core.merit``.
    """

    designs: FloatArray
    values: FloatArray
    constraints: FloatArray
    log_merit: FloatArray

    @classmethod
    def of(cls, evaluation: Evaluation) -> Self:
        """Return what an evaluation tells, as it is."""
        values = evaluation.objectives[:, 0]
        return cls(evaluation.designs, values, evaluation.constraints, evaluation.log_merit)

    def __len__(self) -> int:
        """Return the number of designs."""
        return len(self.designs)

    @property
    def feasible(self) -> BoolArray:
        """Array (n,), whether every constraint holds."""
        return np.asarray((self.constraints <= 0.0).all(axis=1))


def fixed(array: Array) -> Array:
    """Return a copy of an array that can't be written to."""
    copy = np.array(array)
    copy.flags.writeable = False
    return copy
