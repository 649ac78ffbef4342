"""A broken limit of the Diamond in words: what, where in the workspace, by how much."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.core.sampling import rectangle
from pkm_gym.mechanisms.diamond.kinematics import reach_margins

if TYPE_CHECKING:
    from pkm_gym.mechanisms.diamond.mechanism import Diamond
    from pkm_gym.mechanisms.diamond.problem import DiamondTask


def explain(machine: Diamond, task: DiamondTask, broken: list[str]) -> list[str]:
    """Return one sentence a broken limit."""
    inner, outer = reach_margins(
        machine.e, machine.l1, machine.l2, machine.H, machine.b, machine.h
    )
    lines = []
    if inner < 0.0:
        lines.append(
            f"reach_inner: the top edge comes {-1e3 * inner * machine.l1:.1f} mm too near to a "
            "drive: the limb cannot fold that far"
        )
    if outer < 0.0:
        lines.append(
            f"reach_outer: the far bottom corner lies {-1e3 * outer * machine.l1:.1f} mm beyond the "
            "stretched limb"
        )
    if "spacing" in broken:
        lines.append(
            f"spacing: lam_e is {machine.e / machine.l1:.4g}, it must be at least "
            f"{task.lam_e_min:g}"
        )
    return lines + ([] if lines and min(inner, outer) < 0.0 else _local(machine, task, broken))


def _local(machine: Diamond, task: DiamondTask, broken: list[str]) -> list[str]:
    poses = rectangle(
        (-0.5 * machine.b, -machine.H - machine.h), (0.5 * machine.b, -machine.H), 161, 41
    ).reshape(-1, 2)
    local = machine.local_indices(poses)
    alpha, beta = (np.degrees(np.arcsin(np.clip(local[k], -1, 1))) for k in ("sin_alpha", "sin_beta"))
    alpha_low, beta_low = np.degrees(task.alpha_low), np.degrees(task.beta_low)
    # name -> field over the workspace, +1 where its maximum counts, the limit, the unit
    limits = {
        "assembly": (local["sin_alpha"], -1, "sin alpha", "must be positive", ""),
        "sigma_max": (local["sigma_max"], 1, "sigma_max", f"must be at most {task.sigma_high:g}", ""),
        "sigma_min": (local["sigma_min"], -1, "sigma_min", f"must be at least {task.sigma_low:g}", ""),
        "alpha": (alpha, -1, "the angle between the rods", f"must be at least {alpha_low:.4g} deg", " deg"),
        "beta": (beta, -1, "the angle at the elbow", f"must be at least {beta_low:.4g} deg", " deg"),
    }
    lines = []
    for name in broken:
        if name in limits:
            values, sign, what, limit, unit = limits[name]
            at = int(np.argmax(sign * values))
            x, y = 1e3 * poses[at]
            lines.append(
                f"{name}: {what} is {values[at]:.4g}{unit} at x = {x:.0f} mm, y = {y:.0f} mm; it {limit}"
            )
    return lines
