"""Evaluation: what a problem says of n designs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pkm_gym.core import merit
from pkm_gym.core.explain import sentences
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
        defined: array (n, c), False where a constraint has no value of its own because the design
            is out of reach or makes no machine: it counts as 1 + that violation then.
        unreached: array (n,), by how much the workspace is out of reach, so that the indices are
            undefined; 0 where it is within.
        feasible: array (n,), every constraint <= 0.
        log_merit: array (n,), at most 7; see ``pkm_gym.core.merit``.
    """

    __slots__ = (
        "_table",
        "constraints",
        "defined",
        "designs",
        "feasible",
        "log_merit",
        "problem",
        "tasks",
        "unreached",
    )

    def __init__(
        self,
        problem: DesignProblem,
        designs: FloatArray,
        tasks: FloatArray,
        table: FloatArray,
        constraints: FloatArray,
        defined: BoolArray,
        unreached: FloatArray,
        feasible: BoolArray,
        log_merit: FloatArray,
    ) -> None:
        self.problem = problem
        self.designs = designs
        self.tasks = tasks
        self.constraints = constraints
        self.defined = defined
        self.unreached = unreached
        self.feasible = feasible
        self.log_merit = log_merit
        self._table = table

    def __len__(self) -> int:
        """Return the number of designs."""
        return len(self.designs)

    @property
    def indices(self) -> Mapping[str, FloatArray]:
        """Name -> array (n,)."""
        columns = self._table.T[self.problem.reported]
        return dict(zip(self.problem.index_names, columns, strict=True))

    def quantity(self, name: str) -> FloatArray:
        """Return an index, reported or not, or a variable, of each design: array (n,)."""
        indices = [index.name for index in self.problem.declared.index_table]
        if name in indices:
            return self._table[:, indices.index(name)]
        variables = [variable.name for variable in self.problem.all_variables]
        return self.problem.complete(self.designs)[:, variables.index(name)]

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

    def told(
        self, values: FloatArray, constraints: FloatArray, log_merit: FloatArray
    ) -> Evaluation:
        """Return the same with another first objective (n,), constraints (n, c), merit (n,)."""
        table = self._table.copy()
        table[:, self.problem.objective_columns[0]] = values
        feasible = np.asarray((constraints <= 0.0).all(axis=1))
        return Evaluation(
            self.problem, self.designs, self.tasks, table, constraints, self.defined,
            self.unreached, feasible, log_merit,
        )  # fmt: skip

    def standing_for(
        self, problem: DesignProblem, designs: FloatArray, rows: npt.NDArray[np.intp]
    ) -> Evaluation:
        """Return rows (n,) of it as what a problem says of designs (n, d) of its own task."""
        return Evaluation(
            problem, designs, problem.pack(None)[None], self._table[rows], self.constraints[rows],
            self.defined[rows], self.unreached[rows], self.feasible[rows], self.log_merit[rows],
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: Sequence[Evaluation]) -> Evaluation:
        """Return evaluations of one problem and one task as one, in their order."""
        first = parts[0]
        rows = (
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("_table", "constraints", "defined", "unreached", "feasible", "log_merit")
        )
        designs = np.concatenate([part.designs for part in parts])
        return cls(first.problem, designs, first.tasks, *rows)

    @classmethod
    def remembered(
        cls,
        problem: DesignProblem,
        designs: FloatArray,
        task: FloatArray,
        values: FloatArray,
        constraints: FloatArray,
        log_merit: FloatArray,
    ) -> Evaluation:
        """Return what is remembered of designs (n, d): no more than the first objective is kept."""
        n = len(designs)
        table = np.full((n, len(problem.declared.index_table)), np.nan)
        blank = cls(
            problem, designs, task[None], table, constraints, np.ones(constraints.shape, np.bool_),
            np.zeros(n), np.zeros(n, np.bool_), log_merit,
        )  # fmt: skip
        return blank.told(values, constraints, log_merit)

    def task(self, i: int) -> Task:
        """Return the task of design i."""
        return self.problem.unpack(self.tasks[i if len(self.tasks) > 1 else 0])

    def best(self) -> int:
        """Return the index of the answer: see ``pkm_gym.core.merit.answer``."""
        return merit.answer(*self._ranked)

    def ranking(self) -> npt.NDArray[np.intp]:
        """Return the order (n,) of the designs, the answer first."""
        return merit.ranking(*self._ranked)

    def beats(self, i: int, other: Evaluation, j: int) -> bool:
        """Return whether design i is a better answer than design j of another evaluation."""
        *ours, sign = self._ranked
        theirs = other._ranked[:-1]
        values, feasible, log_merit = (
            np.array([b[j], a[i]]) for a, b in zip(ours, theirs, strict=True)
        )
        return merit.answer(values, feasible, log_merit, sign) == 1

    @property
    def _ranked(self) -> tuple[FloatArray, BoolArray, FloatArray, float]:
        sign = self.problem.objectives[0].sign
        return self.objectives[:, 0], self.feasible, self.log_merit, sign

    def explain(self, i: int) -> str:
        """Say in words which limits design i breaks, where in the workspace and by how much."""
        if not -len(self) <= i < len(self):
            raise IndexError(f"there is no design {i}: {len(self)} were evaluated")
        i %= len(self)
        return "\n".join(sentences(self, i)) or "feasible: every limit holds"
