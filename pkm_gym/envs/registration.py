"""The ids of all environments, in one table."""

from __future__ import annotations

from gymnasium.envs.registration import register, registry

# Name in the id -> (design problem, version of the id).
DESIGN = {
    "Diamond": ("diamond", 0),
}


def register_environments() -> None:
    """Register two ids a row, once: the paper's task, and a Family's new task each episode."""
    for name, (problem, version) in DESIGN.items():
        for suffix, family in (("", False), ("Family", True)):
            env_id = f"PKM/{name}{suffix}-v{version}"
            if env_id not in registry:
                register(
                    env_id,
                    entry_point="pkm_gym.envs.design:DesignEnv",
                    vector_entry_point="pkm_gym.envs.vector:DesignVectorEnv",
                    kwargs={"problem": problem, "family": family},
                )
