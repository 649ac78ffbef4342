"""Units at the edge: text with a unit in, SI inside, mm and degrees out."""

from __future__ import annotations

import math
import re

# SI unit -> what a person may write instead, and how many of it make one SI unit.
WRITTEN: dict[str, dict[str, float]] = {
    "": {"": 1.0},
    "m": {"m": 1.0, "cm": 100.0, "mm": 1000.0},
    "rad": {"rad": 1.0, "deg": 180.0 / math.pi},
    "kg": {"kg": 1.0, "g": 1000.0},
    "s": {"s": 1.0, "ms": 1000.0},
    "rad/s": {"rad/s": 1.0, "deg/s": 180.0 / math.pi, "rpm": 30.0 / math.pi},
    "N m": {"N m": 1.0, "Nm": 1.0},
    "W": {"W": 1.0, "kW": 1e-3},
    "N": {"N": 1.0, "kN": 1e-3},
    "m^2": {"m^2": 1.0, "cm^2": 1e4, "mm^2": 1e6},
    "kg/m": {"kg/m": 1.0, "g/mm": 1.0, "g/m": 1000.0},
    "kg/m^3": {"kg/m^3": 1.0, "g/cm^3": 1e-3},
    "kg m^2": {"kg m^2": 1.0, "kgm^2": 1.0, "kg cm^2": 1e4, "kgcm^2": 1e4, "g cm^2": 1e7},
}

# SI unit -> the unit that people read, and its decimals.
SHOWN = {"m": ("mm", 1), "rad": ("deg", 2)}

NUMBER = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*", re.DOTALL)


def parse(text: str, unit: str, *, what: str = "the value") -> float:
    """Return a number with or without a unit, such as "150mm", in SI.

    Args:
        text: a number, alone (SI) or followed by a unit of the same kind.
        unit: the SI unit that is wanted, "" for a plain number.
        what: the name that an error gives to the value.

    Raises:
        ValueError: in one sentence, for no finite number or a unit that is unknown or of another
            kind.
    """
    known = WRITTEN.get(unit, {unit: 1.0})
    match = NUMBER.fullmatch(text)
    if match is None or not math.isfinite(float(match[1])):
        example = f"250mm or 0.25 ({unit})" if unit == "m" else f"0.25{unit}"
        raise ValueError(f"{what} is {text!r}: it must be a finite number, such as {example}")
    number, written = float(match[1]), match[2]
    if not written:
        return number
    if written not in known:
        allowed = ", ".join(known)
        kind = f"it is measured in {allowed}" if unit else "it is a plain number without unit"
        raise ValueError(f"{what} is {text!r}: {written!r} is no unit of it, {kind}")
    return number / known[written]


def converted(value: float, unit: str) -> tuple[float, str]:
    """Return a value in SI, and its unit, in what people read: mm for m, deg for rad."""
    if unit not in SHOWN:
        return value, unit
    name, _ = SHOWN[unit]
    return value * WRITTEN[unit][name], name


def span(low: float, high: float, unit: str) -> str:
    """Return a range in SI as people read it, without the unit: "80 to 160"."""
    return " to ".join(f"{converted(value, unit)[0]:.4g}" for value in (low, high))


def shown(value: float, unit: str) -> tuple[str, str]:
    """Return the number and the unit that people read, the number as text."""
    if not math.isfinite(value):
        return "undefined", ""
    number, name = converted(value, unit)
    return (f"{number:.{SHOWN[unit][1]}f}" if unit in SHOWN else f"{number:.4g}"), name


def show(value: float, unit: str) -> str:
    """Return a value in SI as people read it: "150.0 mm", "45.00 deg", "0.3391 N m"."""
    return " ".join(shown(value, unit)).rstrip()
