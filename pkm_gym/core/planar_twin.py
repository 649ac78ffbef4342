"""Twins of planar machines of two limbs: two arms on hinges, a rod on each elbow, a tool.

The tool slides in x and y and does not turn; each rod's end is kept on it. What the contract of a
twin asks for beside ``build``, ``course`` and ``SOLVER`` is here for a mechanism's twin.py to take.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from pkm_gym.core.planar import PlanarMachine
from pkm_gym.core.trajectory import pick_and_place
from pkm_gym.core.twin import (
    Course,
    Solver,
    add_bar,
    add_cylinder,
    add_drive,
    add_machine,
    add_stage,
    check_reach,
    close_loop,
    new_spec,
)
from pkm_gym.core.types import FloatArray

AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # x right, y up
SIDES = (("1", 1.0), ("2", -1.0))


class Masses(NamedTuple):
    """What the bodies weigh.

    An arm has an inertia (kg m^2) and a first moment (kg m) about its axis: as one body of the mass
    2 moment^2 / inertia at moment over mass, which leaves half the inertia about its own centre
    whatever the dimensions. A limb's rods are uniform.
    """

    arm_inertia: float  # kg m^2
    arm_moment: float  # kg m
    rod: float  # kg, of a limb
    tool: float  # kg
    moved: float  # kg m^2, what a servo moves, about


def coordinates(
    machine: PlanarMachine, poses: FloatArray, home: FloatArray
) -> dict[str, FloatArray]:
    """Return every joint's values (n,) at poses (n, 2), by joint."""
    del home
    arms = machine.inverse_kinematics(poses)
    values = {"x": poses[:, 0], "y": poses[:, 1]}
    for i, (name, _) in enumerate(SIDES):
        values[f"theta_{name}"] = arms[:, i]
        values[f"elbow_{name}"] = _elbow_angles(machine, poses, arms)[:, i]
    return values


def draw_poses(machine: PlanarMachine, n: int, generator: np.random.Generator) -> FloatArray:
    """Return the workspace's corners and n random poses of it, (4 + n, 2), m."""
    corners = machine.workspace()[:4]
    low, high = corners.min(axis=0), corners.max(axis=0)
    return np.concatenate([corners, low + (high - low) * generator.random((n, 2))])


def pick_and_place_course(
    machine: PlanarMachine,
    width: float,
    lift: float,
    time: float,
    overlap: float,
    samples: int,
) -> Course:
    """Return a pick-and-place cycle along the workspace's bottom edge."""
    rows = np.array([
        pick_and_place(t, width, lift, time, overlap) for t in np.linspace(0.0, time, samples)
    ])  # fmt: skip
    floor = np.array([0.0, -machine.H - machine.h])
    return Course(time, floor + rows[:, :2], rows[:, 2:4], rows[:, 4:])


def frames(machine: PlanarMachine, poses: FloatArray) -> FloatArray:
    """Return the platform's axes and position as columns, (n, 3, 4), at poses (n, 2)."""
    del machine
    found = np.zeros((len(poses), 3, 4))
    found[:, :, :3], found[:, :2, 3] = np.eye(3), poses
    return found


def pose(machine: PlanarMachine, frame: FloatArray) -> FloatArray:
    """Return the pose (2,) of a platform's frame (3, 4)."""
    del machine
    return frame[:2, 3]


def margins(machine: PlanarMachine, pose: FloatArray, joints: FloatArray) -> FloatArray:
    """Return numbers (3,) > 0 in the modes that the machine is built in.

    The sine of the angle between the rods, > 0 in the lower assembly mode, and those of the angles
    between arm and rod, > 0 with the elbows outwards.
    """
    (c_1, c_2), (s_1, s_2) = np.cos(joints), np.sin(joints)
    x_1, x_2 = pose[0] - machine.e - machine.l1 * c_1, pose[0] + machine.e - machine.l1 * c_2
    y_1, y_2 = pose[1] - machine.l1 * s_1, pose[1] - machine.l1 * s_2
    between = (x_1 * y_2 - y_1 * x_2) / machine.l2
    return np.array([between, s_1 * x_1 - c_1 * y_1, c_2 * y_2 - s_2 * x_2]) / machine.l2


def _elbow_angles(machine: PlanarMachine, poses: FloatArray, arms: FloatArray) -> FloatArray:
    """Return the angles (..., 2) from arm to rod, rad, within half a turn."""
    signs = np.array([sign for _, sign in SIDES])
    x = poses[..., :1] - signs * machine.e - machine.l1 * np.cos(arms)
    y = poses[..., 1:] - machine.l1 * np.sin(arms)
    return np.asarray((np.arctan2(y, x) - arms + np.pi) % (2.0 * np.pi) - np.pi)


def thickness(machine: PlanarMachine) -> float:
    """Return how thick links are drawn, m."""
    return 0.05 * (machine.e + machine.l1)


