"""A mechanism's MuJoCo model as text."""

from __future__ import annotations

from pkm_gym.core.mechanism import Mechanism

CLOSED = 1e-12  # m


def model_text(machine: Mechanism) -> tuple[str, str]:
    """Return the MJCF of a machine at its first telling pose, and what is wrong with it or "".

    Raises:
        ValueError: for a mechanism without a twin.
    """
    from pkm_gym.core.twin import twin_module
    from pkm_gym.twin.camera import first_pose
    from pkm_gym.twin.mjcf import mjcf, moved

    spec = twin_module(machine).build(machine, first_pose(machine))
    spec.compile()
    text = mjcf(spec)
    if (off := moved(spec, text)) > CLOSED:
        return (
            text,
            f"this MuJoCo writes numbers that are rounded: parts are off by up to {off:.1e} m",
        )
    return text, ""
