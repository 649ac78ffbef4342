"""DesignProblem: a vector of dimensions in, indices out. Everything else is its client."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, fields
from math import isfinite
from typing import Any, ClassVar, Literal, NamedTuple, Self

import numpy as np

from pkm_gym.core import merit
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.names import check_known
from pkm_gym.core.reference import Reference
from pkm_gym.core.task import Task, TaskVariable, Variable
from pkm_gym.core.trial import TrialObjective
from pkm_gym.core.types import FloatArray

TaskLike = Task | Mapping[str, float] | None


@dataclass(frozen=True)
class Index:
    """A named performance number of a design."""

    name: str
    unit: str
    doc: str


@dataclass(frozen=True)
class Objective:
    """An index that is optimised; no feasible design of a legal task reaches ``worst``."""

    name: str
    direction: Literal["minimise", "maximise"]
    unit: str
    worst: float

    @property
    def sign(self) -> float:
        """+1 where less is better, -1 where more is."""
        return 1.0 if self.direction == "minimise" else -1.0


class Dimension(NamedTuple):
    """A derived dimension with its unit."""

    value: float
    unit: str


@dataclass(frozen=True)
class Options:
    """What is fixed when a problem is made; a mechanism adds its presets and sampling."""

    @classmethod
    def of(cls, options: Mapping[str, Any]) -> Self:
        """Return the options from keyword arguments.

        Raises:
            ValueError: for an unknown option (with its closest match) or an illegal value.
        """
        check_known("option", options, [item.name for item in fields(cls)])
        return cls(**options)


class Measurement(NamedTuple):
    """What a mechanism's kernel fills for n designs."""

    table: FloatArray  # (n, indices), NaN where undefined
    violations: FloatArray  # (n, constraints), scaled and dimensionless, > 0 where broken
    unreached: FloatArray  # (n,), > 0 where the indices are undefined
    scales: FloatArray  # (n,), estimate of the first objective at the task's optimum


