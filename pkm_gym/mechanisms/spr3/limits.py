"""A broken limit of the 3-SPR in words: what, where in the workspace, by how much."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.workspace import volume_by_quadrature

if TYPE_CHECKING:
    from pkm_gym.mechanisms.spr3.cover import CylinderSpr3
    from pkm_gym.mechanisms.spr3.cylinder import CylinderTask
    from pkm_gym.mechanisms.spr3.mechanism import Spr3
    from pkm_gym.mechanisms.spr3.problem import Spr3Task

LEVELS = 9  # leg lengths that are looked at, from the shortest to the longest


class Limit(NamedTuple):
    """A limit of values (n,) over the workspace: which end is the worst, and both in words."""

    values: FloatArray
    worst: float  # 1: the largest, -1: the smallest
    what: str
    limit: str


def explain(machine: Spr3, task: Spr3Task, broken: list[str], jacobian: str) -> list[str]:
    """Return one sentence a broken limit of a joint box."""
    joints = _joint_box(machine)
    poses = machine.forward_kinematics(joints)
    reached = np.isfinite(poses).all(axis=1)
    if "assembly" in broken:
        return [_assembly(machine, joints[~reached])]
    joints, local = joints[reached], machine.local_indices(poses[reached], jacobian)
    limits = _common(local, task.s_angle_max) | {
        "parasitic": Limit(
            1e3 * local["parasitic"],
            1.0,
            "the parasitic offset (mm)",
            f"it must be at most {1e3 * machine.D * task.parasitic_max:.4g}",
        ),
        "r_angle": Limit(
            np.degrees(local["r_angle"]),
            -1.0,
            "the angle of an R joint (deg)",
            f"it must be at least {np.degrees(task.r_angle_min):.4g}",
        ),
        "lci": Limit(
            local["lci"],
            -1.0,
            "the local conditioning index",
            f"it must be at least {task.lci_low:g}",
        ),
    }
    lines = [_worst(name, limits[name], joints, _legs) for name in broken if name in limits]
    volume = volume_by_quadrature(machine) / machine.D**3
    if "volume" in broken and volume > 0.0:
        lines.append(
            f"volume: the workspace holds {volume:.4g} D^3; it must hold at least "
            f"{task.volume_min:g} D^3"
        )
    return lines


def explain_cover(machine: CylinderSpr3, task: CylinderTask, broken: list[str]) -> list[str]:
    """Return one sentence a broken limit of a cylinder to be covered."""
    if machine.z_c <= 0.5 * machine.height:
        low = 1e3 * (0.5 * machine.height - machine.z_c)
        return [f"assembly: the cylinder reaches {low:.1f} mm under the fixed platform"]
    points = machine.cylinder_points()
    poses = machine.pose_at(points)
    reached = np.isfinite(poses).all(axis=1)
    if "assembly" in broken:
        lost = points[~reached] if not reached.all() else points[:1]
        nearest = lost[np.hypot(lost[:, 0], lost[:, 1]).argmin()]
        return [f"assembly: the platform folds before it reaches {_place(nearest)[3:]}"]
    limits = _common(machine.local_indices(poses), task.s_angle_max)
    lines = [_worst(name, limits[name], points, _place) for name in broken if name in limits]
    if "stroke" in broken:
        lines.append(
            f"stroke: the legs go from {1e3 * machine.q_min:.1f} to {1e3 * machine.q_max:.1f} mm, "
            f"1 to {machine.q_max / machine.q_min:.4g}; it must be at most {task.stroke_ratio:g}"
        )
    if "size" in broken:
        lines.append(
            f"size: D is {1e3 * machine.D:.1f} mm; it must be at most {1e3 * task.D_max:.1f}"
        )
    return lines


def _common(local: dict[str, FloatArray], s_angle_max: float) -> dict[str, Limit]:
    return {
        "determinant": Limit(local["det"], -1.0, "det J", "it must be positive"),
        "fold": Limit(local["fold"], -1.0, "the margin to the fold", "it must be positive"),
        "s_angle": Limit(
            np.degrees(local["s_angle"]),
            1.0,
            "the angle of an S joint (deg)",
            f"it must be at most {np.degrees(s_angle_max):.4g}",
        ),
    }


def _worst(name: str, limit: Limit, places: FloatArray, words: Callable[[FloatArray], str]) -> str:
    at = int(np.argmax(limit.worst * limit.values))
    return f"{name}: {limit.what} is {limit.values[at]:.4g} {words(places[at])}; {limit.limit}"


def _legs(lengths: FloatArray) -> str:
    return "with legs of " + ", ".join(f"{1e3 * q:.0f}" for q in lengths) + " mm"


def _place(point: FloatArray) -> str:
    return (
        "at " + ", ".join(f"{n} = {1e3 * x:.0f}" for n, x in zip("xyz", point, strict=True)) + " mm"
    )


def _assembly(machine: Spr3, lost: FloatArray) -> str:
    gap = abs(machine.b - machine.a)
    if gap >= machine.q_min:
        short = 1e3 * (gap - machine.q_min)
        return f"assembly: the shortest legs are {short:.1f} mm too short to join the platforms"
    if len(lost) == 0:
        return "assembly: a parallel singularity crosses the legs' range"
    nearest = lost[np.abs(lost - machine.q_c).max(axis=1).argmin()]
    return f"assembly: a parallel singularity bars the way from home to {_legs(nearest)[5:]}"


def _joint_box(machine: Spr3) -> FloatArray:
    """Return leg lengths (n, 3) over the joint box; by symmetry q_1 <= q_2 <= q_3."""
    rise = np.linspace(machine.q_min, machine.q_max, LEVELS)
    box = np.stack(np.meshgrid(rise, rise, rise, indexing="ij"), axis=-1).reshape(-1, 3)
    ordered: FloatArray = box[(np.diff(box, axis=1) >= 0.0).all(axis=1)]
    return ordered
