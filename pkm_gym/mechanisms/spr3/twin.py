"""The 3-SPR as a MuJoCo model.

The moving platform slides and turns freely; on it stand three rods on hinges about their
tangential axes, on each rod slides a cylinder, and the end of the cylinder is kept in its place
on the fixed platform: nine independent loop equations for twelve coordinates. The paper gives no
masses: those here are an aluminium platform and steel legs of the thicknesses that are drawn.
"""

from __future__ import annotations

import mujoco
import numpy as np

from pkm_gym.core.reference import Reference
from pkm_gym.core.twin import (
    ALUMINIUM,
    STEEL,
    Course,
    PistonSpeeds,
    Solver,
    add_bar,
    add_cylinder,
    add_drive,
    add_machine,
    add_stage,
    check_reach,
    close_loop,
    drive_pistons,
    new_spec,
    quaternion,
)
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.drawing import AROUND, CYLINDER
from pkm_gym.mechanisms.spr3.kinematics import COS, SIN
from pkm_gym.mechanisms.spr3.mechanism import Spr3
from pkm_gym.mechanisms.spr3.path import GatePath, along, largest_cylinder

SOLVER = Solver(timestep=2.5e-4, solref=(1e-3, 1.0))
AXES = np.diag([1.0, -1.0, -1.0])  # z down, from the fixed platform to the moving one
TANGENTS = np.stack([-np.asarray(SIN), COS, np.zeros(3)], axis=-1)  # t_i
NORMAL = np.array([0.0, 0.0, 1.0])
INSIDE = 1.0 - 1e-5  # size of the path, in largest ones: lines between its samples reach too
HASTE = 5.0  # of the check's run, in the speeds of the course


