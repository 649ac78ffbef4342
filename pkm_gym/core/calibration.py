"""Calibration: what merit must know of a problem, as ``pkm-gym calibrate`` keeps it."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from math import isfinite
from typing import Any

from pkm_gym.core.files import read_toml

FILE = "calibration.toml"

# What holds for a problem that nobody has calibrated.
SCALE, PENALTY_WEIGHT, WORST = 1.0, 10.0, 1e6


def package_file(package: str, name: str) -> Traversable | None:
    """Return a file of a package, or None where there is no such file or package."""
    try:
        found = files(package).joinpath(name)
    except (ModuleNotFoundError, TypeError, ValueError):
        return None
    return found if found.is_file() else None


def calibration(package: str, problem: str) -> Mapping[str, Any]:
    """Return what a package's calibration says of a problem, nothing where it says nothing.

    Raises:
        ValueError: in one sentence, for a file that can't be read or holds no such numbers.
    """
    source = package_file(package, FILE)
    if source is None:
        return {}
    again = f"make it again with `pkm-gym calibrate {problem}`"
    try:
        found: Mapping[str, Any] = read_toml(source, "calibration").get(problem, {})
    except ValueError as error:
        raise ValueError(f"{error}; {again}") from None
    for numbers in (found, *found.get("objectives", {}).values()):
        for name in ("penalty_weight", "worst", "scale"):
            value = numbers.get(name, 1.0)
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if not (number and isfinite(value)):
                raise ValueError(f"{source} has {name} = {value!r}, no finite number: {again}")
    return found
