"""Lengths and times of a task, of which it holds ratios: a height, not height over width."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from math import inf, prod

from pkm_gym.core.task import Task, TaskVariable


@dataclass(frozen=True)
class Product:
    """What a task may be given in place of a ratio of it: ``factor`` * ratio * fields^powers.

    Attributes:
        ratio: the task field that it settles.
        powers: task field -> power with which it goes, such as {"b": 1} of a height h_ratio b.
        unit: of the product, SI.
        doc: what it is.
        factor: the number in front.
    """

    ratio: str
    powers: Mapping[str, float] = field(default_factory=dict)
    unit: str = "m"
    doc: str = ""
    factor: float = 1.0

    @property
    def fields(self) -> tuple[str, ...]:
        """The task fields that it is made of, the ratio first."""
        return (self.ratio, *self.powers)

    @property
    def words(self) -> str:
        """What it is made of, such as "h_ratio * b"."""
        parts = [name if power == 1 else f"{name}^{power:g}" for name, power in self.powers.items()]
        number = [] if self.factor == 1.0 else [f"{self.factor:.6g}"]
        return " * ".join([*number, self.ratio, *parts])

    def base(self, fields: Mapping[str, float]) -> float:
        """Return what the ratio is multiplied with, of task fields by name."""
        return prod(
            (fields[name] ** power for name, power in self.powers.items()), start=self.factor
        )

    def value(self, task: Task) -> float:
        """Return the product of a task, SI."""
        return float(getattr(task, self.ratio) * self.base(vars(task)))

    def share(self, value: float, fields: Mapping[str, float]) -> float:
        """Return the ratio that makes the product this value."""
        base = self.base(fields)
        return value / base if base > 0.0 else inf

    def drawn(self, items: Mapping[str, TaskVariable]) -> tuple[float, float]:
        """Return the least and the greatest product of a Family's tasks."""
        ends = [(items[name].low, items[name].high) for name in self.fields]
        corners = [dict(zip(self.fields, corner, strict=True)) for corner in product(*ends)]
        values = [corner[self.ratio] * self.base(corner) for corner in corners]
        return min(values), max(values)

    def legal(self, items: Mapping[str, TaskVariable]) -> tuple[float, float]:
        """Return the least and the greatest product that a task may have, beside the defaults."""
        base = self.base({name: items[name].default for name in self.powers})
        return items[self.ratio].legal_low * base, items[self.ratio].legal_high * base
