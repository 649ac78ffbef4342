"""State: PyTorch's tensors and plain values in a file, read without unpickling code."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from pkm_gym.core.files import whole_file


def write_state(path: Path, state: Mapping[str, Any]) -> None:
    """Write tensors and plain values; the file appears whole or not at all."""
    with whole_file(path) as part:
        torch.save(dict(state), part)


def read_state(path: Path) -> dict[str, Any]:
    """Return what ``write_state`` wrote.

    Raises:
        ValueError: for a file that is missing or damaged.
    """
    try:
        state: dict[str, Any] = torch.load(path, weights_only=True)
    except FileNotFoundError:
        raise ValueError(f"there is no checkpoint {str(path)!r} to resume from") from None
    except Exception:  # zip, pickle and torch raise their own
        raise ValueError(f"{str(path)!r} is no checkpoint, or a damaged one") from None
    return state
