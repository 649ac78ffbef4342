"""Variables of a design and the numbers of a task, each with its unit and ranges."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from math import isfinite
from typing import Any, Self

import numpy as np

from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import show


@dataclass(frozen=True)
class Variable:
    """One coordinate of a design: search bounds, not constraints.

    Where it isn't searched it has its ``default``, a number or that of the variable so named; None
    stands for the paper's design. ``step`` is that of our grid, also in place of the paper's where
    it prints a range only; ``scanned`` says that it prints the values of its grid.
    """

    name: str
    low: float
    high: float
    unit: str
    doc: str
    default: float | str | None = None
    searched: bool = True
    step: float = 0.01
    scanned: bool = False


@dataclass(frozen=True)
class TaskVariable:
    """One number of a task.

    ``low`` and ``high`` are the range a Family draws from (equal: not drawn), ``legal_low`` and
    ``legal_high`` what a task may have at all.
    """

    name: str
    unit: str
    doc: str
    default: float
    low: float
    high: float
    legal_low: float
    legal_high: float

    @property
    def drawn(self) -> bool:
        """Whether a Family draws it."""
        return self.low < self.high


def quantity(
    default: float,
    unit: str,
    doc: str,
    *,
    legal: tuple[float, float],
    family: tuple[float, float] | None = None,
) -> Any:
    """Declare a field of a Task: default, unit, what it is, legal range, range of the Family."""
    return field(
        default=default,
        metadata={
            "unit": unit,
            "doc": doc,
            "legal": legal,
            "family": family or (default, default),
        },
    )


@dataclass(frozen=True)
class Task:
    """What the mechanism must do, in numbers that may differ from episode to episode.

    Subclasses declare their fields with ``quantity``; the defaults are the paper's task.
    """

    def __post_init__(self) -> None:
        """Refuse a number outside its legal range.

        Raises:
            ValueError: naming the field, its value and the allowed range.
        """
        for item in self.variables():
            value = getattr(self, item.name)
            number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
            if not (number and isfinite(value) and item.legal_low <= value <= item.legal_high):
                raise ValueError(
                    f"task.{item.name} is {value!r}: it must be a number from {item.legal_low:g} "
                    f"to {item.legal_high:g}" + (f" {item.unit}" if item.unit else "")
                )
            object.__setattr__(self, item.name, float(value))

    @classmethod
    @cache
    def variables(cls) -> tuple[TaskVariable, ...]:
        """Return the fields with their units and ranges."""
        return tuple(
            TaskVariable(
                item.name,
                item.metadata["unit"],
                item.metadata["doc"],
                float(item.default),  # type: ignore[arg-type]  # quantity() always sets a number
                *_pair(item.metadata["family"]),
                *_pair(item.metadata["legal"]),
            )
            for item in fields(cls)
        )

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Return the names of the fields, in the order of a packed row."""
        return tuple(item.name for item in cls.variables())

    @classmethod
    def of(cls, task: Task | Mapping[str, float] | None) -> Self:
        """Return a task from a task, from a mapping of the fields that differ, or the paper's.

        Raises:
            ValueError: for an unknown field (with its closest match) or an illegal value.
            TypeError: for anything else.
        """
        if isinstance(task, cls):
            return task
        if task is None:
            return cls()
        if not isinstance(task, Mapping):
            raise TypeError(
                f"a task must be a {cls.__name__} or a mapping of its fields, not {task!r}"
            )
        check_known("task field", task, cls.names())
        return cls(**task)

    def replace(self, **changes: float) -> Self:
        """Return a copy with some fields changed."""
        check_known("task field", changes, self.names())
        return dataclasses.replace(self, **changes)

    def pack(self) -> FloatArray:
        """Return the fields as a row (m,)."""
        return np.array([getattr(self, name) for name in self.names()])

    @classmethod
    def unpack(cls, row: FloatArray) -> Self:
        """Return the task of a row (m,)."""
        return cls(**dict(zip(cls.names(), map(float, row), strict=True)))

    @classmethod
    def check_rows(cls, rows: FloatArray) -> None:
        """Refuse rows (n, m) with a number outside its legal range.

        Raises:
            ValueError: naming the first such field, its row, its value and the allowed range.
        """
        low, high = cls._ranges(legal=True)
        bad = ~((rows >= low) & (rows <= high))
        if bad.any():
            i, j = np.argwhere(bad)[0]
            item = cls.variables()[j]
            raise ValueError(
                f"task row {i}: {item.name} is {float(rows[i, j])!r}, it must be from "
                f"{item.legal_low:g} to {item.legal_high:g} {item.unit}".rstrip()
            )

    @classmethod
    def spread(cls, unit: FloatArray) -> FloatArray:
        """Return the Family's tasks (n, m) at points (n, m) of the unit cube."""
        low, high = cls._ranges(legal=False)
        return low + (high - low) * unit

    @classmethod
    @cache
    def _ranges(cls, *, legal: bool) -> tuple[FloatArray, FloatArray]:
        items = cls.variables()
        pairs = [(v.legal_low, v.legal_high) if legal else (v.low, v.high) for v in items]
        low, high = np.array(pairs).T
        return low, high


def _pair(values: tuple[float, float]) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def shown_differences(there: Task, here: Task) -> str:
    """Say which fields of two tasks of a problem differ, with units."""
    items = [v for v in here.variables() if getattr(there, v.name) != getattr(here, v.name)]
    told = (
        f"{v.name} = {show(getattr(there, v.name), v.unit)} there, "
        f"{show(getattr(here, v.name), v.unit)} here"
        for v in items
    )
    return "; ".join(told)


TaskLike = Task | Mapping[str, float] | None
