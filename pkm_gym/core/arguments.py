"""What a design problem is given, checked: objectives, options, designs, tasks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from pkm_gym.core.declaration import Declaration, Objective
from pkm_gym.core.limit import Limit
from pkm_gym.core.names import check_known
from pkm_gym.core.options import Options
from pkm_gym.core.rows import Index
from pkm_gym.core.task import Task, Variable
from pkm_gym.core.types import FloatArray


def chosen_objectives(
    declared: Sequence[Objective], names: str | Iterable[str] | None
) -> tuple[Objective, ...]:
    """Return the named ones of the declared objectives, the first if None are named.

    Raises:
        ValueError: for an unknown name, with its closest match, one that comes twice, or none.
    """
    known = {objective.name: objective for objective in declared}
    if names is None:
        return tuple(declared[:1])
    chosen: tuple[Any, ...] = (names,)
    if isinstance(names, Iterable) and not isinstance(names, str):
        chosen = tuple(names)
    if not chosen or len(set(chosen)) < len(chosen):
        raise ValueError(f"objective is {names!r}: name one or several different objectives")
    check_known("objective", chosen, known)
    return tuple(known[name] for name in chosen)


def chosen_options(
    declared: Declaration, objectives: Iterable[Objective], given: Mapping[str, Any]
) -> Options:
    """Return the options given, with those on that the indices of objectives and limits need.

    Raises:
        ValueError: for an unknown option, with its closest match, or an illegal value.
    """
    options = declared.options.of(given)
    names = {objective.name for objective in objectives}
    names |= {limit.quantity for limit in limits_given(declared, options)}
    needed = {
        item.reported: True
        for item in declared.index_table
        if item.name in names and isinstance(item.reported, str)
    }
    return replace(options, **needed) if needed else options


def limits_given(declared: Declaration, options: Options) -> tuple[Limit, ...]:
    """Return the limits that the options ask for, their bounds numbers."""
    bounds = [getattr(options, str(limit.bound)) for limit in declared.option_limits]
    return tuple(
        replace(limit, bound=bound)
        for limit, bound in zip(declared.option_limits, bounds, strict=True)
        if bound is not None
    )


def reported_indices(table: Iterable[Index], options: Options) -> tuple[Index, ...]:
    """Return the indices that are reported with these options."""

    def reports(said: bool | str) -> bool:
        return bool(getattr(options, said)) if isinstance(said, str) else said

    return tuple(item for item in table if reports(item.reported))


def checked_designs(designs: FloatArray, variables: Sequence[Variable]) -> FloatArray:
    """Return designs as a contiguous array (n, d) of float64.

    Raises:
        ValueError: for a wrong shape or type.
    """
    array = np.asarray(designs)
    if array.dtype.kind not in "fiu" or array.ndim != 2 or array.shape[1] != len(variables):
        raise ValueError(
            f"designs must be numbers of shape (n, {len(variables)}), columns "
            f"{', '.join(v.name for v in variables)}: got {array.dtype} of shape {array.shape}"
        )
    return np.ascontiguousarray(array, dtype=np.float64)


def packed_tasks(
    tasks: Task | Mapping[str, float] | FloatArray, kind: type[Task], shape: tuple[int, int]
) -> FloatArray:
    """Return one task, or packed tasks of a shape (n, m) or (1, m), as a contiguous array.

    Raises:
        ValueError: for a wrong shape or type, or a number outside its legal range.
        TypeError: for a task of another kind.
    """
    if isinstance(tasks, Task | Mapping):
        return kind.of(tasks).pack()[None, :]
    rows = np.asarray(tasks)
    if rows.dtype.kind not in "fiu" or rows.shape not in (shape, (1, shape[1])):
        raise ValueError(
            f"tasks must be one task or packed tasks of shape {shape}: got {rows.dtype} of shape "
            f"{rows.shape}"
        )
    rows = np.ascontiguousarray(rows, dtype=np.float64)
    kind.check_rows(rows)
    return rows
