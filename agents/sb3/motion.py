"""Agents that drive twins: what they are trained and scored on, and their files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gymnasium.envs.registration import EnvSpec

from pkm_gym.agents.runs.files import Origin, read_pair, write_pair
from pkm_gym.agents.runs.recipe import Recipe
from pkm_gym.agents.runs.run import BEST
from pkm_gym.agents.sb3.network import Network
from pkm_gym.core.reading import about
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.baselines import run
from pkm_gym.envs.motion import MotionEnv

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv

FROM_THE_BEGINNING = {"start": "beginning", "start_offset": 0.0}


@dataclass(frozen=True)
class DriverConfig:
    """What the file of a driver holds beside its format and checksum."""

    environment: str
    layout: Mapping[str, list[int]]
    network: Mapping[str, Any]
    origin: Origin


@dataclass(frozen=True)
class Driver:
    """A trained network as a controller.

    Attributes:
        network: observations in, actions out.
        layout: part of the observation -> its first and last place, as it was trained with.
        origin: where it comes from.
    """

    network: Network
    layout: Mapping[str, list[int]]
    origin: Origin

    def __call__(self, env: MotionEnv, observation: Any) -> FloatArray:
        """Return the action (joints,) for an observation."""
        if layout_of(env) != self.layout or self.network.sizes[1:] != env.action_space.shape:
            raise ValueError(
                f"the agent of {self.origin.env_id} sees other observations: train it again"
            )
        action: FloatArray = self.network(observation[None])[0]
        return action


@dataclass(frozen=True)
class MotionCourse:
    """What a driver is trained on: episodes of a motion environment.

    Attributes:
        spec: of the environment.
        arguments: of ``MotionEnv`` in training.
        env: where it is scored: the same, from the path's beginning.
    """

    spec: EnvSpec
    arguments: Mapping[str, Any]
    env: MotionEnv

    @property
    def goal(self) -> str:
        """What the agent is scored on: its mean reward."""
        return "the path, from its beginning"

    def vec_env(self, n: int) -> VecEnv:
        """Return n environments as Stable-Baselines3 wants them."""
        from pkm_gym.agents.sb3.motion_env import MotionVecEnv

        return MotionVecEnv([MotionEnv(**self.arguments) for _ in range(n)])

    def score(self, policy: Network) -> float:
        """Return the mean reward of a network on the path, from its beginning."""
        return run(self.env, lambda _, seen: policy(seen[None])[0], seed=0).mean_reward

    def write(self, policy: Network, path: Path, origin: Origin) -> None:
        """Write a network as a driver."""
        config = {
            "environment": self.spec.id,
            "layout": layout_of(self.env),
            "network": policy.settings(),
            "origin": asdict(origin),
        }
        write_pair(path, config, policy.tensors())


def motion_course(
    spec: EnvSpec, recipe: Recipe, *, pool: Path | None, validation: Path | None
) -> MotionCourse:
    """Return what a run on a motion environment is trained on.

    Raises:
        ValueError: for files of tasks or a start of sessions, which it has no use for.
    """
    for name, given in (("pool", pool), ("validation", validation)):
        if given is not None:
            raise ValueError(f"{spec.id} has no use for --{name}: its path needs no solved tasks")
    if recipe.starts != "centre":
        raise ValueError(f"{spec.id} has no sessions: starts must stay 'centre'")
    arguments = {**spec.kwargs, **recipe.environment}
    return MotionCourse(spec, arguments, MotionEnv(**{**arguments, **FROM_THE_BEGINNING}))


def load_driver(path: str | Path) -> Driver:
    """Return a driver from the folder of a run, or from its .json file.

    Raises:
        ValueError: in one sentence, for a file that is missing, damaged, edited or no driver.
    """
    file = Path(path)
    file = file / BEST if file.is_dir() else file
    config, tensors = read_pair(file, "driver", DriverConfig)
    with about(file, "driver"):
        network = Network.of_tensors(tensors, config.network)
        seen = max((stop for _, stop in config.layout.values()), default=0)
        if network.sizes[0] != seen:
            raise ValueError(f"its network takes {network.sizes[0]} numbers, its layout has {seen}")
    return Driver(network, config.layout, config.origin)


def layout_of(env: MotionEnv) -> dict[str, list[int]]:
    """Return part -> [start, stop] of an environment's observation, as JSON holds it."""
    parts = {name: [at.start, at.stop] for name, at in env.observation_layout.items()}
    layout: dict[str, list[int]] = json.loads(json.dumps(parts))
    return layout
