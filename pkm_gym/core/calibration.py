"""Calibration: what merit must know of a problem, as ``pkm-gym calibrate`` keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from pkm_gym.core.reading import about, read_toml, shaped

FILE = "calibration.toml"

# What holds for a problem that nobody has calibrated.
SCALE, PENALTY_WEIGHT, WORST = 1.0, 10.0, 1e6


def package_file(package: str, name: str) -> Traversable | None:
    """Return a file of a package, or None where there is no such file or package."""
    try:
        found = files(package).joinpath(name)
    except (ModuleNotFoundError, TypeError, ValueError):
        return None
    there = found.exists() if isinstance(found, Path) else found.is_file()
    return found if there else None


@dataclass(frozen=True)
class _Objective:
    """What the file keeps of an objective."""

    worst: float = WORST
    scale: float = SCALE
    powers: Mapping[str, float] = field(default_factory=dict)
    rates: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class _Problem:
    """What the file keeps of a problem."""

    command: str = ""
    penalty_weight: float = PENALTY_WEIGHT
    objectives: Mapping[str, _Objective] = field(default_factory=dict)


def calibration(package: str, problem: str) -> Mapping[str, Any]:
    """Return what a package's calibration says of a problem, nothing where it says nothing.

    Raises:
        ValueError: in one sentence, for a file that can't be read or holds no such numbers.
    """
    source = package_file(package, FILE)
    if source is None:
        return {}
    try:
        found: Mapping[str, Any] = read_toml(source, "calibration").get(problem, {})
        with about(source, "calibration"):
            shaped(_Problem, found, problem)
    except ValueError as error:
        raise ValueError(f"{error}; make it again with `pkm-gym calibrate {problem}`") from None
    return found
