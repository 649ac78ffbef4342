"""DesignProblem: a vector of dimensions in, indices out. Everything else is its client."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import asdict, replace
from typing import Any, ClassVar, Self

import numpy as np

from pkm_gym.core import merit
from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.dimensions import SMALLEST, dimensions_violation, no_machine
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.limit import Limit, packed
from pkm_gym.core.mechanism import IndexMap, Mechanism
from pkm_gym.core.names import check_known
from pkm_gym.core.options import Options
from pkm_gym.core.reference import Reference
from pkm_gym.core.rows import Dimension, Index, Measured
from pkm_gym.core.space import Space
from pkm_gym.core.task import Task, TaskVariable, Variable
from pkm_gym.core.trial import TrialObjective
from pkm_gym.core.types import BoolArray, FloatArray

TaskLike = Task | Mapping[str, float] | None


class DesignProblem(ABC):
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

    declared: ClassVar[Declaration]
    name: ClassVar[str]
    title: ClassVar[str]
    task_type: ClassVar[type[Task]]
    options_type: ClassVar[type[Options]]
    all_variables: ClassVar[tuple[Variable, ...]]
    all_objectives: ClassVar[tuple[Objective, ...]]
    constraint_names: ClassVar[tuple[str, ...]]
    notes: ClassVar[tuple[str, ...]]
    scale: float  # of merit: the first objective at the task's optimum, but for the task's powers

    def __init_subclass__(cls, **more: Any) -> None:
        """Answer under short names with what is declared."""
        super().__init_subclass__(**more)
        if "declared" in vars(cls):
            said = cls.declared
            cls.name, cls.title, cls.notes = said.name, said.title, tuple(said.notes)
            cls.task_type, cls.options_type = said.task, said.options
            cls.all_variables, cls.all_objectives = said.variables, tuple(said.objectives)
            cls.constraint_names = said.constraint_names

    def __init__(
        self,
        *,
        task: TaskLike = None,
        objective: str | Iterable[str] | None = None,
        free: Iterable[str] | None = None,
        fixed: Mapping[str, float] | None = None,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        **options: Any,
    ) -> None:
        self.task = self.task_type.of(task)
        self.objectives = self._chosen_objectives(objective)
        self.options = self._chosen_options(options)
        self.space = Space.chosen(self.all_variables, self.reference.design, free, fixed, bounds)
        self.variables = self.space.searched
        self.index_table = tuple(item for item in self.declared.index_table if self._reports(item))
        self.index_names = tuple(index.name for index in self.index_table)
        table_names = [index.name for index in self.declared.index_table]
        self.reported = [table_names.index(name) for name in self.index_names]
        self.objective_columns = [table_names.index(o.name) for o in self.objectives]
        self.low = np.array([variable.low for variable in self.variables])
        self.high = np.array([variable.high for variable in self.variables])
        self._task_row = self.task.pack()[None, :]
        indices = {index.name: index.unit for index in self.declared.index_table}
        variables = {variable.name: variable.unit for variable in self.all_variables}
        self._units = variables | indices
        own = [limit.name for limit in self.declared.own_limits]
        fields = self.task_type.names()
        self._limits = packed(self.declared.constraints, own, indices, variables, fields)
        self.scale = self.objectives[0].scale
        self._powers, self._rates = (
            np.array([goes.get(name, 0.0) for name in fields])
            for goes in (self.objectives[0].powers, self.objectives[0].rates)
        )

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
        """Return the paper's grid of complete designs, or None where the paper has none."""
        return None

    def atlas_columns(
        self, evaluation: Evaluation
    ) -> dict[str, tuple[FloatArray | BoolArray, str]]:
        """Return what an atlas holds beside the indices: name -> values (n,) and what they are."""
        del evaluation
        return {}

    # What everyone calls --------------------------------------------------------------------------

    @property
    def reference(self) -> Reference:
        """The printed numbers, their verdicts and our verified values."""
        return Reference.load(self.declared.package, self.declared.reference)

    @property
    def task_variables(self) -> tuple[TaskVariable, ...]:
        """The fields of the Task with units and ranges."""
        return self.task_type.variables()

    @property
    def variable_names(self) -> tuple[str, ...]:
        """The names of the searched variables."""
        return tuple(variable.name for variable in self.variables)

    @property
    def fixed(self) -> dict[str, float]:
        """The variables that are fixed, with their values."""
        return dict(self.space.fixed)

    @property
    def following(self) -> dict[str, str]:
        """The variables that equal another one, by its name."""
        return dict(self.space.following)

    @property
    def directions(self) -> tuple[str, ...]:
        """Optuna's word for each objective's direction: "minimize" or "maximize"."""
        return tuple(objective.direction.replace("ise", "ize") for objective in self.objectives)

    def evaluate(self, designs: FloatArray, tasks: Task | FloatArray | None = None) -> Evaluation:
        """Evaluate designs (n, d) for one task, or for packed tasks (n, m), in one compiled call.

        A row that makes no machine (NaN, infinite, zero, negative, huge) is answered like any
        other: its constraint ``dimensions`` is > 0 and its merit is finite.

        Raises:
            ValueError: for a wrong shape or type, or a task outside the legal range.
        """
        designs = self._checked(designs)
        tasks = self._task_rows(tasks, len(designs))
        full, n = self.complete(designs), len(designs)
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
            self.objective_columns[0], first.sign, first.offset, self.declared.penalty_weight,
            constraints, defined, log_merit, feasible,
        )  # fmt: skip
        return Evaluation(
            self, designs, tasks, rows.table, constraints, defined, rows.unreached, feasible,
            log_merit,
        )  # fmt: skip

    def complete(self, designs: FloatArray) -> FloatArray:
        """Return designs (n, d) with the fixed variables put in: (n, all variables)."""
        return self.space.complete(designs)

    def reduced(self, full: FloatArray) -> FloatArray:
        """Return the searched columns (n, d) of complete designs (n, all variables)."""
        return self.space.reduced(full)

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

    def named(self, design: FloatArray) -> dict[str, float]:
        """Return all variables of a design (d,) by name, the fixed ones included."""
        full = self._complete_one(design)
        return {v.name: float(x) for v, x in zip(self.all_variables, full, strict=True)}

    def derived(self, design: FloatArray, task: TaskLike = None) -> dict[str, Dimension]:
        """Return the derived dimensions of a design (d,), by name."""
        if not self.declared.dimensions:
            return {}
        machine = self.mechanism(design, task)
        units = machine.units()
        return {
            name: Dimension(float(getattr(machine, name)), units.get(name, ""))
            for name in self.declared.dimensions
        }

    def design(self, values: Mapping[str, float]) -> FloatArray:
        """Return the design (d,) of named values; fixed variables may be left out.

        Raises:
            ValueError: for an unknown or missing name, or one that disagrees with a fixed value.
        """
        check_known("variable", values, [v.name for v in self.all_variables])
        for name, value in self.fixed.items():
            if not np.isclose(values.get(name, value), value, rtol=1e-12, atol=0.0):
                raise ValueError(f"{name} is fixed at {value:g}: {values[name]!r} disagrees")
        for name, source in self.following.items():
            if name in values and values[name] != values.get(source, self.fixed.get(source)):
                raise ValueError(f"{name} follows {source}: free it with free= to give its value")
        for name in self.variable_names:
            if name not in values:
                raise ValueError(f"the design lacks {name}: give {', '.join(self.variable_names)}")
        return np.array([float(values[name]) for name in self.variable_names])

    def printed_design(self) -> FloatArray:
        """Return the design (d,) that the paper prints; the default one where there is no paper."""
        return self.reduced(self.space.defaults()[None])[0]

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
            for limit in self.declared.constraints
            if isinstance(limit, Limit)
            and limit.quantity in maps
            and maps[limit.quantity].kind != "mean"
        }

    def drawn_maps(self, machine: Mechanism, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., k) that pictures show: reported ones."""
        maps = self.index_maps(machine, pose)
        return {name: maps[name] for name in maps if maps[name].drawn and name in self.index_names}

    def unit(self, name: str) -> str:
        """Return the unit of an index, reported or not, or of a variable."""
        return self._units[name]

    def grid(self) -> FloatArray | None:
        """Return the paper's grid (n, d) within the bounds, or None where the paper has none."""
        full = self._grid()
        if full is None:
            return None
        kept = np.ones(len(full), dtype=bool)
        for column, variable in enumerate(self.all_variables):
            value = self.fixed.get(variable.name)
            if value is not None:
                kept &= np.isclose(full[:, column], value)
        designs = self.reduced(full[kept])
        slack = 1e-9 * (self.high - self.low)
        inside = (designs >= self.low - slack) & (designs <= self.high + slack)
        return np.clip(designs[inside.all(axis=1)], self.low, self.high)

    def draw_tasks(self, n: int, generator: np.random.Generator) -> FloatArray:
        """Draw n packed tasks (n, m) from the Family; what is not drawn keeps this task's value."""
        return self.spread_tasks(generator.random((n, len(self.task_variables))))

    def spread_tasks(self, unit: FloatArray) -> FloatArray:
        """Return the Family's tasks (n, m) at points (n, m) of the unit cube."""
        drawn = np.array([variable.drawn for variable in self.task_variables])
        return np.where(drawn, self.task_type.spread(unit), self._task_row)

    def pack(self, task: TaskLike) -> FloatArray:
        """Return a task as a row (m,)."""
        return self._task(task).pack()

    def unpack(self, row: FloatArray) -> Task:
        """Return the task of a row (m,)."""
        return self.task_type.unpack(row)

    def with_task(self, task: TaskLike, **options: Any) -> Self:
        """Return the same problem with another task, and other options if any are given."""
        return type(self)(
            task=self._task(task),
            objective=[objective.name for objective in self.objectives],
            free=self.variable_names,
            fixed=self.fixed,
            bounds={v.name: (v.low, v.high) for v in self.variables},
            **{**asdict(self.options), **options},
        )

    def objective_for(self, task: TaskLike = None) -> TrialObjective:
        """Return a plain callable of an Optuna trial: its value(s), constraints and indices."""
        return TrialObjective(self, self._task(task))

    def hash(self) -> str:
        """Return the sha256 of what the numbers depend on, never of library versions.

        Options at their default and variables that aren't searched at theirs don't enter it, so
        that a new one leaves all hashes as they are.
        """
        content = {
            "name": self.name,
            "version": self.declared.version,
            "variables": [(v.name, v.low, v.high) for v in self.variables],
            "fixed": self.space.unusual(),
            "task": [asdict(variable) for variable in self.task_variables],
            "objectives": [(o.name, o.direction) for o in self.objectives],
            "constraints": self.constraint_names,
            "options": self.options.changed(),
        }
        for variable in content["task"]:  # type: ignore[attr-defined]  # wording is not the problem
            del variable["doc"]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    # How arguments are checked --------------------------------------------------------------------

    def _sizes(self, design: FloatArray) -> tuple[dict[str, float], str]:
        sizes = self.sizes(design)
        return sizes, self._units.get(next(iter(sizes)), "")

    def _chosen_objectives(self, names: str | Iterable[str] | None) -> tuple[Objective, ...]:
        known = {objective.name: objective for objective in self.all_objectives}
        if names is None:
            return self.all_objectives[:1]
        chosen = (names,) if isinstance(names, str) else tuple(names)
        if not chosen or len(set(chosen)) < len(chosen):
            raise ValueError(f"objective is {names!r}: name one or several different objectives")
        check_known("objective", chosen, known)
        return tuple(known[name] for name in chosen)

    def _chosen_options(self, given: Mapping[str, Any]) -> Options:
        """Return the options, with those on that the objectives' indices need."""
        options = self.options_type.of(given)
        names = {objective.name for objective in self.objectives}
        needed = {
            item.reported: True
            for item in self.declared.index_table
            if item.name in names and isinstance(item.reported, str)
        }
        return replace(options, **needed) if needed else options

    def _reports(self, item: Index) -> bool:
        said = item.reported
        return bool(getattr(self.options, said)) if isinstance(said, str) else said

    def _checked(self, designs: FloatArray) -> FloatArray:
        array = np.asarray(designs)
        if array.dtype.kind not in "fiu" or array.ndim != 2 or array.shape[1] != len(self.low):
            raise ValueError(
                f"designs must be numbers of shape (n, {len(self.low)}), columns "
                f"{', '.join(self.variable_names)}: got {array.dtype} of shape {array.shape}"
            )
        return np.ascontiguousarray(array, dtype=np.float64)

    def _complete_one(self, design: FloatArray) -> FloatArray:
        full: FloatArray = self.complete(self._checked(np.asarray(design)[None]))[0]
        return full

    def _task(self, task: TaskLike) -> Task:
        if task is None:
            return self.task
        return self.task_type.of(task)

    def _task_rows(self, tasks: Task | FloatArray | None, n: int) -> FloatArray:
        if tasks is None:
            return self._task_row
        if isinstance(tasks, Task | Mapping):
            return self.pack(tasks)[None, :]
        rows = np.asarray(tasks)
        m = self._task_row.shape[1]
        if rows.dtype.kind not in "fiu" or rows.shape not in ((n, m), (1, m)):
            raise ValueError(
                f"tasks must be one task or packed tasks of shape ({n}, {m}): got "
                f"{rows.dtype} of shape {rows.shape}"
            )
        rows = np.ascontiguousarray(rows, dtype=np.float64)
        self.task_type.check_rows(rows)
        return rows
