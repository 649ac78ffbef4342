"""Evaluation: what a problem says of n designs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pkm_gym.core import merit
from pkm_gym.core.types import BoolArray, FloatArray

if TYPE_CHECKING:
    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.task import Task


class Evaluation:
    """Indices, objectives, constraints and merit of n designs.

    Attributes:
        problem: the problem that was asked.
        designs: array (n, d).
        tasks: array (n, m) or (1, m), one packed task a row.
        indices: name -> array (n,), SI units; NaN only where the mathematics is undefined.
        objectives: array (n, k).
        constraints: array (n, c), feasible when <= 0, always finite.
        feasible: array (n,), every constraint <= 0.
        log_merit: array (n,), at most 7; see ``pkm_gym.core.merit``.
    """

    __slots__ = (
        "_table",
        "constraints",
        "designs",
        "feasible",
        "log_merit",
        "problem",
        "tasks",
    )

    def __init__(
        self,
        problem: DesignProblem,
        designs: FloatArray,
        tasks: FloatArray,
        table: FloatArray,
        constraints: FloatArray,
        feasible: BoolArray,
        log_merit: FloatArray,
    ) -> None:
        self.problem = problem
        self.designs = designs
        self.tasks = tasks
        self.constraints = constraints
        self.feasible = feasible
        self.log_merit = log_merit
        self._table = table

    def __len__(self) -> int:
        """Return the number of designs."""
        return len(self.designs)

    @property
    def indices(self) -> Mapping[str, FloatArray]:
        """Name -> array (n,)."""
        return dict(zip(self.problem.index_names, self._table.T, strict=True))

    @property
    def objectives(self) -> FloatArray:
        """Array (n, k), the objectives in the problem's order."""
        return self._table[:, self.problem.objective_columns]

    @property
    def merit(self) -> FloatArray:
        """Array (n,), finite and positive, smaller is better."""
        return np.exp(self.log_merit)

    @property
    def notes(self) -> tuple[str, ...]:
        """Standing warnings that hold for every design of the problem."""
        return self.problem.notes

    def task(self, i: int) -> Task:
        """Return the task of design i."""
        return self.problem.unpack(self.tasks[i if len(self.tasks) > 1 else 0])

    def best(self) -> int:
        """Return the index of the answer: see ``pkm_gym.core.merit.answer``."""
        return merit.answer(*self._ranked)

    def ranking(self) -> npt.NDArray[np.intp]:
        """Return the order (n,) of the designs, the answer first."""
        return merit.ranking(*self._ranked)

    @property
    def _ranked(self) -> tuple[FloatArray, BoolArray, FloatArray, float]:
        sign = self.problem.objectives[0].sign
        return self.objectives[:, 0], self.feasible, self.log_merit, sign

    def explain(self, i: int) -> str:
        """Say in words which limits design i breaks, where in the workspace and by how much."""
        if not -len(self) <= i < len(self):
            raise IndexError(f"there is no design {i}: {len(self)} were evaluated")
        i %= len(self)
        names = self.problem.constraint_names
        broken = [name for name, value in zip(names, self.constraints[i], strict=True) if value > 0]
        if not broken:
            return "feasible: every limit holds"
        return "\n".join(self.problem.explain_limits(self.designs[i], self.task(i), broken))
