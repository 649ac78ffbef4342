"""Dimensions given in place of variables: all of a set, and nothing beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf


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
