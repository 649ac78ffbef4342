"""Limit: a bound of an index, a variable or an unreported quantity, declared once.

Its violation, its local violation for pictures, its sentence and its row in ``list`` all come from
the one object. What can't be said so (reach, assembly) is the mechanism's own: ``rows.own``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from pkm_gym.core.task import Task
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import converted

# What a compiled loop reads of a limit; ``source`` says in which table ``column`` is.
NAMES = ("source", "column", "sign", "bound", "field", "factor", "power", "relative")
LIMIT = np.dtype([(name, np.float64) for name in NAMES])
OWN, INDEX, VARIABLE = 0, 1, 2

# Of such units a violation is an absolute number, of all others a share of the bound.
ABSOLUTE = ("", "rad")


@dataclass(frozen=True)
class Limit:
    """A bound: ``Limit("sigma_max", "upper", "sigma_high")``.

    Attributes:
        name: of the constraint.
        side: "upper" (at most the bound) or "lower" (at least).
        bound: a number, or the name of a task field; that of an option in ``option_limits`` of a
            declaration.
        of: the index, variable or unreported quantity that is bounded; the name if not given.
        times: a task field and its power, by which the bound is multiplied.
        scale: "absolute", or "relative" to the bound; by the unit if not given: angles and pure
            numbers are absolute.
        words: what is bounded, as its sentence begins; the quantity's own words if not given.
    """

    name: str
    side: Literal["lower", "upper"]
    bound: float | str
    of: str = ""
    times: tuple[str, int] | None = None
    scale: Literal["", "absolute", "relative"] = ""
    words: str = ""

    @property
    def quantity(self) -> str:
        """The name of what is bounded."""
        return self.of or self.name

    @property
    def sign(self) -> float:
        """+1 where more than the bound breaks it, -1 where less does."""
        return 1.0 if self.side == "upper" else -1.0

    @property
    def side_words(self) -> str:
        """The side as people say it."""
        return "at most" if self.side == "upper" else "at least"

    @property
    def bound_words(self) -> str:
        """The bound as it is declared, a number in SI."""
        bound = f"task.{self.bound}" if isinstance(self.bound, str) else f"{self.bound:g}"
        power = "" if self.times is None or self.times[1] == 1 else f"^{self.times[1]}"
        return bound if self.times is None else f"{bound} task.{self.times[0]}{power}"

    def bound_shown(self, unit: str) -> str:
        """Return the bound of a quantity of this unit as people read it."""
        if isinstance(self.bound, str) or self.times is not None:
            return self.bound_words
        return _number(self.bound, unit)

    def relative(self, unit: str) -> bool:
        """Return whether the violation of a quantity of this unit is a share of the bound."""
        return self.scale == "relative" if self.scale else unit not in ABSOLUTE

    def bound_of(self, task: Task) -> float:
        """Return the bound for a task, in the quantity's unit."""
        bound = getattr(task, self.bound) if isinstance(self.bound, str) else self.bound
        if self.times is not None:
            field, power = self.times
            bound *= getattr(task, field) ** power
        return float(bound)

    def violation(self, values: FloatArray, task: Task, unit: str) -> FloatArray:
        """Return by how much values (...) break it, scaled, > 0 where broken."""
        bound = self.bound_of(task)
        excess = values / bound - 1.0 if self.relative(unit) else values - bound
        return np.asarray(self.sign * excess)

    def sentence(self, value: float, task: Task, unit: str, words: str, where: str) -> str:
        """Say what breaks it, by how much, where in the workspace, and what is allowed."""
        bound = self.bound_of(task)
        shown = [_number(x, unit) for x in (value, abs(value - bound), bound)]
        far = "too large" if self.side == "upper" else "too small"
        place = f" {where}" if where else ""
        what = self.words or words
        return (
            f"{self.name}: {what} is {shown[0]}{place}, {shown[1]} {far}; it must be "
            f"{self.side_words} {shown[2]}"
        )


def packed(
    limits: Sequence[str | Limit],
    own: Sequence[str],
    indices: Mapping[str, str],
    variables: Mapping[str, str],
    fields: Sequence[str],
) -> FloatArray:
    """Return limits as rows (c, 8) of ``LIMIT`` for the compiled pass.

    Args:
        limits: a ``Limit``, or the name of one of the mechanism's ``own``.
        own: names of the mechanism's own, in the kernel's order.
        indices: name -> unit, in the kernel's order.
        variables: name -> unit, in the order of a design.
        fields: names of the task's, in the order of a packed row.
    """
    rows = np.zeros((len(limits), len(NAMES)))
    table = rows.view(LIMIT)[:, 0]
    for row, limit in zip(table, limits, strict=True):
        if isinstance(limit, str):
            row["source"], row["column"] = OWN, own.index(limit)
            continue
        source, units = (INDEX, indices) if limit.quantity in indices else (VARIABLE, variables)
        row["source"], row["column"] = source, list(units).index(limit.quantity)
        row["sign"], row["relative"] = limit.sign, limit.relative(units[limit.quantity])
        named = isinstance(limit.bound, str)
        row["field"] = fields.index(str(limit.bound)) if named else -1
        row["bound"] = 0.0 if named else limit.bound
        row["factor"], row["power"] = -1, 0
        if limit.times is not None:
            row["factor"], row["power"] = fields.index(limit.times[0]), limit.times[1]
    return rows


def _number(value: float, unit: str) -> str:
    number, name = converted(value, unit)
    return f"{number:.4g} {name}".rstrip()
