"""Files of what was trained: weights as safetensors and, beside them, all else as JSON."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from pkm_gym.core.files import read_bytes, whole_file
from pkm_gym.core.reading import about, read_json, shaped

T = TypeVar("T")

WEIGHTS = ".safetensors"
CONFIG = ".json"
FORMAT = 2


@dataclass(frozen=True)
class Head:
    """What every configuration begins and ends with: its format, and the weights' checksum."""

    format: int
    sha256: str


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
        pool: how many solved tasks it was trained on; None where an older file doesn't say.
    """

    env_id: str
    command: str
    steps: int
    score: float
    versions: Mapping[str, str]
    recorded: Mapping[str, Any] = field(default_factory=dict)
    pool: int | None = None


def write_pair(path: Path, config: Mapping[str, Any], tensors: Mapping[str, Any]) -> None:
    """Write a configuration and, beside it, the arrays whose sha256 it records.

    Each of the two files appears whole or not at all.
    """
    # safetensors writes an array's memory as it lies, whatever its strides
    weights = save({name: np.ascontiguousarray(array) for name, array in tensors.items()})
    whole = {"format": FORMAT, **config, "sha256": hashlib.sha256(weights).hexdigest()}
    with whole_file(path.with_suffix(WEIGHTS)) as part:
        part.write_bytes(weights)
    with whole_file(path) as part:
        part.write_text(json.dumps(whole, indent=2) + "\n", encoding="utf-8")


def read_pair(path: Path, kind: str, schema: type[T]) -> tuple[T, dict[str, Any]]:
    """Return configuration and tensors of ``write_pair``; nothing is unpickled.

    Args:
        path: of the configuration.
        kind: what they are of, for the errors.
        schema: dataclass of what the configuration holds beside its format and the checksum.

    Raises:
        ValueError: in one sentence, for a file that is missing, damaged or edited.
    """
    content = read_json(path, kind)
    with about(path, kind):
        head = shaped(Head, _part(content, Head))
        if head.format == FORMAT:
            config = shaped(schema, _part(content, schema, Head))
    if head.format != FORMAT:
        raise ValueError(f"{str(path)!r} has format {head.format}: this version reads {FORMAT}")
    return config, _tensors(path.with_suffix(WEIGHTS), path.name, head.sha256)


def _part(content: Any, schema: Any, *others: Any) -> Any:
    """Return the keys of a schema, or if others are given those that aren't theirs."""
    if not isinstance(content, dict):
        return content
    own, their = (
        {item.name for one in some for item in fields(one)} for some in ([schema], others)
    )
    return {k: x for k, x in content.items() if (k not in their if others else k in own)}


def _tensors(path: Path, recorded_in: str, sha256: str) -> dict[str, Any]:
    with about(path, "weights"):
        weights = read_bytes(path)
    if hashlib.sha256(weights).hexdigest() != sha256:
        raise ValueError(
            f"{str(path)!r} is damaged or was edited: its sha256 is not the one that {recorded_in} "
            "records"
        )
    with about(path, "weights"):
        try:
            tensors = load(weights)
        except (SafetensorError, KeyError, TypeError, ValueError) as error:
            raise ValueError(f"they can't be read ({error})") from None
        for name, array in tensors.items():
            if not np.isfinite(array).all():
                raise ValueError(f"{name} has numbers that are not finite")
    return tensors
