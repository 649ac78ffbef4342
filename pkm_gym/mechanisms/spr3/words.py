"""Why a 3-SPR can't be assembled, in words, and where its legs and its centre are."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.core.types import FloatArray

if TYPE_CHECKING:
    from pkm_gym.mechanisms.spr3.cover import CylinderSpr3
    from pkm_gym.mechanisms.spr3.mechanism import Spr3


def assembly_of_box(machine: Spr3) -> str:
    """Return what keeps the legs from being assembled all over their range."""
    gap = abs(machine.b - machine.a)
    if gap >= machine.q_min:
        short = 1e3 * (gap - machine.q_min)
        return f"the shortest legs are {short:.1f} mm too short to join the platforms"
    joints = machine.joint_box()
    lost = joints[~np.isfinite(machine.forward_kinematics(joints)).all(axis=1)]
    if len(lost) == 0:
        return "a parallel singularity crosses the legs' range"
    nearest = lost[np.abs(lost - machine.q_c).max(axis=1).argmin()]
    return f"a parallel singularity bars the way from home to {legs(nearest)}"


def assembly_over_cylinder(machine: CylinderSpr3) -> str:
    """Return what keeps the platform from the cylinder."""
    if machine.z_c <= 0.5 * machine.height:
        low = 1e3 * (0.5 * machine.height - machine.z_c)
        return f"the cylinder reaches {low:.1f} mm under the fixed platform"
    points = machine.cylinder_points()
    reached = np.isfinite(machine.pose_at(points)).all(axis=1)
    lost = points[~reached] if not reached.all() else points[:1]
    nearest = lost[np.hypot(lost[:, 0], lost[:, 1]).argmin()]
    return f"the platform folds before it reaches {position(nearest)}"


def legs(lengths: FloatArray) -> str:
    """Return legs' lengths (3,), m, in words."""
    return "legs of " + ", ".join(f"{1e3 * q:.0f}" for q in lengths) + " mm"


def position(point: FloatArray) -> str:
    """Return a position (3,), m, in words."""
    return ", ".join(f"{n} = {1e3 * x:.0f}" for n, x in zip("xyz", point, strict=True)) + " mm"
