"""Designer files: a designer's weights and configuration, read and written."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from reprlib import repr as short
from typing import Any

from pkm_gym.agents.designers.designer import Centre, Designer, Policy
from pkm_gym.agents.planner.planner import Planner
from pkm_gym.agents.runs.files import Origin, read_pair, write_pair
from pkm_gym.agents.sb3.network import Network
from pkm_gym.benchmark.interpolation import Interpolation
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import about, shaped
from pkm_gym.envs.observation import observation_layout
from pkm_gym.envs.rules import Rules
from pkm_gym.mechanisms import called, lasting, make_problem

STARTS = ("centre", "interpolated")
POLICIES = ("network", "planner")


@dataclass(frozen=True)
class DesignerConfig:
    """What the file of a designer holds beside its format and checksum."""

    problem: str
    arguments: Mapping[str, Any]
    hash: str
    layout: str
    rules: Mapping[str, Any]
    starts: str
    policy: Mapping[str, Any]
    origin: Origin


@dataclass(frozen=True)
class Recorded:
    """What a shipped designer must reproduce, see ``shipping.recorded``."""

    tasks: list[list[float]]
    designs: list[list[float]]
    regrets: Mapping[str, Any]

    def check(self, m: int, d: int) -> None:
        """Refuse tasks (n, m), designs (n, d) or regrets that are none; those may be infinite.

        Raises:
            ValueError: in one sentence.
        """
        tasks, designs = ([len(row) for row in rows] for rows in (self.tasks, self.designs))
        if (tasks, designs) != ([m] * len(tasks), [d] * len(tasks)):
            raise ValueError(f"origin.recorded must hold tasks of {m}, designs of {d} numbers")
        for count, regret in self.regrets.items():
            if not isinstance(regret, int | float) or not regret >= 0.0:
                raise ValueError(
                    f"origin.recorded.regrets.{count} is {regret!r}: it must be a number from 0 on"
                )


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
    write_pair(path, config, tensors)


def read_designer(path: Path, *, older: bool = False) -> tuple[Designer, Origin]:
    """Read a designer of ``write_designer``; nothing is unpickled.

    With ``older`` one of another version of its problem is taken, too.

    Raises:
        ValueError: in one sentence, for a file that is missing, damaged or edited, or a designer
            of another version of its problem or of the observation.
    """
    config, tensors = read_pair(path, "designer", DesignerConfig)
    with about(path, "designer"):
        problem = _problem(config)
    for what, held, now in (
        ("hash", config.hash, problem.hash()),
        ("layout", config.layout, layout_hash(problem)),
    ):
        if held != now and not (older and what == "hash"):
            thing = "observation layout" if what == "layout" else f"version of {problem.name}"
            raise ValueError(
                f"the designer {path.stem!r} was trained for another {thing} "
                f"({held[:12]} there, {now[:12]} here): train it again, or "
                f"renew it with `pkm-gym restamp {called(problem)} {path}`"
            )
    with about(path, "designer"):
        policy = _policy(problem, config.policy, tensors)
        check_known("starts", [config.starts], STARTS)
        starts = (
            Interpolation.of_tensors(problem, tensors)
            if config.starts == "interpolated"
            else Centre(problem)
        )
        if missing := [item.name for item in fields(Rules) if item.name not in config.rules]:
            raise ValueError(f"it lacks {', '.join(f'rules.{name}' for name in missing)}")
        rules = shaped(Rules, config.rules, "rules")
        if config.origin.recorded:
            recorded = shaped(Recorded, config.origin.recorded, "origin.recorded")
            recorded.check(len(problem.task_variables), len(problem.low))
    return Designer(problem, rules, policy, starts), config.origin


def _problem(config: DesignerConfig) -> DesignProblem:
    """Return the problem that a configuration names.

    Raises:
        ValueError: in one sentence, where there is none, or its arguments are refused.
    """
    try:
        return make_problem(config.problem, **config.arguments)
    except (TypeError, AttributeError, KeyError) as error:  # a word in the place of a table, say
        raise ValueError(f"its arguments {short(config.arguments)} are refused ({error})") from None


def _policy(
    problem: DesignProblem, settings: Mapping[str, Any], tensors: Mapping[str, Any]
) -> Policy:
    prefix = "policy."
    own = {name[len(prefix) :]: a for name, a in tensors.items() if name.startswith(prefix)}
    check_known("kind of policy", [settings.get("kind")], POLICIES)
    if settings["kind"] == "planner":
        return Planner.of_tensors(problem, own)
    network = Network.of_tensors(own, settings)
    sizes = observation_layout(problem)["step_size"].stop, len(problem.low)
    if network.sizes != sizes:
        raise ValueError(
            "its network takes {} numbers and gives {}: {} and {} are wanted".format(
                *network.sizes, *sizes
            )
        )
    return network