class DesignProblem(ABC):
    """The paper's design problem of one mechanism.

    Args:
        task: a Task, or a mapping of the fields that differ from the paper's.
        objective: the name of an objective, or several; the first is the one merit uses.
        free: names of the variables that are searched; the others stay at the printed design.
        fixed: variable -> value, taken out of the search.
        bounds: variable -> (low, high), other search bounds.
        options: what the mechanism offers (presets, sampling): see its page.

    Raises:
        ValueError: for an unknown name, with its closest match, or an illegal value.
    """

    name: ClassVar[str]
    title: ClassVar[str]
    version: ClassVar[int]
    package: ClassVar[str]
    reference_file: ClassVar[str] = "paper.toml"
    task_type: ClassVar[type[Task]]
    options_type: ClassVar[type[Options]]
    all_variables: ClassVar[tuple[Variable, ...]]
    all_objectives: ClassVar[tuple[Objective, ...]]
    constraint_names: ClassVar[tuple[str, ...]]
    dimension_names: ClassVar[tuple[str, ...]]
    penalty_weight: ClassVar[float]
    notes: tuple[str, ...] = ()

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
        self.options = self.options_type.of(options)
        self.objectives = self._chosen_objectives(objective)
        self.fixed = self._fixed_values(free, fixed)
        self.variables = self._free_variables(bounds or {})
        self.index_table = self._chosen_indices()
        self.index_names = tuple(index.name for index in self.index_table)
        self.objective_columns = [self.index_names.index(o.name) for o in self.objectives]
        self.low = np.array([variable.low for variable in self.variables])
        self.high = np.array([variable.high for variable in self.variables])
        self._template = np.array([self.fixed.get(v.name, 0.0) for v in self.all_variables])
        self._columns = [i for i, v in enumerate(self.all_variables) if v.name not in self.fixed]
        self._minimise = self.objectives[0].direction == "minimise"
        self._task_row = self.task.pack()[None, :]

    # What a mechanism supplies ------------------------------------------------------------------

    @abstractmethod
    def _chosen_indices(self) -> tuple[Index, ...]:
        """Return the indices that are reported with these options and objectives."""

    @abstractmethod
    def _measure(self, designs: FloatArray, tasks: FloatArray) -> Measurement:
        """Measure complete designs (n, all variables) for tasks (n, m) or (1, m), never raising."""

    @abstractmethod
    def _mechanism(self, design: FloatArray, task: Any) -> Mechanism:
        """Return the mechanism of a complete design."""

    @abstractmethod
    def derived(self, design: FloatArray, task: TaskLike = None) -> dict[str, Dimension]:
        """Return the derived dimensions of a design (d,), by name."""

    @abstractmethod
    def from_dimensions(
        self, dimensions: Mapping[str, float], task: Any
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Turn dimensions (m, rad) into values of all variables and changed task fields."""

    @abstractmethod
    def explain_limits(self, design: FloatArray, task: Any, broken: list[str]) -> list[str]:
        """Say in words, a line a broken limit, where in the workspace and by how much."""

    def _grid(self) -> FloatArray | None:
        """Return the paper's grid of complete designs, or None where the paper has none."""
        return None

    # What everyone calls --------------------------------------------------------------------------

    @property
    def reference(self) -> Reference:
        """The printed numbers, their verdicts and our verified values."""
        return Reference.load(self.package, self.reference_file)

    @property
    def task_variables(self) -> tuple[TaskVariable, ...]:
        """The fields of the Task with units and ranges."""
        return self.task_type.variables()

    @property
    def variable_names(self) -> tuple[str, ...]:
        """The names of the searched variables."""
        return tuple(variable.name for variable in self.variables)

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
        task_rows = self._task_rows(tasks, len(designs))
        table, constraints, unreached, scales = self._measure(self.complete(designs), task_rows)
        log_merit = np.empty(len(designs))
        feasible = np.empty(len(designs), dtype=np.bool_)
        merit.score(
            0.02 * len(designs),
            table[:, self.objective_columns[0]],
            scales,
            self._minimise,
            self.penalty_weight,
            constraints,
            unreached,
            log_merit,
            feasible,
        )
        return Evaluation(self, designs, task_rows, table, constraints, feasible, log_merit)

    def complete(self, designs: FloatArray) -> FloatArray:
        """Return designs (n, d) with the fixed variables put in: (n, all variables)."""
        if not self.fixed:
            return designs
        full = np.repeat(self._template[None, :], len(designs), axis=0)
        full[:, self._columns] = designs
        return full

    def reduced(self, full: FloatArray) -> FloatArray:
        """Return the searched columns (n, d) of complete designs (n, all variables)."""
        reduced: FloatArray = full[:, self._columns]
        return reduced

    def mechanism(self, design: FloatArray, task: TaskLike = None) -> Mechanism:
        """Return the machine of a design (d,).

        Raises:
            ValueError: for a wrong shape, or for dimensions that make no machine.
        """
        return self._mechanism(self._complete_one(design), self._task(task))

    def named(self, design: FloatArray) -> dict[str, float]:
        """Return all variables of a design (d,) by name, the fixed ones included."""
        full = self._complete_one(design)
        return {v.name: float(x) for v, x in zip(self.all_variables, full, strict=True)}

    def design(self, values: Mapping[str, float]) -> FloatArray:
        """Return the design (d,) of named values; fixed variables may be left out.

        Raises:
            ValueError: for an unknown or missing name, or one that disagrees with a fixed value.
        """
        check_known("variable", values, [v.name for v in self.all_variables])
        for name, value in self.fixed.items():
            if not np.isclose(values.get(name, value), value, rtol=1e-12, atol=0.0):
                raise ValueError(f"{name} is fixed at {value:g}: {values[name]!r} disagrees")
        for name in self.variable_names:
            if name not in values:
                raise ValueError(f"the design lacks {name}: give {', '.join(self.variable_names)}")
        return np.array([float(values[name]) for name in self.variable_names])

    def printed_design(self) -> FloatArray:
        """Return the design (d,) that the paper prints."""
        return np.array([self.reference.design[name] for name in self.variable_names])

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

    def objective_for(self, task: TaskLike = None) -> TrialObjective:
        """Return a plain callable of an Optuna trial: its value(s), constraints and indices."""
        return TrialObjective(self, self._task(task))

    def hash(self) -> str:
        """Return the sha256 of what the numbers depend on, never of library versions."""
        content = {
            "name": self.name,
            "version": self.version,
            "variables": [(v.name, v.low, v.high) for v in self.variables],
            "fixed": dict(sorted(self.fixed.items())),
            "task": [asdict(variable) for variable in self.task_variables],
            "objectives": [(o.name, o.direction) for o in self.objectives],
            "constraints": self.constraint_names,
            "options": asdict(self.options),
        }
        for variable in content["task"]:  # type: ignore[attr-defined]  # wording is not the problem
            del variable["doc"], variable["limit"]
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()

    # How arguments are checked --------------------------------------------------------------------

    def _chosen_objectives(self, names: str | Iterable[str] | None) -> tuple[Objective, ...]:
        known = {objective.name: objective for objective in self.all_objectives}
        if names is None:
            return self.all_objectives[:1]
        chosen = (names,) if isinstance(names, str) else tuple(names)
        if not chosen or len(set(chosen)) < len(chosen):
            raise ValueError(f"objective is {names!r}: name one or several different objectives")
        check_known("objective", chosen, known)
        return tuple(known[name] for name in chosen)

    def _fixed_values(
        self, free: Iterable[str] | None, fixed: Mapping[str, float] | None
    ) -> dict[str, float]:
        names = [variable.name for variable in self.all_variables]
        values = {name: _number(f"fixed {name}", value) for name, value in (fixed or {}).items()}
        check_known("variable", values, names)
        if free is not None:
            free = (free,) if isinstance(free, str) else tuple(free)
            check_known("variable", free, names)
            for name in names:
                if name in free and name in values:
                    raise ValueError(f"{name} is both free and fixed: choose one")
                if name not in free:
                    values.setdefault(name, self.reference.design[name])
        if len(values) == len(names):
            raise ValueError("every variable is fixed: leave at least one to search")
        return values

    def _free_variables(self, bounds: Mapping[str, tuple[float, float]]) -> tuple[Variable, ...]:
        free = [variable for variable in self.all_variables if variable.name not in self.fixed]
        check_known("variable", bounds, [variable.name for variable in free])
        ranged = []
        for variable in free:
            low, high = bounds.get(variable.name, (variable.low, variable.high))
            low, high = (_number(f"bound of {variable.name}", value) for value in (low, high))
            if not low < high:
                raise ValueError(
                    f"bounds of {variable.name} are ({low:g}, {high:g}): the low one must be "
                    "the smaller"
                )
            ranged.append(Variable(variable.name, low, high, variable.unit, variable.doc))
        return tuple(ranged)

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


def _number(what: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = float("nan")
    if not isfinite(number):
        raise ValueError(f"{what} is {value!r}: it must be a finite number")
    return number
