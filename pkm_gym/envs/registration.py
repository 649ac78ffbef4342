"""The ids of all environments, in one place."""

from __future__ import annotations

from typing import Any

from gymnasium.envs.registration import register, registry

# id -> (design problem, whether each episode has a task of its own, drawn from the Family)
DESIGN = {
    "PKM/Diamond-v0": ("diamond", False),
    "PKM/DiamondFamily-v0": ("diamond", True),
    "PKM/SPR3-v0": ("spr3", False),
    "PKM/SPR3Family-v0": ("spr3", True),
    "PKM/SPR3Cylinder-v0": ("spr3_cylinder", False),
    "PKM/SPR3CylinderFamily-v0": ("spr3_cylinder", True),
}

# id -> arguments: the design problem, and how its path is run where not by MotionEnv's defaults
MOTION: dict[str, dict[str, Any]] = {
    "PKM/DiamondMotion-v0": {"problem": "diamond"},
    "PKM/SPR3Motion-v0": {"problem": "spr3", "speed": 20.0, "frame_skip": 20},
}


def register_environments() -> None:
    """Register every id of the tables, once."""
    for env_id, (problem, family) in DESIGN.items():
        if env_id not in registry:
            register(
                env_id,
                entry_point="pkm_gym.envs.design:DesignEnv",
                vector_entry_point="pkm_gym.envs.vector:DesignVectorEnv",
                kwargs={"problem": problem, "family": family},
            )
    for env_id, arguments in MOTION.items():
        if env_id not in registry:
            register(env_id, entry_point="pkm_gym.envs.motion:MotionEnv", kwargs=arguments)
