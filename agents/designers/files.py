"""Designer files: a designer's weights and configuration, read and written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from safetensors.numpy import save

from pkm_gym.agents.designers.designer import Centre, Designer, Policy
from pkm_gym.agents.planner.planner import Planner
from pkm_gym.agents.runs.files import Origin, read_pair, write_pair
from pkm_gym.agents.sb3.network import Network
from pkm_gym.benchmark.interpolation import Interpolation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.envs.observation import observation_layout
from pkm_gym.envs.rules import Rules
from pkm_gym.mechanisms import called, lasting, make_problem

NEEDED = ("format", "problem", "arguments", "hash", "layout", "rules", "policy", "sha256")


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
        "problem": lasting(designer.problem),
        "arguments": dict(arguments),
        "hash": designer.problem.hash(),
        "layout": layout_hash(designer.problem),
        "rules": asdict(designer.rules),
        "starts": "interpolated" if interpolated else "centre",
        "policy": policy.settings(),
        "origin": asdict(origin),
    }
    write_pair(path, config, weights)


def read_designer(path: Path, *, older: bool = False) -> tuple[Designer, Origin]:
    """Read a designer of ``write_designer``; nothing is unpickled.

    With ``older`` one of another version of its problem is taken, too.

    Raises:
        ValueError: in one sentence, for a file that is missing, damaged or edited, or a designer
            of another version of its problem or of the observation.
    """
    config, tensors = read_pair(path, "designer", NEEDED)
    problem = make_problem(config["problem"], **config["arguments"])
    for what, now in (("hash", problem.hash()), ("layout", layout_hash(problem))):
        if config[what] != now and not (older and what == "hash"):
            thing = "observation layout" if what == "layout" else f"version of {problem.name}"
            raise ValueError(
                f"the designer {path.stem!r} was trained for another {thing} "
                f"({config[what][:12]} there, {now[:12]} here): train it again, or "
                f"renew it with `pkm-gym restamp {called(problem)} {path}`"
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
