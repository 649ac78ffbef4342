"""How the 6-PUS's twin looks, and what it weighs: all of it ours, the paper dimensions none of it.

Three columns stand between a plate and a frame; each bears two screws, on each of them slides a
nut. The platform is a frame of aluminium bars through the S joints, with a spindle in its hub; the
rods are of steel. Under it lies the plate that is engraved.
"""

from __future__ import annotations

import mujoco
import numpy as np

from pkm_gym.core.planar_twin import add_box
from pkm_gym.core.twin import ALUMINIUM, STEEL, add_bar, add_cylinder, add_stage, quaternion
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.engraving import Plane
from pkm_gym.mechanisms.pus6.mechanism import Pus6

UP = np.array([0.0, 0.0, 1.0])
ROUND = np.linspace(0.0, 2.0 * np.pi, 32, endpoint=False)
SPARE = 0.05  # m, of a screw beyond its slider's travel in the box
BELOW = 0.24  # m, from the tool's tip at home to the floor
BEHIND = 0.07  # m, from the screws of a column to its middle
ROD, SCREW, NUT, BAR = 0.008, 0.006, 0.021, 0.0095  # m, radii
LEAD = 0.01  # m, of a screw
HUB = 0.2  # of the S joints' radius
RAISED = 0.11  # m, of the hub over the S joints
SPINDLE = 0.8  # kg, with its tool


def columns() -> FloatArray:
    """Return each leg's axes (6, 3, 3) as columns: outwards at its column, along it, and up."""
    azimuths = np.repeat(0.5 * np.pi + 2.0 / 3.0 * np.pi * np.arange(3), 2)
    c, s, none = np.cos(azimuths), np.sin(azimuths), np.zeros(6)
    rows = ((c, -s, none), (s, c, none), (none, none, none + 1.0))
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=1)


def draw_stage(spec: mujoco.MjSpec, machine: Pus6) -> None:
    """Add the floor, the lights and the camera."""
    high = _screw(machine)[1]
    size = 0.97 * np.hypot(2.0 * (machine.r_B + 0.1), BELOW + high)
    add_stage(spec, (0.0, 0.0, 0.5 * (BELOW + high)), size, seen_from=(0.2, -1.0, 0.42))


def screw_inertia(machine: Pus6) -> float:
    """Return the inertia of a turning screw as its slider feels it, kg."""
    low, high = _screw(machine)
    turning = 0.5 * np.pi * SCREW**4 * STEEL * (high - low)
    return turning * (2.0 * np.pi / LEAD) ** 2


def carried(machine: Pus6, joints: FloatArray) -> float:
    """Return what a servo is laid out for beside the screw, kg.

    Each may have to carry the platform and its rod; more, where the platform is faster than the
    sliders at home.
    """
    ends = np.diff(_frame(machine, joints), axis=1)
    frame = np.pi * BAR**2 * ALUMINIUM * float(np.linalg.norm(ends, axis=-1).sum())
    faster = float(np.linalg.norm(machine.jacobian(np.zeros(6))[3:], ord=2))
    return max(1.0, faster) * (frame + SPINDLE + np.pi * ROD**2 * STEEL * machine.L)


def draw_base(spec: mujoco.MjSpec, base: mujoco.MjsBody, machine: Pus6) -> None:
    """Draw a plate on the floor, three columns with two screws each, and a frame on top."""
    (low, high), half = _screw(machine), 0.5 * machine.phi_A
    x, y = machine.r_B * np.cos(half), machine.r_B * np.sin(half)
    feet = [(x + BEHIND) * axes[:, 0] for axes in columns()[::2]]
    _draw_plate(spec, base, feet, (-BELOW, -BELOW + 0.02))
    for i, axes in enumerate(columns()[::2]):
        column, top = base.add_body(name=f"column_{i + 1}", quat=quaternion(axes)), high + 0.02
        add_box(column, (x + BEHIND, 0.0, 0.5 * (top - BELOW)), (0.03, 0.035, 0.5 * (top + BELOW)))
        bracket = (0.5 * BEHIND + 0.01, y + 0.02, 0.009)
        for z in (low, high):
            add_box(column, (x + 0.5 * BEHIND - 0.01, 0.0, z), bracket)
        for side in (-y, y):
            add_cylinder(column, [(x, side, low), (x, side, high)], SCREW, "metal")
            add_cylinder(column, [(x, side, high), (x, side, high + 0.06)], 0.019, "base")
    for one, other in zip(feet, [*feet[1:], feet[0]], strict=True):
        add_bar(base, [one + high * UP, other + high * UP], 0.015, "base")


