"""How the 5-PSS/UPU's twin looks, and what it weighs: all of it ours, but for the paper's lengths.

Rails stand on a round plate; on each runs a carriage with an S joint over it. Rods of steel bear an
aluminium plate. In the middle stands the passive limb: a barrel on a U joint, in it a stem. All is
to the scale of the machine's n; the rails are as long as its box asks for.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Self

import mujoco
import numpy as np

from pkm_gym.core.planar_twin import add_box
from pkm_gym.core.twin import ALUMINIUM, STEEL, add_bar, add_cylinder, add_stage, quaternion
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.kinematics import LIMBS, PER_LIMB
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

UP = np.array([0.0, 0.0, 1.0])
THICK = 0.02  # of n: what all thicknesses are multiples of
BELOW = 10.0  # of them, from the plane of the feet to the floor
SPARE = 7.0  # of a rail beyond its slider's travel in the box
UNDER = 5.2  # from the middles of the S joints to that of their rail
ROD, BARREL, STEM, SCREW = 0.9, 2.3, 1.2, 0.55  # radii
LEAD = 1.0  # of a screw
BAR, HUB, HUB_HIGH = 1.25, 5.2, 5.0  # of the platform: radii, and the hub over the S joints
CARRIAGE = (3.8, 2.8, 1.0)  # half its edges


@dataclass(frozen=True)
class Look:
    """What a machine is drawn from, m: its thickness, the ends of rails and limbs.

    ``rails`` (5, 2, 3) are the ways of the sliders' S joints, ``axes`` (5, 3, 3) theirs as columns:
    along, across and off the rail; ``joints`` (5, 3) the S joints in the platform.
    """

    thick: float
    rails: FloatArray
    axes: FloatArray
    joints: FloatArray
    rod: float
    barrel: float
    stem: float
    height: float
    radius: float

    @classmethod
    def of(cls, machine: Pss5Upu) -> Self:
        """Return how a machine looks."""
        thick, table = THICK * machine.n, machine.layout.reshape(LIMBS, PER_LIMB)
        low, high = _travel(machine)
        feet, along = np.pad(table[:, 2:4], ((0, 0), (0, 1))), table[:, 4:]
        ends = np.array([low - SPARE * thick, high + SPARE * thick])
        across = np.cross(UP, along)
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        nearest = max(machine.z0 - machine.z, 12.0 * thick)
        return cls(
            thick=thick,
            rails=feet[:, None] + ends[None, :, None] * along[:, None],
            axes=np.stack([along, across, np.cross(along, across)], axis=-1),
            joints=np.pad(table[:, :2], ((0, 0), (0, 1))),
            rod=machine.L,
            barrel=0.55 * nearest,
            stem=0.82 * nearest,
            height=machine.z0 + machine.z,
            radius=machine.R - min(0.0, low) * np.cos(machine.theta),
        )

    @property
    def below(self) -> float:
        """The height of O over the floor, m: the lowest rail's end is over it."""
        lowest = self.beams[:, :, 2].min()
        return max(BELOW * self.thick, 4.0 * self.thick - float(lowest))

    @property
    def beams(self) -> FloatArray:
        """The ends (5, 2, 3) of the rails' beams, under the S joints, m."""
        return self.rails - UNDER * self.thick * self.axes[:, None, :, 2]

    @property
    def frame(self) -> FloatArray:
        """The ends (n, 2, 3) of the platform's bars: around by the S joints, and to the hub.

        None between joints that are in one place.
        """
        around = self.joints[np.argsort(np.arctan2(self.joints[:, 1], self.joints[:, 0]))]
        outwards = around / np.linalg.norm(around, axis=1, keepdims=True)
        inner = self.thick * (HUB * outwards + HUB_HIGH * UP)
        sides = np.stack([around, np.roll(around, -1, axis=0)], axis=1)
        apart = np.linalg.norm(sides[:, 1] - sides[:, 0], axis=1) > self.thick
        return np.concatenate([sides[apart], np.stack([around, inner], axis=1)])