def assembled(
    name: str,
    machine: PlanarMachine,
    pose: FloatArray,
    masses: Masses,
    solver: Solver,
    rods: tuple[float, ...] = (0.0,),
) -> mujoco.MjSpec:
    """Return the twin at a pose (2,), but for what its body ``platform`` looks like.

    ``rods`` are the planes of a limb's rods, in thicknesses from the arms' plane.

    Raises:
        ValueError: for a pose out of reach.
    """
    pose = np.asarray(pose, dtype=float)
    angles = machine.inverse_kinematics(pose)
    check_reach(angles, pose)
    elbows = _elbow_angles(machine, pose, angles)
    spec = new_spec(name, solver)
    thick = thickness(machine)
    height = machine.H + machine.h + 5.0 * thick
    base = add_machine(spec, AXES, height)
    _draw_base(base, machine, thick, height)

    platform = base.add_body(
        name="platform", pos=[*pose, 0.0], mass=masses.tool, ipos=[0.0] * 3,
        inertia=[masses.tool * thick**2] * 3, explicitinertial=True,
    )  # fmt: skip
    for axis_name, axis, home in zip("xy", np.eye(3)[:2], pose, strict=True):
        platform.add_joint(name=axis_name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis, ref=home)
    platform.add_site(name="tcp", size=[0.001] * 3, group=4)

    for i, (side, sign) in enumerate(SIDES):
        arm, rod = _add_limb(base, machine, side, sign, (angles[i], elbows[i]), masses)
        _draw_limb(arm, rod, machine, thick, rods)
        close_loop(spec, f"loop_{side}", (f"tip_{side}", "tcp"), solver)
        add_drive(spec, f"theta_{side}", float(angles[i]), masses.moved)
    low = -machine.H - machine.h
    centre, size = (
        (0.0, 0.0, height + 0.5 * low),
        1.2 * max(2.6 * (machine.e + machine.l1), -1.3 * low),
    )
    add_stage(spec, centre, size, seen_from=(0.5, -1.0, 0.3))
    return spec


def _add_limb(
    base: mujoco.MjsBody,
    machine: PlanarMachine,
    name: str,
    sign: float,
    angles: tuple[float, float],
    masses: Masses,
) -> tuple[mujoco.MjsBody, mujoco.MjsBody]:
    """Add an arm and a rod on its elbow; return both."""
    inertia, moment, rod = masses.arm_inertia, masses.arm_moment, masses.rod
    mass = 2.0 * moment**2 / inertia
    hinge = {"type": mujoco.mjtJoint.mjJNT_HINGE, "axis": [0.0, 0.0, 1.0]}
    first = base.add_body(
        name=f"arm_{name}", pos=[sign * machine.e, 0.0, 0.0], quat=_turn(angles[0]), mass=mass,
        ipos=[moment / mass, 0.0, 0.0], inertia=[0.5 * inertia] * 3, explicitinertial=True,
    )  # fmt: skip
    first.add_joint(name=f"theta_{name}", ref=angles[0], **hinge)
    across = rod * machine.l2**2 / 12.0
    second = first.add_body(
        name=f"rod_{name}", pos=[machine.l1, 0.0, 0.0], quat=_turn(angles[1]), mass=rod,
        ipos=[0.5 * machine.l2, 0.0, 0.0], inertia=[0.5 * across, across, across],
        explicitinertial=True,
    )  # fmt: skip
    second.add_joint(name=f"elbow_{name}", ref=angles[1], **hinge)
    second.add_site(name=f"tip_{name}", pos=[machine.l2, 0.0, 0.0], size=[0.001] * 3, group=4)
    return first, second


def _turn(angle: float) -> list[float]:
    return [float(np.cos(0.5 * angle)), 0.0, 0.0, float(np.sin(0.5 * angle))]


# How it looks -------------------------------------------------------------------------------------


def _draw_base(base: mujoco.MjsBody, machine: PlanarMachine, thick: float, height: float) -> None:
    """Draw the motors on a portal behind the machine that stands on the floor."""
    behind, floor, wide = -5.5 * thick, -height + 0.9 * thick, machine.e + machine.l1
    for sign in (1.0, -1.0):
        x = sign * machine.e
        add_cylinder(base, [(x, 0, behind), (x, 0, -0.9 * thick)], 1.35 * thick, "base")
        add_cylinder(base, [(x, 0, -0.9 * thick), (x, 0, 0.8 * thick)], 0.7 * thick, "metal")
        post = sign * 1.2 * wide
        add_box(base, (post, 0.5 * floor, behind), (0.8 * thick, 0.5 * abs(floor), 0.8 * thick))
        foot = (2.0 * thick, 0.25 * thick, 3.5 * thick)
        add_box(base, (post, -height + 0.25 * thick, behind), foot)
    add_box(base, (0.0, 0.0, behind), (1.2 * wide + 0.8 * thick, 1.5 * thick, 0.9 * thick))


def add_box(
    body: mujoco.MjsBody, at: tuple[float, ...], half: tuple[float, ...], color: str = "base"
) -> None:
    """Add a box about a point (3,) with half its edges (3,), m; without mass."""
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=at, size=half, material=color, density=0.0, contype=0,
        conaffinity=0,
    )  # fmt: skip


def _draw_limb(
    arm: mujoco.MjsBody,
    rod: mujoco.MjsBody,
    machine: PlanarMachine,
    thick: float,
    rods: tuple[float, ...],
) -> None:
    far, width = machine.l1, max(1.15 * thick, *(abs(z) * thick for z in rods))
    add_bar(arm, [(0, 0, 0), (far, 0, 0)], 0.72 * thick, "arm")
    add_cylinder(arm, [(0, 0, -0.85 * thick), (0, 0, 0.85 * thick)], 1.05 * thick, "arm")
    add_cylinder(arm, [(far, 0, -width), (far, 0, width)], 0.42 * thick, "metal")
    for z in (plane * thick for plane in rods):
        add_bar(rod, [(0, 0, z), (machine.l2, 0, z)], 0.26 * thick, "rod")
        for x in (0.0, machine.l2):
            add_cylinder(
                rod, [(x, 0, z - 0.3 * thick), (x, 0, z + 0.3 * thick)], 0.5 * thick, "rod"
            )
