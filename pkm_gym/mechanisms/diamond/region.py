"""The reachable region of Fig. 3: four arcs about elbows at their limits, and where W_t touches it.

The limits are the extreme arm angles over the workspace's rectangle, so that the region holds it
and touches it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pkm_gym.core.planar import REACH_MARGIN, reach_margins
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.kinematics import arm_angle_range
from pkm_gym.mechanisms.diamond.mechanism import Diamond


@dataclass(frozen=True)
class Region:
    """The region that the platform reaches with the arms between two angles.

    Attributes:
        angles: array (2,), the lowest and the highest arm angle of limb 1, rad.
        elbows: array (4, 2), m: B_1', B_2' at the highest angle, B_1'', B_2'' at the lowest.
        arcs: array (4, n, 2), m: the boundary about each of these elbows, NaN where the rods of
            such arms don't meet.
        touching: array (4, 2), m: P_1, P_2, Q_1, Q_2, where the rectangle touches these arcs.
    """

    angles: FloatArray
    elbows: FloatArray
    arcs: FloatArray
    touching: FloatArray

    @property
    def tangent(self) -> bool:
        """Whether the top edge is tangent to the upper arcs, as the paper draws it."""
        return bool(abs(self.touching[0, 0] - self.elbows[0, 0]) < TOUCH)


TOUCH = 1e-9  # of a metre: rounding


def reachable_region(machine: Diamond, samples: int = 201) -> Region:
    """Return the region of a machine, each arc with so many points.

    Raises:
        ValueError: for a machine whose limbs don't reach the workspace, saying by how much.
    """
    margins = reach_margins(*machine.lengths, machine.H, machine.b, machine.h)
    missed = [
        name
        for name, margin in zip(("reach_inner", "reach_outer"), margins, strict=True)
        if margin < REACH_MARGIN
    ]
    if missed:
        raise ValueError("no reachable region: " + "; ".join(machine.explain_reach(missed)))
    low, high = arm_angle_range(*machine.lengths, machine.H, machine.b, machine.h)
    swept = np.linspace(low, high, samples)
    arcs, elbows, touching = [], [], []
    for angle in (high, low):
        right = machine.forward_kinematics(
            np.stack([np.full(samples, angle), np.pi - swept], axis=-1)
        )
        elbow = np.array([machine.e, 0.0]) + machine.l1 * np.array([np.cos(angle), np.sin(angle)])
        point = _touching(machine, elbow)
        for mirror in ((1.0, 1.0), (-1.0, 1.0)):
            arcs.append(right * mirror)
            elbows.append(elbow * mirror)
            touching.append(point * mirror)
    return Region(np.array([low, high]), *map(np.array, (elbows, arcs, touching)))


def _touching(machine: Diamond, elbow: FloatArray) -> FloatArray:
    """Return the point (2,) of the rectangle's edge at the end of the rod from an extreme elbow.

    A corner, or where the rod stands at right angles to an edge.
    """
    rods = machine.l2 * np.array([(0.0, -1.0), (0.0, 1.0), (-1.0, 0.0), (1.0, 0.0)])
    corners = machine.workspace()[:4]
    points = np.concatenate([elbow + rods, corners])
    low, high = corners.min(axis=0) - TOUCH, corners.max(axis=0) + TOUCH
    points = points[((points >= low) & (points <= high)).all(axis=1)]
    off = np.abs(np.linalg.norm(points - elbow, axis=1) - machine.l2)
    return np.asarray(points[off.argmin()])