@lru_cache(maxsize=64)
def _travel(machine: Pss5Upu) -> tuple[float, float]:
    """Return the least and greatest way of a slider in the box, m; a rod's length out of reach."""
    ways = machine.inverse_kinematics(machine.search_poses())
    if np.isnan(ways).all():
        return 0.0, machine.L
    return float(np.nanmin(ways)), float(np.nanmax(ways))


def draw_stage(spec: mujoco.MjSpec, look: Look) -> None:
    """Add the floor, the lights and the camera."""
    high = look.below + look.height
    size = 0.92 * np.hypot(2.0 * look.radius, high)
    add_stage(spec, (0.0, 0.0, 0.42 * high), size, seen_from=(0.55, -1.0, 0.38))


def screw_inertia(look: Look) -> float:
    """Return the inertia of a turning screw as its slider feels it, kg."""
    length = float(np.linalg.norm(look.rails[0, 1] - look.rails[0, 0]))
    turning = 0.5 * np.pi * (SCREW * look.thick) ** 4 * STEEL * length
    return turning * (2.0 * np.pi / (LEAD * look.thick)) ** 2


def carried(look: Look) -> float:
    """Return what a servo bears beside its screw, kg: slider, rod, and half of all else."""
    area = np.pi * look.thick**2
    slider = 8.0 * float(np.prod(CARRIAGE)) * look.thick**3 * STEEL
    rod = area * ROD**2 * look.rod * STEEL
    bars = float(np.linalg.norm(np.diff(look.frame, axis=1), axis=-1).sum())
    frame = area * (BAR**2 * bars + 2.0 * HUB**2 * look.thick) * ALUMINIUM
    limb = area * (BARREL**2 * look.barrel * ALUMINIUM + STEM**2 * look.stem * STEEL)
    return slider + rod + 0.5 * (frame + limb)


# The base -----------------------------------------------------------------------------------------


def draw_base(base: mujoco.MjsBody, look: Look) -> None:
    """Draw a round plate on the floor, on it five rails and the fork of the passive limb."""
    t, floor = look.thick, -look.below
    add_cylinder(base, [floor * UP, (floor + 1.6 * t) * UP], look.radius + 9.0 * t, "floor")
    add_cylinder(base, [floor * UP, (floor + 2.0 * t) * UP], look.radius + 8.0 * t, "metal")
    for i in range(LIMBS):
        _draw_rail(base, look, i)
    add_cylinder(base, [(floor + 1.0 * t) * UP, -4.4 * t * UP], 4.6 * t, "base")
    for side in (-1.0, 1.0):
        add_box(base, (3.4 * side * t, 0.0, -2.0 * t), (0.7 * t, 1.6 * t, 3.4 * t))
    add_cylinder(base, [(-4.4 * t, 0.0, 0.0), (4.4 * t, 0.0, 0.0)], 0.75 * t, "metal")


def _draw_rail(base: mujoco.MjsBody, look: Look, i: int) -> None:
    """Draw a beam with guides, a screw and its motor, on two posts."""
    t, (low, high) = look.thick, look.beams[i]
    half = 0.5 * float(np.linalg.norm(high - low))
    rail = base.add_body(
        name=f"rail_{i + 1}", pos=0.5 * (low + high), quat=quaternion(look.axes[i])
    )
    add_box(rail, (0.0, 0.0, 0.0), (half, 2.3 * t, 0.9 * t))
    for side in (-1.6, 1.6):
        add_box(rail, (0.0, side * t, 1.2 * t), (half, 0.45 * t, 0.5 * t), "metal")
    add_cylinder(rail, [(-half, 0, 1.6 * t), (half, 0, 1.6 * t)], SCREW * t, "metal")
    for end in (-half, half):
        add_box(rail, (end, 0.0, 1.0 * t), (0.8 * t, 2.3 * t, 1.7 * t))
    add_cylinder(rail, [(half, 0, 1.6 * t), (half + 6.0 * t, 0, 1.6 * t)], 1.9 * t, "base")
    for top in (low, high):
        ground = np.array([*top[:2], 2.0 * t - look.below])
        add_bar(base, [top, ground], 1.4 * t, "base")
        add_cylinder(base, [ground, ground + 0.8 * t * UP], 3.0 * t, "base")


