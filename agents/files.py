"""Designer files: weights as safetensors, all else as JSON beside them, checked before use."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.numpy import load, save

from pkm_gym.agents.designer import Centre, Designer, Policy
from pkm_gym.agents.network import Network
from pkm_gym.agents.planner import Planner
from pkm_gym.benchmark.interpolation import Interpolation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.envs.observation import observation_layout
from pkm_gym.envs.rules import Rules
from pkm_gym.mechanisms import make_problem

WEIGHTS = ".safetensors"
CONFIG = ".json"
FORMAT = 2
NEEDED = ("format", "problem", "arguments", "hash", "layout", "rules", "policy", "sha256")


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


def layout_hash(problem: DesignProblem) -> str:
    """Return the sha256 of the parts of an observation and their places."""
    parts = {name: [at.start, at.stop] for name, at in observation_layout(problem).items()}
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def write_designer(
    designer: Designer, path: Path, origin: Origin, arguments: Mapping[str, Any]
) -> None:
    """Write a designer; each of its two files appears whole or not at all.

    Args:
        designer: to be written.
        path: of the configuration, ``NAME.json``; the weights go to ``NAME.safetensors``.
        origin: kept with it.
        arguments: of its problem, as ``make_problem`` takes them.
    """
    policy = designer.policy
    tensors: dict[str, Any] = {f"policy.{name}": a for name, a in policy.tensors().items()}
    interpolated = isinstance(designer.starts, Interpolation)
    if isinstance(designer.starts, Interpolation):
        tensors |= designer.starts.tensors()
    weights = save(tensors)
    config = {
        "problem": designer.problem.name,
        "arguments": dict(arguments),
        "hash": designer.problem.hash(),
        "layout": layout_hash(designer.problem),
        "rules": asdict(designer.rules),
        "starts": "interpolated" if interpolated else "centre",
        "policy": policy.settings(),
        "origin": asdict(origin),
    }
    write_pair(path, config, weights)


def read_designer(path: Path) -> tuple[Designer, Origin]:
    """Read a designer of ``write_designer``; nothing is unpickled.

    Raises:
        ValueError: in one sentence, for a file that is missing, damaged or edited, or a designer
            of another version of its problem or of the observation.
    """
    config, tensors = read_pair(path, "designer", NEEDED)
    problem = make_problem(config["problem"], **config["arguments"])
    for what, now in (("hash", problem.hash()), ("layout", layout_hash(problem))):
        if config[what] != now:
            thing = "observation layout" if what == "layout" else f"version of {problem.name}"
            raise ValueError(
                f"the designer {path.stem!r} was trained for another {thing} "
                f"({config[what][:12]} there, {now[:12]} here): train it again"
            )
    policy = _policy(problem, config["policy"], tensors)
    starts = (
        Interpolation.of_tensors(problem, tensors)
        if config["starts"] == "interpolated"
        else Centre(problem)
    )
    designer = Designer(problem, Rules(**config["rules"]), policy, starts)
    return designer, Origin(**config["origin"])


def _policy(
    problem: DesignProblem, settings: Mapping[str, Any], tensors: Mapping[str, Any]
) -> Policy:
    prefix = "policy."
    own = {name[len(prefix) :]: a for name, a in tensors.items() if name.startswith(prefix)}
    if settings["kind"] == "planner":
        return Planner.of_tensors(problem, own)
    return Network.of_tensors(own, settings)


def write_pair(path: Path, config: Mapping[str, Any], weights: bytes) -> None:
    """Write a configuration and, beside it, the weights whose sha256 it records.

    Each of the two files appears whole or not at all.
    """
    whole = {"format": FORMAT, **config, "sha256": hashlib.sha256(weights).hexdigest()}
    _write(path.with_suffix(WEIGHTS), weights)
    _write(path, (json.dumps(whole, indent=2) + "\n").encode())


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
    except SafetensorError as error:
        raise ValueError(f"{str(path)!r} has no readable weights: {error}") from None


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


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
