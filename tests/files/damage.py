"""Ways to damage a file: bytes, keys, numbers, and what stands in its place."""

from __future__ import annotations

import copy
import io
import json
import os
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
import torch

WRONG = (None, True, -1, 10**400, float("nan"), float("inf"), "x", [], [[]], {}, {"x": {}})
FLIPS, CUTS = 6, 4


def bytes_of(content: bytes, rng: np.random.Generator) -> Iterator[tuple[str, bytes]]:
    """Yield damaged bytes, each with what was done: cut off, flipped, none, not UTF-8."""
    yield "empty", b""
    yield "not UTF-8", b"\xff\xfe" + content
    yield "spaces", b" \n"
    for at in rng.integers(1, len(content), CUTS).tolist():
        yield f"cut at {at}", content[:at]
    for at in rng.integers(0, len(content), FLIPS).tolist():
        yield f"flipped at {at}", content[:at] + bytes([content[at] ^ 0xFF]) + content[at + 1 :]
        yield f"bit at {at}", content[:at] + bytes([content[at] ^ 0x04]) + content[at + 1 :]


def tables_of(table: Any, place: str = "") -> Iterator[tuple[str, Any]]:
    """Yield a table with a key less or of another type, at any depth, with what was done."""
    for key, value in list(table.items()) if isinstance(table, dict) else []:
        at = f"{place}.{key}"
        yield f"without {at}", {k: x for k, x in table.items() if k != key}
        for wrong in WRONG:
            yield f"{at} = {str(wrong)[:9]}", {**table, key: wrong}
        for said, changed in tables_of(value, at):
            yield said, {**table, key: changed}
    if isinstance(table, dict):
        yield f"more in {place}", {**table, "more": 1}


def as_toml(table: Any) -> bytes:
    return tomli_w.dumps(_without_none(table)).encode()


def as_json(table: Any) -> bytes:
    return json.dumps(table).encode()


def as_npz(arrays: dict[str, Any]) -> bytes:
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def as_tensors(table: Any) -> bytes:
    file = io.BytesIO()
    torch.save(table, file)
    return file.getvalue()


def arrays_of(arrays: dict[str, np.ndarray]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield arrays with one less, or one of another shape, type or with NaN."""
    for name, array in arrays.items():
        yield f"without {name}", {k: a for k, a in arrays.items() if k != name}
        changed: dict[str, Any] = {
            "shorter": array[:-1] if array.ndim else np.array([array]),
            "deeper": array[..., None],
            "none": np.zeros(0),
            "a number": np.array(3.0),
            "a text": np.array("x"),
            "objects": np.array([{}]),
        }
        if array.dtype.kind == "f":
            changed["NaN"] = np.full_like(array, np.nan)
        if array.dtype.kind in "iu":
            changed["negative"] = -array - 1
        for said, other in changed.items():
            yield f"{name} {said}", {**arrays, name: other}


def of_file(path: Path, rng: np.random.Generator) -> Iterator[tuple[str, bytes]]:
    """Yield damaged contents of a file, by what its name says it is."""
    content = path.read_bytes()
    yield from bytes_of(content, rng)
    if path.suffix == ".toml":
        table = tomllib.loads(content.decode())
        yield from ((said, as_toml(t)) for said, t in tables_of(table) if writable(t))
    elif path.suffix == ".json":
        table = json.loads(content)
        yield from ((said, as_json(t)) for said, t in [*tables_of(table), ("a list", [table])])
    elif path.suffix == ".pt":
        table = torch.load(path, weights_only=True)
        yield from ((said, as_tensors(t)) for said, t in tables_of(table))
    elif path.suffix in (".npz", ".part"):
        with np.load(path) as archive:
            arrays = dict(archive)
        yield from ((said, as_npz(a)) for said, a in arrays_of(arrays))


def some(path: Path, most: int, seed: int = 5) -> list[tuple[str, bytes]]:
    """Return so many damaged contents of a file, drawn from all, the first ones always."""
    rng = np.random.default_rng(seed)
    ways = list(of_file(path, rng))
    first = 3 + CUTS + 2 * FLIPS
    drawn = rng.permutation(np.arange(first, len(ways)))[: max(0, most - first)]
    return [*ways[:first], *(ways[i] for i in sorted(drawn.tolist()))]


def replace(path: Path, kind: str) -> None:
    """Put a folder, a pipe, a device or nothing in the place of a file."""
    shutil.rmtree(path) if path.is_dir() else path.unlink(missing_ok=True)
    if kind == "folder":
        path.mkdir()
    elif kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")


def writable(table: Any) -> bool:
    try:
        as_toml(copy.deepcopy(table))
    except (TypeError, ValueError):
        return False
    return True


def _without_none(table: Any) -> Any:
    if isinstance(table, dict):
        return {k: _without_none(x) for k, x in table.items() if x is not None}
    return table
