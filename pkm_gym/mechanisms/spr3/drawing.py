"""The 3-SPR as lines: its bodies in space, and the outline of its workspace's section."""

from __future__ import annotations

import numpy as np

from pkm_gym.core.mechanism import Link
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.kinematics import COS, SIN

CYLINDER = 0.9  # length of a leg's cylinder, in shortest legs
STEPS = 51  # of a leg along the outline
AROUND = np.stack([COS, SIN, np.zeros(3)], axis=-1)  # e_i, the directions of the joints


def drawn_links(
    center: FloatArray, rotation: FloatArray, a: float, b: float, q_min: float
) -> tuple[Link, ...]:
    """Return the platforms, rods and cylinders with O_A at ``center`` (3,), NaN out of reach."""
    fixed, moving = b * AROUND, center + a * AROUND @ rotation.T
    legs = moving - fixed
    tips = fixed + CYLINDER * q_min * legs / np.linalg.norm(legs, axis=-1, keepdims=True)
    return (
        Link("base", fixed[[0, 1, 2, 0]]),
        *(Link("rod", np.stack(ends)) for ends in zip(tips, moving, strict=True)),
        *(Link("arm", np.stack(ends)) for ends in zip(fixed, tips, strict=True)),
        Link("platform", moving[[0, 1, 2, 0]]),
    )


def section_outline(q_min: float, q_max: float) -> FloatArray:
    """Return leg lengths (n, 3) around the square of the joint box with equal legs 1 and 2."""
    rise = np.linspace(q_min, q_max, STEPS)
    low, high = np.full(STEPS, q_min), np.full(STEPS, q_max)
    twins = np.concatenate([low, rise[1:], high[1:], rise[::-1][1:-1]])
    third = np.concatenate([rise, high[1:], rise[::-1][1:], low[1:-1]])
    return np.stack([twins, twins, third], axis=-1)


def closed(outline: FloatArray, height: float) -> FloatArray:
    """Return the closed polygon of an outline's finite points (n, 2), or a point on the axis."""
    reached = outline[np.isfinite(outline).all(axis=1)]
    if len(reached) == 0:
        reached = np.array([[0.0, height]])
    return np.concatenate([reached, reached[:1]])