# What moves ---------------------------------------------------------------------------------------


def draw_slider(slider: mujoco.MjsBody, look: Look, i: int) -> None:
    """Draw a carriage and the socket of its S joint."""
    t, axes = look.thick, look.axes[i]
    slider.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=-2.6 * t * axes[:, 2], quat=quaternion(axes),
        size=np.array(CARRIAGE) * t, material="arm", density=STEEL, contype=0, conaffinity=0,
    )  # fmt: skip
    add_cylinder(slider, [-1.8 * t * axes[:, 2], -0.4 * t * axes[:, 2]], 1.5 * t, "arm")


def draw_rod(rod: mujoco.MjsBody, look: Look) -> None:
    """Draw a rod along its z, with the balls of its joints."""
    t = look.thick
    add_bar(rod, [(0, 0, 0), look.rod * UP], ROD * t, "rod", density=STEEL)
    for end in (0.0, look.rod):
        rod.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=end * UP, size=[1.6 * t, 0.0, 0.0],
            material="metal", density=0.0, contype=0, conaffinity=0,
        )  # fmt: skip


def draw_leg(leg: mujoco.MjsBody, look: Look) -> None:
    """Draw the barrel of the passive limb on the second pin of its lower U joint."""
    t = look.thick
    add_cylinder(leg, [(0, -2.6 * t, 0), (0, 2.6 * t, 0)], 0.75 * t, "metal")
    for side in (-2.0, 2.0):
        add_bar(leg, [(0, side * t, 0), (0, side * t, 3.4 * t)], 0.6 * t, "arm")
    add_cylinder(leg, [3.2 * t * UP, 4.2 * t * UP], 2.7 * t, "arm")
    add_cylinder(leg, [4.2 * t * UP, look.barrel * UP], BARREL * t, "arm", density=ALUMINIUM)
    add_cylinder(leg, [look.barrel * UP, (look.barrel + 1.4 * t) * UP], 2.7 * t, "metal")


def draw_stem(stem: mujoco.MjsBody, look: Look) -> None:
    """Draw the stem of the passive limb, and the pin of its upper U joint."""
    t = look.thick
    add_cylinder(stem, [-look.stem * UP, -3.2 * t * UP], STEM * t, "metal", density=STEEL)
    add_cylinder(stem, [-4.2 * t * UP, -3.2 * t * UP], 2.5 * t, "arm")
    for side in (-2.0, 2.0):
        add_bar(stem, [(0, side * t, -3.4 * t), (0, side * t, 0)], 0.6 * t, "arm")
    add_cylinder(stem, [(0, -2.6 * t, 0), (0, 2.6 * t, 0)], 0.75 * t, "metal")


def draw_platform(platform: mujoco.MjsBody, look: Look) -> None:
    """Draw a frame through the S joints, its hub, and the fork of the upper U joint."""
    t = look.thick
    for ends in look.frame:
        add_bar(platform, ends, BAR * t, "platform", density=ALUMINIUM)
    low, high = (HUB_HIGH - 1.0) * t * UP, (HUB_HIGH + 1.0) * t * UP
    add_cylinder(platform, [low, high], HUB * t, "platform", density=ALUMINIUM)
    add_cylinder(platform, [high, high + 0.8 * t * UP], 0.7 * HUB * t, "metal")
    for side in (-3.4, 3.4):
        add_box(platform, (side * t, 0.0, 1.4 * t), (0.7 * t, 1.5 * t, 2.9 * t), "platform")
    add_cylinder(platform, [(-4.4 * t, 0, 0), (4.4 * t, 0, 0)], 0.75 * t, "metal")
