"""State: PyTorch's tensors and plain values in a file, read without unpickling code."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from math import inf
from pathlib import Path
from typing import Any

import torch

from pkm_gym.core.files import read_bytes, whole_file
from pkm_gym.core.reading import about, shaped

# What torch, SB3 and NumPy raise where a state is not that of the run.
MISFITS = (
    ArithmeticError, AssertionError, AttributeError, LookupError, RuntimeError, TypeError,
    ValueError,
)  # fmt: skip
REASON = 120  # letters that are said of it


def write_state(path: Path, state: Mapping[str, Any]) -> None:
    """Write tensors and plain values; the file appears whole or not at all."""
    with whole_file(path) as part:
        torch.save(dict(state), part)


def read_state(path: Path) -> dict[str, Any]:
    """Return what ``write_state`` wrote.

    Raises:
        ValueError: for a file that is missing or damaged.
    """
    if not path.exists():
        raise ValueError(f"there is no checkpoint {str(path)!r} to resume from")
    with about(path, "checkpoint"):
        content = BytesIO(read_bytes(path))
    try:
        state: dict[str, Any] = torch.load(content, weights_only=True)
    except Exception:  # zip, pickle and torch raise their own
        state = {}
    if not isinstance(state, dict) or not state:
        raise ValueError(f"{str(path)!r} is no checkpoint, or a damaged one")
    return state


@contextmanager
def restoring(path: Path) -> Iterator[None]:
    """Refuse what doesn't fit the run that is to go on.

    Raises:
        ValueError: in one sentence that names the file.
    """
    try:
        yield
    except MISFITS as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:REASON]
        raise ValueError(
            f"{str(path)!r} belongs to another recipe, or is damaged ({reason})"
        ) from None


def check_finite(values: Any, place: str) -> None:
    """Refuse tensors, nested in dicts and lists, with numbers that are not finite.

    Raises:
        ValueError: naming the place of the first.
    """
    if isinstance(values, dict | list | tuple):
        items = values.items() if isinstance(values, dict) else enumerate(values)
        for name, value in items:
            check_finite(value, f"{place}.{name}")
    elif isinstance(values, torch.Tensor) and not torch.isfinite(values).all():
        raise ValueError(f"{place} has numbers that are not finite")


def best_score(kept: Any) -> float:
    """Return the best score that a state holds: a number, or minus infinity before there is one.

    Raises:
        ValueError: for anything else.
    """
    return kept if kept == -inf else shaped(float, kept, "best")
