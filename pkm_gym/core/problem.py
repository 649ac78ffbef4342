"""DesignProblem: a vector of dimensions in, indices out. Everything else is its client."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from pkm_gym.core import merit
from pkm_gym.core.arguments import checked_designs, packed_tasks
from pkm_gym.core.dimensions import SMALLEST, dimensions_violation, no_machine
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.limit import Limit
from pkm_gym.core.mechanism import IndexMap, Mechanism
from pkm_gym.core.rows import Dimension, Measured
from pkm_gym.core.statement import ProblemStatement
from pkm_gym.core.tally import TALLY
from pkm_gym.core.task import Task, TaskLike
from pkm_gym.core.trial import TrialObjective
from pkm_gym.core.types import BoolArray, FloatArray


class DesignProblem(ProblemStatement, ABC):
    """A design problem of one mechanism: what is declared, and the kernel that measures.

    Args:
        task: a Task, or a mapping of the fields that differ from the paper's.
        objective: the name of an objective, or several; the first is the one merit uses.
        free: names of the variables that are searched, or "all"; the others stay at their default.
        fixed: variable -> value, taken out of the search.
        bounds: variable -> (low, high), other search bounds.
        options: what the mechanism offers (presets, sampling): see its page.

    Raises:
        ValueError: for an unknown name, with its closest match, or an illegal value.
    """

    drive_option: ClassVar[str] = ""  # that says what motor and gear add to a drive's inertia

    # What a mechanism supplies ------------------------------------------------------------------

    @abstractmethod
    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        """Measure complete designs (n, all variables) for tasks (n, m) or (1, m), never raising.

        Fills ``rows``; its ``scales`` already hold ``self.scale``, for a kernel that knows better.
        """

    @abstractmethod
    def _mechanism(self, design: FloatArray, task: Any) -> Mechanism:
        """Return the mechanism of a complete design."""

    @abstractmethod
    def explain_own(self, design: FloatArray, task: Any, broken: list[str]) -> list[str]:
        """Say in words, a line each, which of the mechanism's own limits a complete design breaks.

        Where and by how much; ``broken`` names those that are, ``dimensions`` never among them.
        """

    def sizes(self, design: FloatArray) -> dict[str, float]:
        """Return what of a complete design must lie in the range of machines, by name.

        All of one unit, m or none; see ``pkm_gym.core.dimensions``.
        """
        return {v.name: float(x) for v, x in zip(self.all_variables, design, strict=True)}

    def from_dimensions(
        self, dimensions: Mapping[str, float], task: Any
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Turn dimensions (SI) into values of variables and changed task fields."""
        del task
        return dict(dimensions), {}

    def cycle(self, task: Any) -> dict[str, Dimension]:
        """Return what a task's cycle is that dynamic indices are over, by name; {} for none."""
        del task
        return {}

    def index_maps(self, machine: Mechanism, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices of a machine at poses (..., k), by the design's index."""
        return machine.index_maps(pose)

    def one_of_alike(self, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        """Return, for feasible designs (n, d) of tasks (n, m), the one to be kept of those alike.

        Where many designs measure the same, so that an optimum is a function of its task.
        """
        del tasks
        return designs

    def pieces(self, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        """Return what a descent works on, of designs (n, d): rows (n, 1 + p), all finite.

        First the log objective, smaller is better, then by how much limits are broken, > 0 where
        they are: those of ``evaluate``, or taken apart so that each is smooth. See ``descent``.
        """
        evaluation = self.evaluate(designs, tasks)
        first, values = self.objectives[0], evaluation.objectives[:, 0]
        with np.errstate(invalid="ignore", divide="ignore"):
            log = first.sign * np.log(first.offset + values)
        log = np.where(np.isfinite(log), log, merit.CAP)
        return np.column_stack([log, evaluation.constraints + merit.TOLERANCE])

    def _grid(self) -> FloatArray | None:
        """Return a grid of complete designs, or None where the paper has neither values nor ranges.

        With the paper's values of those variables that are declared ``scanned``, steps of ours in
        the others.
        """
        return None

    def atlas_columns(
        self, evaluation: Evaluation
    ) -> dict[str, tuple[FloatArray | BoolArray, str]]:
        """Return what an atlas holds beside the indices: name -> values (n,) and what they are."""
        del evaluation
        return {}

    # What everyone calls --------------------------------------------------------------------------

    def evaluate(self, designs: FloatArray, tasks: Task | FloatArray | None = None) -> Evaluation:
        """Evaluate designs (n, d) for one task, or for packed tasks (n, m), in one compiled call.

        A row that makes no machine (NaN, infinite, zero, negative, huge) is answered like any
        other: its constraint ``dimensions`` is > 0 and its merit is finite.

        Raises:
            ValueError: for a wrong shape or type, or a task outside the legal range.
        """
        designs = checked_designs(designs, self.variables)
        full, n = self.complete(designs), len(designs)
        TALLY.designs += n
        row = self._task_row
        tasks = row if tasks is None else packed_tasks(tasks, self.task_type, (n, row.shape[1]))
        rows = Measured(
            np.empty((n, len(self.declared.index_table))),
            np.empty((n, len(self.declared.own_limits))),
            np.empty(n),
            np.empty(n),
        )
        rows.scales.fill(self.scale)
        self._measure(full, tasks, rows)
        constraints = np.empty((n, len(self._limits)))
        defined = np.empty(constraints.shape, dtype=np.bool_)
        log_merit, feasible = np.empty(n), np.empty(n, dtype=np.bool_)
        first = self.objectives[0]
        merit.judge(
            0.06 * n, full, tasks, *rows, self._powers, self._rates, self._limits,
            self.objective_columns[0], first.sign, first.offset, self.penalty_weight,
            constraints, defined, log_merit, feasible,
        )  # fmt: skip
        return Evaluation(
            self, designs, tasks, rows.table, constraints, defined, rows.unreached, feasible,
            log_merit,
        )  # fmt: skip

    def mechanism(self, design: FloatArray, task: TaskLike = None) -> Mechanism:
        """Return the machine of a design (d,).

        Raises:
            ValueError: for a wrong shape, or for dimensions that make no machine.
        """
        full = self._complete_one(design)
        sizes, unit = self._sizes(full)
        if dimensions_violation(tuple(sizes.values()), SMALLEST if unit else 1.0) > 0.0:
            raise ValueError(no_machine(sizes, unit))
        return self._mechanism(full, self._task(task))

    def explain_dimensions(self, design: FloatArray) -> str:
        """Say in words that a complete design makes no machine, and what is allowed."""
        return f"dimensions: {no_machine(*self._sizes(design))}"

    def derived(self, design: FloatArray, task: TaskLike = None) -> dict[str, Dimension]:
        """Return the derived dimensions of a design (d,), by name; none if it makes no machine."""
        if not self.declared.dimensions:
            return {}
        try:
            machine = self.mechanism(design, task)
        except ValueError:
            return {}
        return {
            name: Dimension(float(getattr(machine, name)), unit)
            for name, unit in self.derived_units.items()
        }

    @cached_property
    def derived_units(self) -> dict[str, str]:
        """Units of the derived dimensions, by name."""
        if not self.declared.dimensions:
            return {}
        units = self._mechanism(self.space.defaults(), self.task).units()
        return {name: units.get(name, "") for name in self.declared.dimensions}

    def local_violations(
        self, machine: Mechanism, pose: FloatArray, task: Task
    ) -> dict[str, FloatArray]:
        """Return by how much poses (..., k) break a limit, by constraint: > 0 where broken.

        Of the limits whose index is the extreme of a local one; NaN out of reach.
        """
        maps = self.index_maps(machine, pose)
        return {
            limit.name: limit.violation(
                maps[limit.quantity].values, task, self.unit(limit.quantity)
            )
            for limit in self.limits
            if isinstance(limit, Limit)
            and limit.quantity in maps
            and maps[limit.quantity].kind != "mean"
        }

    def drawn_maps(self, machine: Mechanism, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., k) that pictures show: reported ones."""
        maps = self.index_maps(machine, pose)
        return {name: maps[name] for name in maps if maps[name].drawn and name in self.index_names}

    def grid(self) -> FloatArray | None:
        """Return the problem's own grid (n, d) within the bounds, or None without one.

        It is the paper's if all its variables are ``scanned``; the steps of the others are ours.
        """
        full = self._grid()
        return None if full is None else self.space.within(full)

    def objective_for(self, task: TaskLike = None) -> TrialObjective:
        """Return a plain callable of an Optuna trial: its value(s), constraints and indices."""
        return TrialObjective(self, self._task(task))

    def _sizes(self, design: FloatArray) -> tuple[dict[str, float], str]:
        sizes = self.sizes(design)
        return sizes, self._units.get(next(iter(sizes)), "")
