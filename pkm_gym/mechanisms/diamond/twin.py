"""The Diamond as a MuJoCo model.

Two arms on hinges, two rods on their elbows, a platform that slides in x and y (the parallelograms
keep it from turning). An arm and its elbow are one body: about a fixed axis only I_A and m_A r_A
act, so it gets the mass 2 (m_A r_A)^2 / I_A at m_A r_A over that mass, which leaves I_A / 2 about
its own centre whatever the dimensions.
"""

from __future__ import annotations

import mujoco
import numpy as np

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
from pkm_gym.mechanisms.diamond.declared import DiamondTask
from pkm_gym.mechanisms.diamond.mechanism import Diamond
from pkm_gym.mechanisms.diamond.problem import REFERENCE, cycle_path, packed_task

SOLVER = Solver(timestep=2e-4, solref=(4e-4, 1.0))
AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # x right, y up
LIGHT_ROD = 1e-9  # kg, of the lumped twin; its weight is what the torques then differ by
SIDES = (("1", 1.0), ("2", -1.0))


def build(machine: Diamond, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin with uniform rods of their real mass, assembled at a pose (2,).

    What eq. (9) counts to elbow and platform of the rods' mass is in the rods instead.

    Raises:
        ValueError: for a pose out of reach, or rods that outweigh the machine.
    """
    table = REFERENCE.data["inertia"]["printed"]
    rod = table["mu2"] * machine.l2  # one of the two of a limb
    elbow, platform = table["rod_elbow"] * rod, table["rod_platform"] * rod
    inertia, moment = machine.I_A - elbow * machine.l1**2, machine.mr_A - elbow * machine.l1
    mass = machine.m - platform
    if min(inertia, moment, mass) <= 0.0:
        raise ValueError(f"rods of {machine.l2:g} m outweigh the machine: it has no twin")
    return _build(machine, pose, (inertia, moment), mass, 2.0 * rod)


def build_lumped(machine: Diamond, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin that eq. (9) describes: the rods' mass in arms and platform.

    Raises:
        ValueError: for a pose out of reach.
    """
    return _build(machine, pose, (machine.I_A, machine.mr_A), machine.m, LIGHT_ROD)


def coordinates(machine: Diamond, poses: FloatArray, home: FloatArray) -> dict[str, FloatArray]:
    """Return every joint's values (n,) at poses (n, 2), by joint."""
    del home
    arms = machine.inverse_kinematics(poses)
    values = {"x": poses[:, 0], "y": poses[:, 1]}
    for i, (name, _) in enumerate(SIDES):
        values[f"theta_{name}"] = arms[:, i]
        values[f"elbow_{name}"] = _elbow_angles(machine, poses, arms)[:, i]
    return values


def draw_poses(machine: Diamond, n: int, generator: np.random.Generator) -> FloatArray:
    """Return the workspace's corners and n random poses of it, (4 + n, 2), m."""
    corners = machine.workspace()[:4]
    low, high = corners.min(axis=0), corners.max(axis=0)
    return np.concatenate([corners, low + (high - low) * generator.random((n, 2))])


def course(machine: Diamond, samples: int = 201, task: DiamondTask | None = None) -> Course:
    """Return a task's pick-and-place cycle along the workspace's bottom edge, or the paper's."""
    task = task or DiamondTask(b=machine.b)
    width, lift, time, overlap = cycle_path(packed_task(task))
    rows = np.array([
        pick_and_place(t, width, lift, time, overlap) for t in np.linspace(0.0, time, samples)
    ])  # fmt: skip
    floor = np.array([0.0, -machine.H - machine.h])
    return Course(time, floor + rows[:, :2], rows[:, 2:4], rows[:, 4:])


def frames(machine: Diamond, poses: FloatArray) -> FloatArray:
    """Return the platform's axes and position as columns, (n, 3, 4), at poses (n, 2)."""
    del machine
    found = np.zeros((len(poses), 3, 4))
    found[:, :, :3], found[:, :2, 3] = np.eye(3), poses
    return found


def pose(machine: Diamond, frame: FloatArray) -> FloatArray:
    """Return the pose (2,) of a platform's frame (3, 4)."""
    del machine
    return frame[:2, 3]


def margins(machine: Diamond, pose: FloatArray, joints: FloatArray) -> FloatArray:
    """Return numbers (3,) > 0 in the modes that the machine is built in.

    The sine of the angle between the rods, > 0 in the lower assembly mode, and those of the angles
    between arm and rod, > 0 with the elbows outwards.
    """
    (c_1, c_2), (s_1, s_2) = np.cos(joints), np.sin(joints)
    x_1, x_2 = pose[0] - machine.e - machine.l1 * c_1, pose[0] + machine.e - machine.l1 * c_2
    y_1, y_2 = pose[1] - machine.l1 * s_1, pose[1] - machine.l1 * s_2
    between = (x_1 * y_2 - y_1 * x_2) / machine.l2
    return np.array([between, s_1 * x_1 - c_1 * y_1, c_2 * y_2 - s_2 * x_2]) / machine.l2


def _elbow_angles(machine: Diamond, poses: FloatArray, arms: FloatArray) -> FloatArray:
    """Return the angles (..., 2) from arm to rod, rad, within half a turn."""
    signs = np.array([sign for _, sign in SIDES])
    x = poses[..., :1] - signs * machine.e - machine.l1 * np.cos(arms)
    y = poses[..., 1:] - machine.l1 * np.sin(arms)
    return np.asarray((np.arctan2(y, x) - arms + np.pi) % (2.0 * np.pi) - np.pi)


def _build(
    machine: Diamond,
    pose: FloatArray,
    arm: tuple[float, float],
    mass: float,
    rod: float,
) -> mujoco.MjSpec:
    pose = np.asarray(pose, dtype=float)
    angles = machine.inverse_kinematics(pose)
    check_reach(angles, pose)
    elbows = _elbow_angles(machine, pose, angles)
    spec = new_spec("diamond", SOLVER)
    thick = 0.05 * (machine.e + machine.l1)
    height = machine.H + machine.h + 5.0 * thick
    base = add_machine(spec, AXES, height)
    _draw_base(base, machine, thick, height)

    platform = base.add_body(
        name="platform", pos=[*pose, 0.0], mass=mass, ipos=[0.0] * 3, inertia=[mass * thick**2] * 3,
        explicitinertial=True,
    )  # fmt: skip
    for name, axis, home in zip("xy", np.eye(3)[:2], pose, strict=True):
        platform.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis, ref=home)
    platform.add_site(name="tcp", size=[0.001] * 3, group=4)
    _draw_platform(platform, thick)

    for i, (name, sign) in enumerate(SIDES):
        _add_limb(base, machine, name, sign, (angles[i], elbows[i]), arm, rod, thick)
        close_loop(spec, f"loop_{name}", (f"tip_{name}", "tcp"), SOLVER)
        moved = machine.I_A + machine.m * machine.l1**2
        add_drive(spec, f"theta_{name}", float(angles[i]), moved)
    low = -machine.H - machine.h
    centre, size = (
        (0.0, 0.0, height + 0.5 * low),
        1.2 * max(2.6 * (machine.e + machine.l1), -1.3 * low),
    )
    add_stage(spec, centre, size, seen_from=(0.5, -1.0, 0.3))
    return spec


