"""ProblemStatement: what a design problem asks; its space, tasks, objectives and limits."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from inspect import signature
from typing import Any, ClassVar, Self

import numpy as np

from pkm_gym.core.arguments import (
    checked_designs,
    chosen_objectives,
    chosen_options,
    limits_given,
    reported_indices,
)
from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import packed
from pkm_gym.core.names import check_known
from pkm_gym.core.options import Options
from pkm_gym.core.reference import Reference
from pkm_gym.core.space import Space
from pkm_gym.core.task import Task, TaskLike, TaskVariable, Variable
from pkm_gym.core.types import FloatArray

# What multiplies the penalty's weight where options ask for limits: the multiplier of one that few
# designs keep to is large.
STRICT = 10.0


class ProblemStatement:
    """What is declared of a design problem, and chosen of it when it is made.

    Its arguments are those of ``DesignProblem``, which adds what is measured.
    """

    declared: ClassVar[Declaration]
    name: ClassVar[str]
    title: ClassVar[str]
    task_type: ClassVar[type[Task]]
    options_type: ClassVar[type[Options]]
    all_variables: ClassVar[tuple[Variable, ...]]
    all_objectives: ClassVar[tuple[Objective, ...]]
    notes: tuple[str, ...]  # standing warnings that hold for every design
    scale: float  # of merit: the first objective at the task's optimum, but for the task's powers

    def __init_subclass__(cls, **more: Any) -> None:
        """Answer under short names with what is declared."""
        super().__init_subclass__(**more)
        if "declared" in vars(cls):
            said = cls.declared
            cls.name, cls.title, cls.notes = said.name, said.title, tuple(said.notes)
            cls.task_type, cls.options_type = said.task, said.options
            cls.all_variables, cls.all_objectives = said.variables, tuple(said.objectives)

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
        check_known("argument", options, self.argument_names())
        self.task = self.task_type.of(task)
        self.objectives = chosen_objectives(self.all_objectives, objective)
        self.options = chosen_options(self.declared, self.objectives, options)
        self.space = Space.chosen(self.all_variables, self.reference.design, free, fixed, bounds)
        self.variables = self.space.searched
        self.index_table = reported_indices(self.declared.index_table, self.options)
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
        asked = limits_given(self.declared, self.options)
        self.limits = (*self.declared.constraints, *asked)
        self.penalty_weight = self.declared.penalty_weight * (STRICT if asked else 1.0)
        self.constraint_names = tuple(
            limit if isinstance(limit, str) else limit.name for limit in self.limits
        )
        self._limits = packed(self.limits, own, indices, variables, fields)
        self.scale = self.objectives[0].scale
        self._powers, self._rates = (
            np.array([goes.get(name, 0.0) for name in fields])
            for goes in (self.objectives[0].powers, self.objectives[0].rates)
        )

    @classmethod
    def argument_names(cls) -> set[str]:
        """Return the names of what it is made with: the arguments and the options."""
        own = set(signature(ProblemStatement.__init__).parameters) - {"self", "options"}
        return own | {item.name for item in cls.options_type.table()}

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

    def complete(self, designs: FloatArray) -> FloatArray:
        """Return designs (n, d) with the fixed variables put in: (n, all variables)."""
        return self.space.complete(designs)

    def reduced(self, full: FloatArray) -> FloatArray:
        """Return the searched columns (n, d) of complete designs (n, all variables)."""
        return self.space.reduced(full)

    def named(self, design: FloatArray) -> dict[str, float]:
        """Return all variables of a design (d,) by name, the fixed ones included."""
        full = self._complete_one(design)
        return {v.name: float(x) for v, x in zip(self.all_variables, full, strict=True)}

    def design(self, values: Mapping[str, float]) -> FloatArray:
        """Return the design (d,) of named values; fixed variables may be left out.

        Raises:
            ValueError: for an unknown or missing name, or one that disagrees with a fixed value.
        """
        return self.space.design(values)

    def printed_design(self) -> FloatArray:
        """Return the design (d,) that the paper prints; the default one where there is no paper."""
        return self.reduced(self.space.defaults()[None])[0]

    def unit(self, name: str) -> str:
        """Return the unit of an index, reported or not, or of a variable."""
        return self._units[name]

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
        return self._remade(task=self._task(task), **options)

    def with_objectives(self, *names: str) -> Self:
        """Return the same problem with other objectives.

        Raises:
            ValueError: for an unknown one, with its closest match, or one that comes twice.
        """
        return self._remade(objective=names)

    def _remade(self, **changes: Any) -> Self:
        own = {
            "task": self.task,
            "objective": [objective.name for objective in self.objectives],
            "free": self.variable_names,
            "fixed": self.fixed,
            "bounds": {v.name: (v.low, v.high) for v in self.variables},
            **asdict(self.options),
        }
        return type(self)(**{**own, **changes})

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

    def _complete_one(self, design: FloatArray) -> FloatArray:
        full: FloatArray = self.complete(checked_designs(np.asarray(design)[None], self.variables))
        return full[0]

    def _task(self, task: TaskLike) -> Task:
        return self.task if task is None else self.task_type.of(task)
