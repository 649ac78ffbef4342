"""A broken limit of the 3-SPR in words: what, where in the workspace, by how much."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.core.types import FloatArray

if TYPE_CHECKING:
    from pkm_gym.mechanisms.spr3.mechanism import Spr3
    from pkm_gym.mechanisms.spr3.problem import Spr3Task

LEVELS = 9  # leg lengths that are looked at, from the shortest to the longest


def explain(machine: Spr3, task: Spr3Task, broken: list[str], jacobian: str) -> list[str]:
    """Return one sentence a broken limit."""
    joints = _joint_box(machine)
    poses = machine.forward_kinematics(joints)
    lost = np.isnan(poses).any(axis=1)
    if "assembly" in broken:
        return [_assembly(machine, joints[lost])]
    local = {
        name: np.where(lost, np.nan, values)
        for name, values in machine.local_indices(poses, jacobian).items()
    }
    lines = []
    if "volume" in broken:
        volume = machine.volume() / machine.D**3
        lines.append(
            f"volume: the workspace holds {volume:.4g} D^3; it must hold at least "
            f"{task.volume_min:g} D^3"
        )
    limits = local_limits(machine, task, local)
    return lines + [
        f"{name}: {worst_of(*limits[name], joints)}" for name in broken if name in limits
    ]


def local_limits(
    machine: Spr3, task: Spr3Task, local: dict[str, FloatArray]
) -> dict[str, tuple[FloatArray, float, str, str]]:
    """Return constraint -> values over poses, sign of the worst, what it is, its limit in words."""
    s_max, r_min = np.degrees(task.s_angle_max), np.degrees(task.r_angle_min)
    offset, angles = 1e3 * local["parasitic"], {k: np.degrees(local[k]) for k in ANGLES}
    return {
        "determinant": (local["det"], -1.0, "det J", "it must be positive"),
        "fold": (local["fold"], -1.0, "the margin to the fold", "it must be positive"),
        "parasitic": (
            offset, 1.0, "the parasitic offset (mm)",
            f"it must be at most {1e3 * machine.D * task.parasitic_max:.4g}",
        ),
        "s_angle": (
            angles["s_angle"], 1.0, "the angle of an S joint (deg)",
            f"it must be at most {s_max:.4g}",
        ),
        "r_angle": (
            angles["r_angle"], -1.0, "the angle of an R joint (deg)",
            f"it must be at least {r_min:.4g}",
        ),
        "lci": (
            local["lci"], -1.0, "the local conditioning index",
            f"it must be at least {task.lci_low:g}",
        ),
    }  # fmt: skip


ANGLES = ("s_angle", "r_angle")


def worst_of(values: FloatArray, sign: float, what: str, limit: str, joints: FloatArray) -> str:
    """Say what the worst of values (n,) is, with the legs (n, 3) it belongs to."""
    at = int(np.nanargmax(sign * values))
    return f"{what} is {values[at]:.4g} at {legs(joints[at])}; {limit}"


def legs(lengths: FloatArray) -> str:
    """Return three leg lengths (3,), m, in words."""
    return "legs of " + ", ".join(f"{1e3 * q:.0f}" for q in lengths) + " mm"


def _assembly(machine: Spr3, lost: FloatArray) -> str:
    gap = abs(machine.b - machine.a)
    if gap >= machine.q_min:
        short = 1e3 * (gap - machine.q_min)
        return f"assembly: the shortest legs are {short:.1f} mm too short to join the platforms"
    if len(lost) == 0:
        return "assembly: a parallel singularity crosses the legs' range"
    nearest = lost[np.abs(lost - machine.q_c).max(axis=1).argmin()]
    return f"assembly: a parallel singularity bars the way from home to {legs(nearest)}"


def _joint_box(machine: Spr3) -> FloatArray:
    """Return leg lengths (n, 3) over the joint box; by symmetry q_1 <= q_2 <= q_3."""
    rise = np.linspace(machine.q_min, machine.q_max, LEVELS)
    box = np.stack(np.meshgrid(rise, rise, rise, indexing="ij"), axis=-1).reshape(-1, 3)
    sorted_box: FloatArray = box[(np.diff(box, axis=1) >= 0.0).all(axis=1)]
    return sorted_box