def build(machine: Spr3, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin assembled at a pose (3,).

    Raises:
        ValueError: for a pose out of reach.
    """
    pose = np.asarray(pose, dtype=float)
    lengths = machine.inverse_kinematics(pose)
    check_reach(lengths, pose)
    spec = new_spec("spr3", SOLVER)
    thick = 0.04 * machine.D
    lowest = 1.25 * (machine.q_max + 0.3 * machine.a)
    base = add_machine(spec, AXES, lowest)
    _draw_base(base, machine.b, thick, lowest)

    center = machine.position(pose)
    platform = base.add_body(name="platform", pos=center, quat=quaternion(machine.rotation(pose)))
    for name, axis, home in zip("xyz", np.eye(3), center, strict=True):
        # the axes of a slide are the body's, which is turned
        local = machine.rotation(pose).T @ axis
        platform.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=local, ref=home)
    platform.add_joint(name="turn", type=mujoco.mjtJoint.mjJNT_BALL)
    platform.add_site(name="tcp", size=[0.001] * 3, group=4)
    _draw_platform(platform, machine.a, thick)

    angles = _hinge_angles(machine, pose)
    moved = np.pi * machine.a**2 * thick * ALUMINIUM  # each leg may have to carry all of it
    for i, name in enumerate(machine.joint_names):
        _add_leg(base, platform, machine, i, (float(angles[i]), float(lengths[i])), thick)
        close_loop(spec, f"loop_{i + 1}", (f"end_{i + 1}", f"joint_{i + 1}"), SOLVER)
        add_drive(spec, name, float(lengths[i]), moved, (machine.q_min, machine.q_max))
    reach = max(machine.b, machine.a)
    add_stage(
        spec, (0.0, 0.0, 0.5 * lowest), 1.0 * np.hypot(2.3 * reach, lowest), (-0.25, -1.0, 0.4)
    )
    return spec


def coordinates(machine: Spr3, poses: FloatArray, home: FloatArray) -> dict[str, FloatArray]:
    """Return every joint's values at poses (n, 3) of the twin built at ``home``, by joint."""
    turned = np.swapaxes(machine.rotation(home), -1, -2) @ machine.rotation(poses)
    values = {"turn": np.array([quaternion(matrix) for matrix in turned])}
    values |= dict(zip("xyz", machine.position(poses).T, strict=True))
    values |= dict(zip(machine.joint_names, machine.inverse_kinematics(poses).T, strict=True))
    hinges = _hinge_angles(machine, poses)
    return values | {f"hinge_{i + 1}": hinges[:, i] for i in range(3)}


def draw_poses(machine: Spr3, n: int, generator: np.random.Generator) -> FloatArray:
    """Return the corners of the joint box and n random poses of it, (8 + n, 3)."""
    low, high = machine.q_min, machine.q_max
    corners = np.stack(np.meshgrid(*[[low, high]] * 3), axis=-1).reshape(-1, 3)
    joints = np.concatenate([corners, low + (high - low) * generator.random((n, 3))])
    return machine.forward_kinematics(joints)


def course(machine: Spr3, samples: int = 201, task: object = None) -> Course:
    """Return the largest path of the shape of Fig. 2 that fits the machine at every gamma.

    With the paper's v_max, rest to rest on each side.
    """
    del task  # no task of the 3-SPR has a path
    times, positions, velocities = along(*planned_path(machine), samples)
    return Course(float(times[-1]), machine.pose_at(positions), velocities)


def piston_speeds(machine: Spr3, haste: float = HASTE, samples: int = 200) -> PistonSpeeds:
    """Let the servos take the twin along its course, ``haste`` times as fast; compare leg speeds.

    The paper's drives prescribe the legs' lengths, whatever they bear: there is no gravity here.
    """
    moves = round(course(machine, 2).duration / (haste * SOLVER.timestep))
    planned = course(machine, moves + 1).at_speed(haste)
    spec = build(machine, machine.home)
    spec.option.gravity = [0.0, 0.0, 0.0]
    return drive_pistons(machine, spec, machine.home, planned, samples, machine.pose_at)


def frames(machine: Spr3, poses: FloatArray) -> FloatArray:
    """Return the platform's axes and position as columns, (n, 3, 4), at poses (n, 3)."""
    return np.concatenate([machine.rotation(poses), machine.position(poses)[..., None]], axis=-1)


def pose(machine: Spr3, frame: FloatArray) -> FloatArray:
    """Return the pose (3,) of a platform's frame (3, 4)."""
    del machine
    normal, centre = frame[:, 2], frame[:, 3]
    return np.array([*(normal[:2] / (1.0 + normal[2])), normal @ centre])


def margins(machine: Spr3, pose: FloatArray, joints: FloatArray) -> FloatArray:
    """Return numbers (3,) > 0 in the modes that the machine is built in.

    det J, > 0 on this side of the parallel singularities, the margin to the fold, and s (m), > 0 in
    front of the fixed platform.
    """
    del joints
    local = machine.local_indices(pose)
    return np.array([local["det"], local["fold"], pose[2]])


def planned_path(machine: Spr3) -> tuple[GatePath, float, float]:
    """Return the course's path, and the paper's v_max (m/s) and a_max (m/s^2)."""
    largest, slender, middle = largest_cylinder(machine)
    radius, height = INSIDE * largest, INSIDE * slender
    path = GatePath(radius, middle + 0.5 * height, middle - 0.5 * height)
    speed, acceleration = (
        Reference.load("pkm_gym.mechanisms.spr3")[name].printed
        for name in ("speed", "acceleration")
    )
    assert speed is not None
    assert acceleration is not None
    return path, speed, acceleration


def _hinge_angles(machine: Spr3, pose: FloatArray) -> FloatArray:
    """Return the angles (..., 3), rad, from e_i to the legs about t_i in the platform's frame."""
    fixed = machine.b * AROUND - machine.position(pose)[..., None, :]
    legs = fixed @ machine.rotation(pose) - machine.a * AROUND
    return np.arctan2(-legs[..., 2], (legs * AROUND).sum(axis=-1))


def _add_leg(
    base: mujoco.MjsBody,
    platform: mujoco.MjsBody,
    machine: Spr3,
    i: int,
    at: tuple[float, float],
    thick: float,
) -> None:
    """Add the rod on the platform, the cylinder on the rod, and the joint on the base."""
    angle, length = at
    along = np.cos(angle) * AROUND[i] - np.sin(angle) * NORMAL
    axes = np.stack([np.cross(TANGENTS[i], along), TANGENTS[i], along], axis=-1)
    rod = platform.add_body(pos=machine.a * AROUND[i], quat=quaternion(axes), name=f"rod_{i + 1}")
    rod.add_joint(
        name=f"hinge_{i + 1}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 1.0, 0.0], ref=angle
    )
    cylinder = rod.add_body(name=f"cylinder_{i + 1}", pos=[0.0, 0.0, length])
    cylinder.add_joint(
        name=machine.joint_names[i], type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, 1.0],
        ref=length,
    )  # fmt: skip
    cylinder.add_site(name=f"end_{i + 1}", size=[0.001] * 3, group=4)
    base.add_site(name=f"joint_{i + 1}", pos=machine.b * AROUND[i], size=[0.001] * 3, group=4)
    _draw_leg(rod, cylinder, machine, thick)


