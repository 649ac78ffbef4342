"""The environments that agents are trained in, by id."""

from __future__ import annotations

from gymnasium.envs.registration import EnvSpec, registry

from pkm_gym.agents.runs.recipe import ALGORITHMS, LEARNERS
from pkm_gym.core.names import unknown
from pkm_gym.envs.design import DesignEnv
from pkm_gym.mechanisms import register_module


def find_spec(env_id: str, *, motion: bool = False) -> EnvSpec:
    """Return the specification of a design environment; ``module:ID`` imports the module first.

    What design problems it defines are registered then. ``module:Class`` stands for the problem's
    Family, or its one task where it draws none. With ``motion``, a motion environment will do too.

    Raises:
        ValueError: for an id that is unknown, with its closest match, or no design environment.
    """
    module, colon, name = env_id.rpartition(":")
    if colon:
        name = register_module(module).get(env_id, name)
    if name not in registry:
        ids = [key for key, s in registry.items() if _is_design(s) or (motion and is_motion(s))]
        raise ValueError(unknown("environment", name, ids))
    spec = registry[name]
    if not (_is_design(spec) or (motion and is_motion(spec))):
        raise ValueError(f"{name} is no design environment: its entry point must be DesignEnv")
    return spec


def find_trained(env_id: str, algorithm: str) -> EnvSpec:
    """Return the specification of an environment that an algorithm can be trained in.

    Raises:
        ValueError: as ``find_spec``; for a motion environment and an algorithm that designs only.
    """
    spec = find_spec(env_id, motion=True)
    if is_motion(spec) and algorithm in set(ALGORITHMS) - set(LEARNERS):
        raise ValueError(
            f"{spec.id} is trained by one of {', '.join(LEARNERS)}, not by {algorithm}"
        )
    return spec


def _is_design(spec: EnvSpec) -> bool:
    return spec.entry_point in ("pkm_gym.envs.design:DesignEnv", DesignEnv)


def is_motion(spec: EnvSpec) -> bool:
    """Return whether an environment drives a twin."""
    return spec.entry_point == "pkm_gym.envs.motion:MotionEnv"
