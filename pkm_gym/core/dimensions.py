"""Which dimensions make a machine, and dimensions that are given in place of variables."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from math import inf

from pkm_gym.core.compile import kernel

# A length (m) or a ratio outside this range makes no machine.
SMALLEST, LARGEST = 1e-3, 1e3


@kernel
def dimensions_violation(values: tuple[float, ...], shortfall: float) -> float:
    """Return > 0 where some of the values make no machine: from 1e-3, beyond any tolerance, to 1.

    ``shortfall`` is by how much too small a value must be to count as 1: 1 of a ratio, SMALLEST of
    a length.
    """
    smallest, largest = values[0], values[0]
    for value in values:
        if not math.isfinite(value):
            return 1.0
        smallest, largest = min(smallest, value), max(largest, value)
    excess = max((SMALLEST - smallest) / shortfall, largest / LARGEST - 1.0)
    return excess if excess <= 0.0 else min(1.0, excess + SMALLEST)


def no_machine(values: Mapping[str, float], unit: str = "") -> str:
    """Return the sentence that refuses values which make no machine."""
    shown = ", ".join(f"{name} = {value:g}" for name, value in values.items())
    bounds = f"{SMALLEST:g} and {LARGEST:g} {unit}".rstrip()
    return f"{shown}{unit and ' ' + unit} make no machine: each must lie between {bounds}"


def all_of(names: Sequence[str], given: Mapping[str, float], unit: str) -> dict[str, float]:
    """Return the named dimensions in their order, or nothing if none of them is given.

    Raises:
        ValueError: if some are missing, or something else stands beside them.
    """
    found = {name: given[name] for name in names if name in given}
    missing = [name for name in names if name not in given]
    more = [name for name in given if name not in found]
    if found and (missing or more):
        what = f"lacks {', '.join(missing)}" if missing else f"also has {', '.join(more)}"
        wanted = " and ".join([", ".join(names[:-1]), names[-1]])
        raise ValueError(f"a design in lengths ({unit}) needs just {wanted}: it {what}")
    return found


def positive(values: Mapping[str, float], unit: str) -> tuple[float, ...]:
    """Return the values, all finite and > 0.

    Raises:
        ValueError: naming them.
    """
    if not all(0.0 < value < inf for value in values.values()):
        shown = ", ".join(f"{value:g}" for value in values.values())
        raise ValueError(f"{', '.join(values)} are {shown} {unit}: all must be finite and > 0")
    return tuple(values.values())