def draw_work(base: mujoco.MjsBody, flat: Plane) -> None:
    """Draw the plate that is engraved, on a post."""
    under = flat.middle - 0.01 * flat.axes[:, 2]
    add_cylinder(base, [under, flat.middle], 1.2 * flat.radius, "arm")
    foot = under - 0.025 * flat.axes[:, 2]
    add_cylinder(base, [foot, under], 0.6 * flat.radius, "metal")
    add_bar(base, [foot, (*foot[:2], -BELOW)], 0.45 * flat.radius, "base")


def draw_slider(slider: mujoco.MjsBody) -> None:
    """Draw a nut on its screw."""
    add_cylinder(slider, [(0, 0, -0.012), (0, 0, 0.03)], NUT, "arm", density=STEEL)
    add_cylinder(slider, [(0, 0, 0.03), (0, 0, 0.04)], 0.6 * NUT, "metal")


def draw_rod(rod: mujoco.MjsBody, length: float) -> None:
    """Draw a rod along its -z."""
    add_bar(rod, [(0, 0, 0), (0, 0, -length)], ROD, "rod", density=STEEL)
    _add_ball(rod, (0.0, 0.0, 0.0), 1.9 * ROD, "metal")
    _add_ball(rod, (0.0, 0.0, -length), 1.7 * ROD, "metal")


def draw_platform(platform: mujoco.MjsBody, machine: Pus6, joints: FloatArray) -> None:
    """Draw the frame through the S joints (6, 3), its hub, and the spindle with the tool."""
    for ends in _frame(machine, joints):
        add_bar(platform, ends, BAR, "platform", density=ALUMINIUM)
    hub, radius = (machine.tool + RAISED) * UP, HUB * machine.R
    add_cylinder(platform, [hub - 0.012 * UP, hub + 0.012 * UP], radius, "platform")
    add_cylinder(platform, [hub - 0.02 * UP, hub + 0.08 * UP], 0.62 * radius, "base", mass=SPINDLE)
    add_cylinder(platform, [hub + 0.08 * UP, hub + 0.09 * UP], 0.45 * radius, "metal")
    add_cylinder(platform, [hub - 0.032 * UP, hub - 0.02 * UP], 0.35 * radius, "metal")
    add_cylinder(platform, [0.012 * UP, hub - 0.032 * UP], 0.0045, "metal")
    add_cylinder(platform, [0.0 * UP, 0.012 * UP], 0.002, "metal")


def _frame(machine: Pus6, joints: FloatArray) -> FloatArray:
    """Return the ends of the platform's bars (9, 2, 3): a hexagon, and spokes to its long sides."""
    sides = np.stack([joints, np.roll(joints, -1, axis=0)], axis=1)
    rims = sides[::2].mean(axis=1)
    hub = np.array([0.0, 0.0, machine.tool + RAISED])
    outwards = rims * (1.0 - UP)
    inner = hub + HUB * machine.R * outwards / np.linalg.norm(outwards, axis=1, keepdims=True)
    return np.concatenate([sides, np.stack([rims, inner], axis=1)])


def _screw(machine: Pus6) -> tuple[float, float]:
    """Return a screw's ends over the tool's tip at home, m: longer than the box asks for."""
    heights = machine.home + machine.inverse_kinematics(machine.search_poses())
    more = machine.z + SPARE
    return float(np.nanmin(heights)) - more, float(np.nanmax(heights)) + more


def _draw_plate(
    spec: mujoco.MjSpec, base: mujoco.MjsBody, corners: list[FloatArray],
    between: tuple[float, float],
) -> None:  # fmt: skip
    """Draw the convex plate around circles about its corners."""
    circle = 0.11 * np.stack([np.cos(ROUND), np.sin(ROUND)], axis=-1)
    outline = np.concatenate([corner[:2] + circle for corner in corners])
    sides = [np.column_stack([outline, np.full(len(outline), z)]) for z in between]
    spec.add_mesh(name="plate", uservert=np.concatenate(sides).ravel())
    base.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH, meshname="plate", material="metal", density=0.0, contype=0,
        conaffinity=0,
    )  # fmt: skip


def _add_ball(body: mujoco.MjsBody, at: tuple[float, ...], radius: float, color: str) -> None:
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=at, size=[radius, 0.0, 0.0], material=color,
        density=0.0, contype=0, conaffinity=0,
    )  # fmt: skip
