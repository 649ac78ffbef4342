"""Space: which variables are searched, which stay fixed and which follow another one."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any

import numpy as np

from pkm_gym.core.names import check_known
from pkm_gym.core.task import Variable
from pkm_gym.core.types import FloatArray

ALL = "all"  # as ``free``: every variable


@dataclass(frozen=True)
class Space:
    """The designs (n, d) that are searched among complete ones (n, all variables).

    Attributes:
        every: all variables.
        printed: variable -> the value that the paper prints, empty without a paper.
        searched: the d variables that are searched, within their bounds.
        fixed: variable -> value.
        following: variable -> the other one that it equals.
    """

    every: tuple[Variable, ...]
    printed: Mapping[str, float]
    searched: tuple[Variable, ...]
    fixed: Mapping[str, float]
    following: Mapping[str, str]

    @classmethod
    def chosen(
        cls,
        every: tuple[Variable, ...],
        printed: Mapping[str, float],
        free: Iterable[str] | None,
        fixed: Mapping[str, float] | None,
        bounds: Mapping[str, tuple[float, float]] | None,
    ) -> Space:
        """Return the space that the arguments of a problem mean.

        Raises:
            ValueError: for an unknown name (with its closest match), a number that is none, bounds
                the wrong way round, or nothing left to search.
        """
        names = [variable.name for variable in every]
        values = {name: _number(f"fixed {name}", value) for name, value in (fixed or {}).items()}
        check_known("variable", values, names)
        searched = searched_names(every, free)
        for name in names:
            if free is not None and name in searched and name in values:
                raise ValueError(f"{name} is both free and fixed: choose one")
        if not searched - values.keys():
            raise ValueError("every variable is fixed: leave at least one to search")
        held = [v for v in every if v.name not in searched and v.name not in values]
        following = {v.name: v.default for v in held if isinstance(v.default, str)}
        usual = dict(zip(names, defaults(every, printed, values).tolist(), strict=True))
        values |= {v.name: usual[v.name] for v in held if v.name not in following}
        kept = [v for v in every if v.name in searched and v.name not in values]
        return cls(
            every,
            printed,
            _bounded(kept, bounds or {}),
            {name: values[name] for name in names if name in values},
            following,
        )

    def complete(self, designs: FloatArray) -> FloatArray:
        """Return designs (n, d) with what is fixed and what follows put in."""
        if len(self.searched) == len(self.every):
            return designs
        full = np.empty((len(designs), len(self.every)))
        full[:] = self._held
        full[:, self._searched_columns] = designs
        for column, source in self._followers:
            full[:, column] = full[:, source]
        return full

    def reduced(self, full: FloatArray) -> FloatArray:
        """Return the searched columns (n, d) of complete designs."""
        reduced: FloatArray = full[:, self.columns]
        return reduced

    def design(self, values: Mapping[str, float]) -> FloatArray:
        """Return the design (d,) of named values; fixed variables may be left out.

        Raises:
            ValueError: for an unknown or missing name, or one that disagrees with a fixed value.
        """
        check_known("variable", values, [variable.name for variable in self.every])
        for name, value in self.fixed.items():
            if not np.isclose(values.get(name, value), value, rtol=1e-12, atol=0.0):
                raise ValueError(f"{name} is fixed at {value:g}: {values[name]!r} disagrees")
        for name, source in self.following.items():
            if name in values and values[name] != values.get(source, self.fixed.get(source)):
                raise ValueError(f"{name} follows {source}: free it with free= to give its value")
        names = [variable.name for variable in self.searched]
        for name in names:
            if name not in values:
                raise ValueError(f"the design lacks {name}: give {', '.join(names)}")
        return np.array([float(values[name]) for name in names])

    def within(self, full: FloatArray) -> FloatArray:
        """Return the designs (n, d) of those complete ones that lie in this space."""
        kept = np.ones(len(full), dtype=bool)
        for name, value in self.fixed.items():
            kept &= np.isclose(full[:, self._column(name)], value)
        designs = self.reduced(full[kept])
        low, high = np.array([(variable.low, variable.high) for variable in self.searched]).T
        slack = 1e-9 * (high - low)
        inside = (designs >= low - slack) & (designs <= high + slack)
        return np.clip(designs[inside.all(axis=1)], low, high)

    @cached_property
    def columns(self) -> list[int]:
        """Where the searched variables are in a complete design."""
        return [self._column(variable.name) for variable in self.searched]

    @cached_property
    def _searched_columns(self) -> slice | list[int]:
        """The same as a slice, which is faster, where they stand side by side."""
        first, last = self.columns[0], self.columns[-1]
        return slice(first, last + 1) if last + 1 - first == len(self.columns) else self.columns

    @cached_property
    def _followers(self) -> list[tuple[int, int]]:
        """Columns of the variables that follow another one, each with the other's."""
        return [
            (self._column(name), self._column(source)) for name, source in self.following.items()
        ]

    @cached_property
    def _held(self) -> FloatArray:
        """The fixed values in their places (1, all variables)."""
        return np.array([[self.fixed.get(variable.name, 0.0) for variable in self.every]])

    def defaults(self) -> FloatArray:
        """Return the complete default design (all variables,)."""
        return defaults(self.every, self.printed, {})

    def unusual(self) -> dict[str, float]:
        """Return the fixed values that are not just the defaults of unsearched variables."""
        named = zip(self.every, self.defaults().tolist(), strict=True)
        usual = {variable.name: value for variable, value in named if not variable.searched}
        return {k: x for k, x in sorted(self.fixed.items()) if usual.get(k) != x}

    def _column(self, name: str) -> int:
        return [variable.name for variable in self.every].index(name)


