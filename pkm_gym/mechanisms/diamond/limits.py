"""A broken limit of the Diamond in words: what, where in the workspace, by how much."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.core.sampling import rectangle
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.kinematics import reach_margins

if TYPE_CHECKING:
    from pkm_gym.mechanisms.diamond.mechanism import Diamond
    from pkm_gym.mechanisms.diamond.problem import DiamondTask


def explain(machine: Diamond, task: DiamondTask, broken: list[str]) -> list[str]:
    """Return one sentence a broken limit."""
    lines = _reach(machine)
    if not lines:
        lines = _local(machine, task, broken)
    if "spacing" in broken:
        ratio = machine.e / machine.l1
        lines.append(f"spacing: lam_e is {ratio:.4g}; it must be at least {task.lam_e_min:g}")
    return lines


def _reach(machine: Diamond) -> list[str]:
    inner, outer = reach_margins(machine.e, machine.l1, machine.l2, machine.H, machine.b, machine.h)
    lines = []
    if inner <= 0.0:
        short = -1e3 * inner * machine.l1
        lines.append(f"reach_inner: the top edge comes {short:.1f} mm too near to a drive")
    if outer <= 0.0:
        short = -1e3 * outer * machine.l1
        lines.append(f"reach_outer: the far bottom corner lies {short:.1f} mm beyond the limb")
    return lines


def _local(machine: Diamond, task: DiamondTask, broken: list[str]) -> list[str]:
    low, high = (-0.5 * machine.b, -machine.H - machine.h), (0.5 * machine.b, -machine.H)
    poses = rectangle(low, high, 161, 41).reshape(-1, 2)
    local = machine.local_indices(poses)
    alpha, beta = (_degrees(local[name]) for name in ("sin_alpha", "sin_beta"))
    at_least = "; it must be at least"
    # constraint -> values over the workspace, which extreme counts, what it is, its limit
    limits = {
        "assembly": (local["sin_alpha"], min, "sin alpha", "; it must be positive"),
        "sigma_max": (
            local["sigma_max"], max, "sigma_max", f"; it must be at most {task.sigma_high:g}"
        ),
        "sigma_min": (local["sigma_min"], min, "sigma_min", f"{at_least} {task.sigma_low:g}"),
        "alpha": (
            alpha, min, "the angle between the rods (deg)",
            f"{at_least} {np.degrees(task.alpha_low):.4g}",
        ),
        "beta": (
            beta, min, "the angle at an elbow (deg)",
            f"{at_least} {np.degrees(task.beta_low):.4g}",
        ),
    }  # fmt: skip
    lines = []
    for name in broken:
        if name in limits:
            values, extreme, what, limit = limits[name]
            at = int(np.argmax(values) if extreme is max else np.argmin(values))
            x, y = 1e3 * poses[at]
            where = f"at x = {x:.0f} mm, y = {y:.0f} mm"
            lines.append(f"{name}: {what} is {values[at]:.4g} {where}{limit}")
    return lines


def _degrees(sine: FloatArray) -> FloatArray:
    return np.degrees(np.arcsin(np.clip(sine, -1.0, 1.0)))
