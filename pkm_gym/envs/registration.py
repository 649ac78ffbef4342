"""The ids of all environments: derived from what is declared of the problems."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gymnasium.envs.registration import register, registry

from pkm_gym.core.declaration import Declaration
from pkm_gym.mechanisms import installed_environments, own_declarations

DESIGN, VECTOR = "pkm_gym.envs.design:DesignEnv", "pkm_gym.envs.vector:DesignVectorEnv"
MOTION = "pkm_gym.envs.motion:MotionEnv"


def register_environments() -> None:
    """Register the ids of our own problems and of those that are installed, once.

    Of an installed one only its entry point's name is read: the ids are made from that, and its
    environments look up what else is declared when they are made.
    """
    for declaration in own_declarations():
        register_problem(declaration.name, declaration)
    for _, where, environment in installed_environments():
        _register_ids(environment, where, {})
        _register_motion(environment, where, {})


def register_problem(where: str, declaration: Declaration) -> None:
    """Register the ids of a declared problem: fixed, Family and, where it has a twin, Motion.

    Args:
        where: what the environments make it from: its name, or "module:Class".
        declaration: what is declared of it.
    """
    _register_ids(declaration.environment, where, declaration.family)
    if declaration.motion is not None:
        _register_motion(declaration.motion_environment, where, declaration.motion)


def environment_ids(declaration: Declaration) -> tuple[str, ...]:
    """Return the ids of a declared problem that are registered; without a twin nothing moves."""
    ids = [f"PKM/{declaration.environment}{kind}-v0" for kind in ("", "Family")]
    if declaration.motion is not None:
        ids.append(motion_id(declaration))
    return tuple(env_id for env_id in ids if env_id in registry)


def motion_id(declaration: Declaration) -> str:
    """Return the id of the environment that drives a declared problem's twin."""
    return _motion_id(declaration.motion_environment)


def _register_ids(environment: str, where: str, family: Mapping[str, Any]) -> None:
    for kind, arguments in (("", {"family": False}), ("Family", {"family": True, **family})):
        _register(
            f"PKM/{environment}{kind}-v0",
            entry_point=DESIGN,
            vector_entry_point=VECTOR,
            kwargs={"problem": where, **arguments},
        )


def _register_motion(environment: str, where: str, motion: Mapping[str, Any]) -> None:
    _register(_motion_id(environment), entry_point=MOTION, kwargs={"problem": where, **motion})


def _motion_id(environment: str) -> str:
    return f"PKM/{environment}Motion-v0"


def _register(env_id: str, **arguments: Any) -> None:
    if env_id not in registry:
        register(env_id, **arguments)
