"""Motors and gears, and the one reader of a table of them."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pkm_gym.core.reading import about, is_number, read_toml, shaped
from pkm_gym.core.units import parse, show

WHAT = "motor table"


@dataclass(frozen=True)
class Motor:
    """A motor as its data sheet has it, in SI.

    Attributes:
        name: of the motor.
        torque: that it gives for ever, N m: the rms torque's limit.
        torque_peak: that it gives for a moment, N m.
        speed: the largest, rad/s.
        inertia: of the rotor, kg m^2.
        mass: kg.
    """

    name: str
    torque: float
    torque_peak: float
    speed: float
    inertia: float
    mass: float


@dataclass(frozen=True)
class Gear:
    """A gear with one of its ratios.

    Attributes:
        name: of the gear.
        ratio: motor's speed over drive's.
        torque_peak: the largest at its output, N m.
        speed: the largest at its input, rad/s.
        efficiency: share of the power that it hands on.
        inertia: at its input, kg m^2.
        mass: kg.
    """

    name: str
    ratio: float
    torque_peak: float
    speed: float
    efficiency: float
    inertia: float
    mass: float


DIRECT = Gear("none", 1.0, np.inf, np.inf, 1.0, 0.0, 0.0)

MOTOR_UNITS = {
    "torque": "N m", "torque_peak": "N m", "speed": "rad/s", "inertia": "kg m^2", "mass": "kg",
}  # fmt: skip
GEAR_UNITS = {
    "torque_peak": "N m", "speed": "rad/s", "efficiency": "", "inertia": "kg m^2", "mass": "kg",
}  # fmt: skip


class MotorTable(NamedTuple):
    """Motors, and gears with a row for each ratio, both from the lightest on."""

    motors: tuple[Motor, ...]
    gears: tuple[Gear, ...]


@dataclass(frozen=True)
class _MotorEntry:
    name: str
    torque: Any
    torque_peak: Any
    speed: Any
    inertia: Any
    mass: Any


@dataclass(frozen=True)
class _GearEntry:
    name: str
    ratios: list[float]
    torque_peak: Any
    speed: Any
    efficiency: Any
    inertia: Any
    mass: Any


@dataclass(frozen=True)
class _Entries:
    motor: list[_MotorEntry]
    gear: list[_GearEntry] | None = None


def read_motors(path: Path | Traversable | None = None) -> MotorTable:
    """Read a table of motors and gears; ours if none is named.

    A number is in SI, a text has its unit: ``speed = "3000rpm"``.

    Raises:
        ValueError: in one sentence that names the file, and the entry.
    """
    source = path or files("pkm_gym.core") / "motors.toml"
    content = read_toml(source, WHAT)
    with about(source, WHAT):
        entries = shaped(_Entries, content)
        motors = [
            Motor(entry.name, **_values(f"motor {entry.name!r}", entry, MOTOR_UNITS))
            for entry in entries.motor
        ]
        gears = [gear for entry in entries.gear or () for gear in _gears(entry)]
        _check(motors, entries)
    return MotorTable(
        tuple(sorted(motors, key=lambda motor: motor.mass)),
        tuple(sorted(gears, key=lambda gear: (gear.mass, gear.ratio))),
    )


def _gears(entry: _GearEntry) -> list[Gear]:
    at = f"gear {entry.name!r}"
    values = _values(at, entry, GEAR_UNITS)
    if values["efficiency"] > 1.0:
        raise ValueError(
            f"the efficiency of {at} is {values['efficiency']:g}: it must be at most 1"
        )
    if not entry.ratios or min(entry.ratios) < 1.0:
        raise ValueError(f"the ratios of {at} are {entry.ratios}: they must be numbers from 1 on")
    return [Gear(entry.name, ratio, **values) for ratio in entry.ratios]


def _values(at: str, entry: Any, units: dict[str, str]) -> dict[str, float]:
    """Return an entry's numbers in SI, all > 0."""
    values = {}
    for name, unit in units.items():
        said, what = getattr(entry, name), f"{name} of {at}"
        if not (isinstance(said, str) or is_number(said)):
            raise ValueError(f"{what} is {said!r}: it must be a number, or a text with its unit")
        values[name] = parse(said, unit, what=what) if isinstance(said, str) else float(said)
        if not values[name] > 0.0:
            raise ValueError(f"{what} is {said!r}: it must be greater than 0")
    return values


def _check(motors: list[Motor], entries: _Entries) -> None:
    if not motors:
        raise ValueError("it has no [[motor]]")
    for kind in (entries.motor, entries.gear or []):
        names = [entry.name for entry in kind]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"it names {', '.join(twice)} twice")
    for motor in motors:
        if motor.torque_peak < motor.torque:
            raise ValueError(
                f"torque_peak of motor {motor.name!r} is {show(motor.torque_peak, 'N m')}: it must "
                f"be at least its torque, {show(motor.torque, 'N m')}"
            )
