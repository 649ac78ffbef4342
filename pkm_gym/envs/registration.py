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
        _register_ids(environment, where, {}, {})


def register_problem(where: str, declaration: Declaration) -> None:
    """Register the ids of a declared problem: fixed, Family and, where it has a twin, Motion.

    Args:
        where: what the environments make it from: its name, or "module:Class".
        declaration: what is declared of it.
    """
    _register_ids(declaration.environment, where, declaration.motion, declaration.family)


def environment_ids(declaration: Declaration) -> tuple[str, ...]:
    """Return the ids of a declared problem that are registered; without a twin nothing moves."""
    kinds = ("", "Family") if declaration.motion is None else ("", "Family", "Motion")
    ids = [f"PKM/{declaration.environment}{kind}-v0" for kind in kinds]
    return tuple(env_id for env_id in ids if env_id in registry)


def _register_ids(
    environment: str, where: str, motion: Mapping[str, Any] | None, family: Mapping[str, Any]
) -> None:
    for kind, arguments in (("", {"family": False}), ("Family", {"family": True, **family})):
        _register(
            f"PKM/{environment}{kind}-v0",
            entry_point=DESIGN,
            vector_entry_point=VECTOR,
            kwargs={"problem": where, **arguments},
        )
    if motion is not None:
        kwargs = {"problem": where, **motion}
        _register(f"PKM/{environment}Motion-v0", entry_point=MOTION, kwargs=kwargs)


def _register(env_id: str, **arguments: Any) -> None:
    if env_id not in registry:
        register(env_id, **arguments)
