"""Lattices: the values that a dimension can be built with, a step apart or in stock."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import WRITTEN, converted, parse, show

EXACT = 1e-9  # of a step: a value so close to a lattice's is one of it


@dataclass(frozen=True)
class Axis:
    """The values that one dimension can have.

    Attributes:
        unit: SI.
        step: in the unit that people read (mm, deg), 0 where there is a stock.
        stock: values in SI, ascending.
    """

    unit: str
    step: float = 0.0
    stock: tuple[float, ...] = ()

    @property
    def words(self) -> str:
        """What values it has."""
        if self.stock:
            return ", ".join(show(value, self.unit) for value in self.stock)
        return f"{self.step:g} {converted(0.0, self.unit)[1]}".rstrip()

    @property
    def pitch(self) -> float:
        """The distance of neighbours in SI, the least one in stock, 0 of a single value."""
        if self.stock:
            return float(min(np.diff(self.stock), default=0.0))
        return self.value(1)

    def value(self, number: int) -> float:
        """Return the value of that number, as it is read where it is typed with its unit."""
        if self.stock:
            return self.stock[number]
        return number * self.step / WRITTEN.get(self.unit, {}).get(converted(0.0, self.unit)[1], 1)

    def place(self, value: float) -> float:
        """Return where a value stands among the numbers, between two of them."""
        if not self.stock:
            return converted(value, self.unit)[0] / self.step
        return float(np.interp(value, self.stock, np.arange(len(self.stock))))

    def near(self, value: float, reach: int) -> npt.NDArray[np.intp]:
        """Return the numbers of up to ``reach`` values on each side of a value, and of itself."""
        place = self.place(value)
        low, high = math.ceil(place - EXACT) - reach, math.floor(place + EXACT) + reach
        if self.stock:
            low, high = max(low, 0), min(high, len(self.stock) - 1)
        return np.arange(low, high + 1)

    def holds(self, value: float) -> bool:
        """Whether a value is one of it."""
        place = self.place(value)
        return math.isclose(self.value(round(place)), value, rel_tol=EXACT, abs_tol=EXACT**2)


Lattice = Mapping[str, Axis]


def lattice(
    units: Mapping[str, str], to: Iterable[str] = (), stock: Iterable[str] = ()
) -> dict[str, Axis]:
    """Return the axes by dimension that words mean.

    Args:
        units: dimension -> SI unit.
        to: steps: "1mm" of all lengths, "0.5deg" of all angles, "l1=0.1mm" of one dimension.
        stock: "l1=300mm,350mm": all values that a dimension has.

    Raises:
        ValueError: in one sentence, for words that say no lattice.
    """
    axes: dict[str, Axis] = {}
    for name, step in by_dimension(units, to, "--to").items():
        axes[name] = Axis(units[name], float(f"{converted(step, units[name])[0]:.12g}"))
    for text in stock:
        name, equals, listed = (part.strip() for part in text.partition("="))
        if not equals:
            raise ValueError(f"--stock {text} names no dimension: write --stock l1=300mm,350mm")
        check_known("dimension", [name], units)
        values = [parse(value, units[name], what=f"stock of {name}") for value in listed.split(",")]
        if name in axes and axes[name].stock:
            raise ValueError(f"--stock gives {name} twice: list all its values at once")
        axes[name] = Axis(units[name], stock=tuple(sorted(set(values))))
    if not axes:
        raise ValueError(
            "nothing is said of the lattice: write --to 1mm, or --stock l1=300mm,350mm"
        )
    return axes


def by_dimension(units: Mapping[str, str], texts: Iterable[str], flag: str) -> dict[str, float]:
    """Return numbers > 0 by dimension: "1mm" is of all lengths, "l1=1mm" of one.

    Args:
        units: dimension -> SI unit.
        texts: what the user says.
        flag: of the command line, for the errors.

    Raises:
        ValueError: in one sentence, for what is no such number.
    """
    general: dict[str, float] = {}
    named: dict[str, float] = {}
    for text in texts:
        name, equals, number = (part.strip() for part in text.partition("="))
        if equals:
            check_known("dimension", [name], units)
            if name in named:
                raise ValueError(f"{flag} gives {name} twice")
            named[name] = _positive(number, units[name], f"{flag} {name}")
        else:
            unit = _kind(text, flag)
            if unit in general:
                raise ValueError(f"{flag} gives two numbers in {', '.join(WRITTEN[unit])}")
            if unit not in units.values():
                what = {"m": "length", "rad": "angle"}[unit]
                raise ValueError(f"{flag} {text}: there is no {what} among {', '.join(units)}")
            general[unit] = _positive(text, unit, flag)
    return {name: general[unit] for name, unit in units.items() if unit in general} | named


def _kind(text: str, flag: str) -> str:
    """Return the SI unit, m or rad, that a number is given in."""
    for unit in ("m", "rad"):
        if any(text.strip().endswith(word) for word in WRITTEN[unit]) and _parses(text, unit):
            return unit
    raise ValueError(f"{flag} {text} is neither a length nor an angle: write 1mm, 0.5deg or l1=1mm")


def _parses(text: str, unit: str) -> bool:
    try:
        parse(text, unit)
    except ValueError:
        return False
    return True


def _positive(text: str, unit: str, what: str) -> float:
    value = parse(text, unit, what=what)
    if not value > 0.0:
        raise ValueError(f"{what} is {text}: it must be more than 0")
    return value


def grid_of(axes: Sequence[Any], most: int) -> npt.NDArray[np.intp] | None:
    """Return all combinations (n, k) of numbers of k axes, None where there are more than that."""
    if math.prod(len(axis) for axis in axes) > most:
        return None
    mesh = np.meshgrid(*axes, indexing="ij")
    return np.stack([axis.ravel() for axis in mesh], axis=-1)


def values_of(
    axes: Sequence[Axis | None], numbers: npt.NDArray[np.intp], held: FloatArray
) -> FloatArray:
    """Return the points (n, k) of numbers (n, k); coordinates without an axis stay as ``held``."""
    points = np.repeat(held[None], len(numbers), axis=0)
    for k, axis in enumerate(axes):
        if axis is not None:
            unique, back = np.unique(numbers[:, k], return_inverse=True)
            points[:, k] = np.array([axis.value(int(number)) for number in unique])[back]
    return points