def defaults(
    every: Sequence[Variable], printed: Mapping[str, float], given: Mapping[str, float]
) -> FloatArray:
    """Return the complete default design (all variables,), with some values given.

    A variable's declared default, else what the paper prints, else the middle of its range.
    """
    values = dict(given)
    links = {v.name: v.default for v in every if isinstance(v.default, str)}
    for v in every:
        middle = 0.5 * (v.low + v.high)
        default = printed.get(v.name, middle) if v.default is None else v.default
        if not isinstance(default, str):
            values.setdefault(v.name, float(default))
    for name, source in links.items():
        values.setdefault(name, values[source])
    return np.array([values[v.name] for v in every])


def searched_names(every: Sequence[Variable], free: Iterable[str] | None) -> set[str]:
    """Return the names that ``free`` frees: the usual ones if None.

    Raises:
        ValueError: for an unknown one, with its closest match.
    """
    if free is None:
        return {variable.name for variable in every if variable.searched}
    names = [variable.name for variable in every]
    chosen: tuple[Any, ...] = (free,)
    if isinstance(free, Iterable) and not isinstance(free, str):
        chosen = tuple(free)
    if chosen == (ALL,):
        return set(names)
    check_known("variable", chosen, names)
    return set(chosen)


def _bounded(
    variables: Sequence[Variable], bounds: Mapping[str, tuple[float, float]]
) -> tuple[Variable, ...]:
    check_known("variable", bounds, [variable.name for variable in variables])
    bounded = []
    for variable in variables:
        low, high = bounds.get(variable.name, (variable.low, variable.high))
        low, high = (_number(f"bound of {variable.name}", value) for value in (low, high))
        if not low < high:
            raise ValueError(
                f"bounds of {variable.name} are ({low:g}, {high:g}): the low one must be "
                "the smaller"
            )
        bounded.append(replace(variable, low=low, high=high))
    return tuple(bounded)


def _number(what: str, value: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = float("nan")
    if not isfinite(number):
        raise ValueError(f"{what} is {value!r}: it must be a finite number")
    return number
