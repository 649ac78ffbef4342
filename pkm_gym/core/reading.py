"""Files that people and other runs wrote: read as what they should be, or refused by their name."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, fields, is_dataclass
from importlib.resources.abc import Traversable
from math import isfinite
from pathlib import Path
from reprlib import repr as short
from types import UnionType
from typing import Any, NoReturn, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np
import numpy.typing as npt

from pkm_gym.core.files import check_regular, read_bytes
from pkm_gym.core.names import check_known

T = TypeVar("T")

WORDS = {
    str: "a text",
    bool: "true or false",
    int: "a whole number",
    float: "a finite number",
}
KINDS = {
    "f": "decimal numbers",
    "f8": "decimal numbers (float64)",
    "iu": "whole numbers",
    "iuf": "numbers",
    "b": "true or false",
    "U": "text",
}  # of dtypes


@contextmanager
def about(path: object, what: str) -> Iterator[None]:
    """Have what is wrong with a file begin with the file, and with what it should be.

    Raises:
        ValueError: in one sentence.
    """
    try:
        yield
    except OSError as error:
        raise ValueError(
            f"can't read the {what} {str(path)!r}: {error.strerror or error}"
        ) from None
    except UnicodeDecodeError:
        raise ValueError(f"{str(path)!r} is no {what}: it is not UTF-8 text") from None
    except RecursionError:
        raise ValueError(f"{str(path)!r} is no {what}: it is nested too deeply") from None
    except ValueError as error:
        raise ValueError(f"{str(path)!r} is no {what}: {error}") from None


def read_text(path: Path | Traversable, what: str) -> str:
    """Return a text, in UTF-8.

    Args:
        path: of the file, which may be a package's.
        what: it should be, for the errors.

    Raises:
        ValueError: in one sentence that names the file.
    """
    with about(path, what):
        content = read_bytes(path) if isinstance(path, Path) else path.read_bytes()
        return content.decode("utf-8")


def read_toml(path: Path | Traversable, what: str) -> dict[str, Any]:
    """Return the tables of a TOML file; see ``read_text``.

    Raises:
        ValueError: in one sentence that names the file.
    """
    text = read_text(path, what)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"at (line \d+, column \d+|end of document)", str(error))
        where = f", see {place[1].replace('end of document', 'its end')}" if place else ""
        raise ValueError(f"{str(path)!r} is no {what}: it is no TOML{where}") from None


def read_json(path: Path, what: str) -> Any:
    """Return what a JSON file holds; see ``read_text``.

    Raises:
        ValueError: in one sentence that names the file.
    """
    text = read_text(path, what)
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        raise ValueError(f"{str(path)!r} is damaged: it is no JSON file") from None


def read_npz(path: Path, wanted: str) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of an npz file; nothing is unpickled.

    Args:
        path: of the file.
        wanted: what was expected, for the errors.

    Raises:
        ValueError: in one sentence that names the file.
    """
    try:
        check_regular(path)
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError:
        reason = "does not exist"
    except OSError as error:
        reason = f"cannot be read ({error.strerror or error})"
    except Exception:  # zip, zlib, npy headers and pickles: each raises its own
        reason = "is damaged or no npz file"
    raise ValueError(f"{str(path)!r} {reason}: {wanted}")


def is_number(value: Any) -> bool:
    """Whether something is a finite number that a float can hold, and no truth value."""
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    try:
        return isfinite(value)
    except OverflowError:  # a whole number of hundreds of digits
        return False


def shaped(kind: type[T], content: Any, at: str = "") -> T:
    """Return content as a type says: a dataclass, a mapping, a list or tuple, a plain value.

    A whole number is a number, too; one that is infinite or NaN is none. What is of type Any is
    taken as it is.

    Args:
        kind: the type.
        content: as TOML or JSON gives it.
        at: its place in the file, for the errors.

    Raises:
        ValueError: in one sentence: what is missing, unknown or of another type, its value, and
            what it must be.
    """
    made: Any = content
    origin, inner = get_origin(kind), get_args(kind)
    if origin in (Union, UnionType):
        made = None if content is None else shaped(inner[0], content, at)
    elif is_dataclass(kind):
        made = _record(kind, content, at)
    elif origin is not None and issubclass(origin, Mapping):
        if not isinstance(content, dict):
            _refuse(content, "a table", at)
        made = {key: shaped(inner[1], value, _inside(at, key)) for key, value in content.items()}
    elif origin in (list, tuple):
        if not isinstance(content, list):
            _refuse(content, "a list", at)
        made = origin(shaped(inner[0], value, f"{at}[{i}]") for i, value in enumerate(content))
    elif kind is not Any:
        made = _plain(kind, content, at)
    return made


def _record(kind: Any, content: Any, at: str) -> Any:
    if not isinstance(content, dict):
        _refuse(content, "a table", at)
    types, known = get_type_hints(kind), {item.name: item for item in fields(kind)}
    check_known("key" if not at else f"key of {at}", content, known)
    needed = [
        name
        for name, item in known.items()
        if item.default is MISSING and item.default_factory is MISSING
    ]
    if missing := [_inside(at, name) for name in needed if name not in content]:
        raise ValueError(f"it lacks {', '.join(missing)}")
    return kind(**{k: shaped(types[k], value, _inside(at, k)) for k, value in content.items()})


def _plain(kind: Any, content: Any, at: str) -> Any:
    if kind is float and is_number(content):
        return float(content)
    if kind is int and is_number(content) and isinstance(content, int):
        return content
    if kind not in (float, int) and isinstance(content, kind):
        return content
    return _refuse(content, WORDS[kind], at)


def _inside(at: str, key: str) -> str:
    return f"{at}.{key}" if at else key


def _refuse(content: Any, wanted: str, at: str) -> NoReturn:
    raise ValueError(f"{at or 'it'} is {short(content)}: it must be {wanted}")


def check_arrays(
    arrays: Mapping[str, npt.NDArray[Any]], wanted: Mapping[str, tuple[str, tuple[int | str, ...]]]
) -> None:
    """Refuse arrays that are missing, of another type or shape.

    Args:
        arrays: by name.
        wanted: name -> letters of the dtypes' kinds, and the shape, in which a size that has a
            name is the same wherever the name stands.

    Raises:
        ValueError: in one sentence: which, what it is, and what it must be.
    """
    if missing := [name for name in wanted if name not in arrays]:
        raise ValueError(f"it lacks {', '.join(missing)}")
    sizes: dict[str, int] = {}
    for name, (kinds, shape) in wanted.items():
        array = arrays[name]
        own = zip(shape, array.shape, strict=False)
        held = tuple(sizes.setdefault(s, n) if isinstance(s, str) else s for s, n in own)
        fits = array.dtype == float if kinds == "f8" else array.dtype.kind in kinds
        if not fits or array.ndim != len(shape) or array.shape != held:
            asked = ", ".join(f"{sizes.get(str(s), s)}" for s in shape)
            raise ValueError(
                f"{name} is {array.dtype} of shape {array.shape}: it must be {KINDS[kinds]} of "
                f"shape ({asked})"
            )
