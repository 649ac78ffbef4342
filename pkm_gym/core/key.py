"""What the numbers of a compiled kernel depend on: all that the compiler reads of the sources."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba.core.dispatcher import Dispatcher

# What stands in these is told by their versions.
LIBRARIES = {"builtins", "cmath", "llvmlite", "math", "numba", "numpy", "operator", "scipy"}


def ingredients(dispatcher: Any) -> list[str]:
    """Return, in words, what a kernel is compiled from.

    Its flags and code, and those of every kernel that it calls, in whatever package; the values of
    the constants and the fields of the classes that they name, in whatever file.
    """
    return list(_parts(dispatcher, set(), ()))


def _parts(value: Any, seen: set[Any], names: tuple[str, ...]) -> Iterator[str]:
    """Yield what a global value says; ``names`` are those that the code takes of a module."""
    if isinstance(value, Dispatcher):
        yield from (f"{flag} {_text(value.targetoptions[flag])}" for flag in value.targetoptions)
        yield from _parts(value.py_func, seen, ())
    elif _of_library(value):
        yield _text(getattr(value, "__qualname__", value))
    elif isinstance(value, FunctionType) and value not in seen:
        seen.add(value)
        yield from _function(value, seen)
    elif isinstance(value, ModuleType) and (value, names) not in seen:
        seen.add((value, names))
        yield from _named(vars(value), names, seen)
    elif isinstance(value, type):
        yield from _class(value)
    elif isinstance(value, tuple):
        yield from _class(type(value))
        for item in value:
            yield from _parts(item, seen, names)
    elif isinstance(value, np.ndarray):
        yield f"{value.dtype} {value.shape} {value.tobytes().hex()}"
    elif hasattr(value, "_dispatcher"):  # of numba.vectorize
        yield from _parts(value._dispatcher, seen, ())
    else:
        yield _text(value)


def _function(function: FunctionType, seen: set[Any]) -> Iterator[str]:
    yield f"{function.__module__}.{function.__qualname__}"
    names: list[str] = []
    yield from _code(function.__code__, names)
    cells = {
        name: cell.cell_contents
        for name, cell in zip(
            function.__code__.co_freevars, function.__closure__ or (), strict=True
        )
    }
    defaults = {**(function.__kwdefaults__ or {}), "defaults": function.__defaults__ or ()}
    yield from _named({**defaults, **cells}, (*cells, *defaults), seen)
    yield from _named(function.__globals__, tuple(names), seen)


def _code(code: CodeType, names: list[str]) -> Iterator[str]:
    """Yield the code, and add the names of globals and attributes in it to ``names``."""
    names.extend(code.co_names)
    yield repr((code.co_code, code.co_names, code.co_varnames, code.co_freevars, code.co_cellvars))
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _code(constant, names)
        else:
            yield _text(constant)


def _named(space: dict[str, Any], names: tuple[str, ...], seen: set[Any]) -> Iterator[str]:
    for name in names:
        if name in space:
            yield name
            yield from _parts(space[name], seen, names)


def _class(kind: type) -> Iterator[str]:
    """Yield a class: its fields or members; of any other kind its whole file."""
    yield f"{kind.__module__}.{kind.__qualname__}"
    if issubclass(kind, tuple):
        yield _text((getattr(kind, "_fields", ()), getattr(kind, "_field_defaults", ())))
    elif issubclass(kind, Enum):
        yield _text(list(kind))
    else:
        source = getattr(sys.modules.get(kind.__module__), "__file__", None)
        yield Path(source).read_text(encoding="utf-8") if source and Path(source).is_file() else ""


def _of_library(value: Any) -> bool:
    """Return whether a function, class or module is one that versions tell all about."""
    home = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None)
    named = isinstance(value, ModuleType) or hasattr(value, "__qualname__")
    return named and str(home).partition(".")[0] in LIBRARIES


def _text(value: Any) -> str:
    """Return the repr of a value, the same in every process: sets in order, without addresses."""
    if isinstance(value, set | frozenset):
        return repr(sorted(map(repr, value)))
    return re.sub(r" at 0x[0-9a-fA-F]+", "", repr(value))
