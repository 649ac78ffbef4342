"""Rows: what kernels read and write by name, each declared once as a class.

``Design``, ``Indices`` and ``Limits`` of a mechanism are ``NamedTuple`` classes whose fields are
annotated with ``variable``, ``index`` and ``own``; a Task declares its fields with ``quantity``.
Kernels get plain float64 arrays: inside the compiled loop ``tasks.view(TASK)[i, 0].payload`` reads
a field, with ``TASK = record(Task)``, and what they return is ``Indices(tau_G=...)`` and
``Limits(reach=...)``, so that a name that is forgotten or unknown fails when it is compiled.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar, get_args, get_type_hints

import numpy as np

from pkm_gym.core.task import Task, Variable
from pkm_gym.core.types import FloatArray

Row = TypeVar("Row")


@dataclass(frozen=True)
class Index:
    """A named performance number of a design.

    ``reported`` is False for a quantity that only limits and maps are about; with the name of an
    option the index is reported, and measured, where that option is on. ``compared`` says that it
    is a ratio to a machine of a given size, so that it isn't the same in another size.
    """

    name: str
    unit: str
    doc: str
    reported: bool | str = True
    compared: bool = False


@dataclass(frozen=True)
class Own:
    """A limit that the mechanism's kernel fills itself, and whose words the mechanism says."""

    name: str
    doc: str


class Measured(NamedTuple):
    """What a mechanism's kernel fills for n designs."""

    table: FloatArray  # (n, all indices), NaN where undefined
    own: FloatArray  # (n, own limits), scaled violations, > 0 where broken, NaN where undefined
    unreached: FloatArray  # (n,), > 0 where the indices are undefined: the workspace isn't reached
    scales: FloatArray  # (n,), estimate of the first objective at the task's optimum


class Dimension(NamedTuple):
    """A derived dimension with its unit."""

    value: float
    unit: str


def variable(
    low: float,
    high: float,
    unit: str,
    doc: str,
    *,
    default: float | str | None = None,
    searched: bool = True,
    step: float = 0.01,
    scanned: bool = False,
) -> Variable:
    """Declare a field of a Design: search bounds, unit, what it is.

    Args:
        low: least value of the search.
        high: greatest value of the search.
        unit: SI.
        doc: what it is, in a few words.
        default: its value where it isn't searched, or the name of the variable that it equals
            then; that of the paper's design if not given.
        searched: whether it is searched unless ``free`` says otherwise.
        step: of our grid.
        scanned: whether the paper prints the values that it has in the grid.
    """
    return Variable("", low, high, unit, doc, default, searched, step, scanned)


def index(unit: str, doc: str, *, reported: bool | str = True, compared: bool = False) -> Index:
    """Declare a field of an Indices: unit and what it is; see ``Index``."""
    return Index("", unit, doc, reported, compared)


def own(doc: str) -> Own:
    """Declare a field of a Limits: what is checked, in a few words."""
    return Own("", doc)


def declared(row: type, kind: type[Any]) -> tuple[Any, ...]:
    """Return what the fields of a row class are annotated with, each with its name.

    Raises:
        TypeError: for a field without such an annotation.
    """
    found = []
    for name, hint in get_type_hints(row, include_extras=True).items():
        said = next((item for item in get_args(hint)[1:] if isinstance(item, kind)), None)
        if said is None:
            raise TypeError(f"{row.__name__}.{name} is not annotated with a {kind.__name__}")
        found.append(replace(said, name=name))
    return tuple(found)


def record(row: type) -> np.dtype[np.void]:
    """Return the record type of a Task's or a Design's packed rows: ``rows.view(type)[i, 0]``."""
    names = row.names() if issubclass(row, Task) else tuple(get_type_hints(row))
    return np.dtype([(name, np.float64) for name in names])


def undefined(row: Callable[..., Row]) -> Row:
    """Return a row of NaN."""
    return row(*[math.nan] * len(get_type_hints(row)))