def _add_limb(
    base: mujoco.MjsBody,
    machine: Diamond,
    name: str,
    sign: float,
    angles: tuple[float, float],
    arm: tuple[float, float],
    rod: float,
    thick: float,
) -> None:
    """Add an arm with (inertia, first moment) about its axis, and a uniform pair of rods."""
    inertia, moment = arm
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
    _draw_limb(first, second, machine, thick)


def _turn(angle: float) -> list[float]:
    return [float(np.cos(0.5 * angle)), 0.0, 0.0, float(np.sin(0.5 * angle))]


# How it looks -------------------------------------------------------------------------------------


def _draw_base(base: mujoco.MjsBody, machine: Diamond, thick: float, height: float) -> None:
    """Draw the motors on a portal behind the machine that stands on the floor."""
    behind, floor, wide = -5.5 * thick, -height + 0.9 * thick, machine.e + machine.l1
    for sign in (1.0, -1.0):
        x = sign * machine.e
        add_cylinder(base, [(x, 0, behind), (x, 0, -0.9 * thick)], 1.35 * thick, "base")
        add_cylinder(base, [(x, 0, -0.9 * thick), (x, 0, 0.8 * thick)], 0.7 * thick, "metal")
        post = sign * 1.2 * wide
        _add_box(base, (post, 0.5 * floor, behind), (0.8 * thick, 0.5 * abs(floor), 0.8 * thick))
        foot = (2.0 * thick, 0.25 * thick, 3.5 * thick)
        _add_box(base, (post, -height + 0.25 * thick, behind), foot)
    _add_box(base, (0.0, 0.0, behind), (1.2 * wide + 0.8 * thick, 1.5 * thick, 0.9 * thick))


def _add_box(
    base: mujoco.MjsBody, at: tuple[float, ...], half: tuple[float, ...], color: str = "base"
) -> None:
    base.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, pos=at, size=half, material=color, density=0.0, contype=0,
        conaffinity=0,
    )  # fmt: skip


def _draw_limb(arm: mujoco.MjsBody, rod: mujoco.MjsBody, machine: Diamond, thick: float) -> None:
    far, width = machine.l1, 1.15 * thick
    add_bar(arm, [(0, 0, 0), (far, 0, 0)], 0.72 * thick, "arm")
    add_cylinder(arm, [(0, 0, -0.85 * thick), (0, 0, 0.85 * thick)], 1.05 * thick, "arm")
    add_cylinder(arm, [(far, 0, -width), (far, 0, width)], 0.42 * thick, "metal")
    for z in (-width, width):
        add_bar(rod, [(0, 0, z), (machine.l2, 0, z)], 0.26 * thick, "rod")
        for x in (0.0, machine.l2):
            add_cylinder(
                rod, [(x, 0, z - 0.3 * thick), (x, 0, z + 0.3 * thick)], 0.5 * thick, "rod"
            )


def _draw_platform(platform: mujoco.MjsBody, thick: float) -> None:
    add_cylinder(platform, [(0, 0, -1.8 * thick), (0, 0, 1.8 * thick)], 0.36 * thick, "metal")
    half = (0.75 * thick, 0.65 * thick, 0.75 * thick)
    _add_box(platform, (0.0, 0.0, 0.0), half, "platform")
    add_cylinder(platform, [(0, -1.8 * thick, 0), (0, 0, 0)], 0.3 * thick, "metal")
    add_cylinder(platform, [(0, -2.2 * thick, 0), (0, -1.7 * thick, 0)], 0.75 * thick, "platform")