# How it looks, and what it weighs -----------------------------------------------------------------


def _draw_base(base: mujoco.MjsBody, radius: float, thick: float, height: float) -> None:
    """Draw the fixed platform: a triangle with spokes, on three posts between the legs."""
    level = -2.2 * thick * NORMAL
    corners = 1.12 * radius * AROUND + level
    posts = -1.12 * radius * AROUND + level
    add_cylinder(base, [level - 0.9 * thick * NORMAL, level + 0.9 * thick * NORMAL], 3.0 * thick,
                 "base")  # fmt: skip
    for i, corner in enumerate(corners):
        add_bar(base, [level, corner], 0.9 * thick, "base")
        for post in np.delete(posts, i, axis=0):
            add_bar(base, [corner, post], 0.9 * thick, "base")
        add_bar(base, [posts[i], posts[i] + (height + 2.2 * thick) * NORMAL], 0.9 * thick, "base")
        foot = posts[i] + (height + 2.2 * thick) * NORMAL
        add_cylinder(base, [foot - 0.5 * thick * NORMAL, foot], 2.4 * thick, "base")
    for point in radius * AROUND:
        add_cylinder(base, [point + level, point], 1.1 * thick, "metal")


def _draw_platform(platform: mujoco.MjsBody, radius: float, thick: float) -> None:
    add_cylinder(
        platform, [(0, 0, 0.3 * thick), (0, 0, 1.3 * thick)], radius, "platform", density=ALUMINIUM
    )
    for point, tangent in zip(radius * AROUND, TANGENTS, strict=True):
        for side in (-1.0, 1.0):
            foot = point + 1.1 * side * thick * tangent
            add_bar(platform, [foot, foot + 1.0 * thick * NORMAL], 0.45 * thick, "platform")
        add_cylinder(
            platform, [point - 1.5 * thick * tangent, point + 1.5 * thick * tangent], 0.4 * thick,
            "metal",
        )  # fmt: skip
    add_cylinder(platform, [(0, 0, 1.3 * thick), (0, 0, 4.0 * thick)], 0.8 * thick, "metal")
    add_cylinder(platform, [(0, 0, 4.0 * thick), (0, 0, 5.5 * thick)], 0.35 * thick, "base")


def _draw_leg(rod: mujoco.MjsBody, cylinder: mujoco.MjsBody, machine: Spr3, thick: float) -> None:
    add_cylinder(rod, [(0, -0.6 * thick, 0), (0, 0.6 * thick, 0)], 0.8 * thick, "rod")
    add_bar(rod, [(0, 0, 0), (0, 0, CYLINDER * machine.q_min)], 0.5 * thick, "metal", density=STEEL)
    long = -CYLINDER * machine.q_min
    add_cylinder(cylinder, [(0, 0, 0), (0, 0, long)], 0.95 * thick, "arm", density=ALUMINIUM)
    add_cylinder(cylinder, [(0, 0, long), (0, 0, long + 2 * thick)], 1.15 * thick, "rod")
    add_bar(cylinder, [(0, 0, -0.01 * thick), (0, 0, 0)], 1.25 * thick, "rod")
