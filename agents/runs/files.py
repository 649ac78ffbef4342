"""Files of what was trained: weights as safetensors and, beside them, all else as JSON."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.numpy import load

from pkm_gym.core.files import whole_file

WEIGHTS = ".safetensors"
CONFIG = ".json"
FORMAT = 2


@dataclass(frozen=True)
class Origin:
    """Where a designer comes from.

    Attributes:
        env_id: of the environment it was trained in.
        command: that trained it.
        steps: evaluations it was trained with.
        score: its score on the validation tasks.
        versions: of the libraries.
        recorded: what it must reproduce, see ``pkm-gym zoo``.
    """

    env_id: str
    command: str
    steps: int
    score: float
    versions: Mapping[str, str]
    recorded: Mapping[str, Any] = field(default_factory=dict)


def write_pair(path: Path, config: Mapping[str, Any], weights: bytes) -> None:
    """Write a configuration and, beside it, the weights whose sha256 it records.

    Each of the two files appears whole or not at all.
    """
    whole = {"format": FORMAT, **config, "sha256": hashlib.sha256(weights).hexdigest()}
    with whole_file(path.with_suffix(WEIGHTS)) as part:
        part.write_bytes(weights)
    with whole_file(path) as part:
        part.write_text(json.dumps(whole, indent=2) + "\n", encoding="utf-8")


def read_pair(
    path: Path, kind: str, needed: Iterable[str]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return configuration and tensors of ``write_pair``; nothing is unpickled.

    Args:
        path: of the configuration.
        kind: what they are of, for the errors.
        needed: names that the configuration must have.

    Raises:
        ValueError: in one sentence, for a file that is missing, damaged or edited.
    """
    config = _config(path, kind, needed)
    weights = _read(path.with_suffix(WEIGHTS), kind)
    if hashlib.sha256(weights).hexdigest() != config["sha256"]:
        raise ValueError(
            f"{str(path.with_suffix(WEIGHTS))!r} is damaged or was edited: its sha256 is not the "
            f"one that {path.name} records"
        )
    try:
        return config, load(weights)
    except SafetensorError:
        raise ValueError(
            f"{str(path.with_suffix(WEIGHTS))!r} holds no weights: it is no safetensors file"
        ) from None


def _config(path: Path, kind: str, needed: Iterable[str]) -> dict[str, Any]:
    try:
        config: dict[str, Any] = json.loads(_read(path, kind))
    except (UnicodeDecodeError, json.JSONDecodeError):
        raise ValueError(f"{str(path)!r} is damaged: it is no JSON file") from None
    missing = [name for name in needed if not isinstance(config, dict) or name not in config]
    if missing:
        raise ValueError(f"{str(path)!r} is no {kind}: it lacks {', '.join(missing)}")
    if config["format"] != FORMAT:
        raise ValueError(
            f"{str(path)!r} has format {config['format']!r}: this version reads {FORMAT}"
        )
    return config


def _read(path: Path, kind: str) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise ValueError(f"can't read the {kind} {str(path)!r}: {error.strerror}") from None
