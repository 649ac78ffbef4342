"""The 5-PSS/UPU as a MuJoCo model.

The platform rides on the UPU limb: two hinges at the base, a slide, two hinges at the platform,
which leave it five freedoms and the yaw of such a limb. On each rail slides a slider, on it turns a
rod on a ball joint, whose end is kept in its place on the platform: fifteen independent loop
equations for twenty-five coordinates. The five freedoms beyond those of the platform are the rods'
spins about themselves, which the damping of their joints holds. The paper gives no masses: those
here are what is drawn, see ``drawn_twin``.
"""

from __future__ import annotations

import mujoco
import numpy as np

from pkm_gym.core.twin import (
    Course,
    Solver,
    add_drive,
    add_machine,
    check_reach,
    close_loop,
    new_spec,
    quaternion,
)
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.drawn_twin import (
    Look,
    carried,
    draw_base,
    draw_leg,
    draw_platform,
    draw_rod,
    draw_slider,
    draw_stage,
    draw_stem,
    screw_inertia,
)
from pkm_gym.mechanisms.pss5_upu.kinematics import LIMBS, PER_LIMB
from pkm_gym.mechanisms.pss5_upu.lissajous import DURATION, motion
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

SOLVER = Solver(timestep=5e-4, solref=(1e-3, 1.0), bears=False)
SERVO = 500.0  # rad/s: 2e6 N/m where n is 0.5 m
FRICTION = 0.05  # N m s/rad, of the S joints on the sliders
CORNERS = 6  # of the box, of 32, that the twin is tried at
SIX = 6  # rank of the limbs' system where the sliders hold the platform
UP = np.array([0.0, 0.0, 1.0])


def build(machine: Pss5Upu, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin assembled at a pose (5,), with the yaw that its UPU limb gives.

    Raises:
        ValueError: for a pose out of reach.
    """
    machine, pose = machine.real(), np.asarray(pose, dtype=float)
    sliders = machine.inverse_kinematics(pose)
    check_reach(sliders, pose)
    spec, look = new_spec("pss5_upu", SOLVER), Look.of(machine)
    base = add_machine(spec, np.eye(3), look.below)
    draw_base(base, look)
    platform = _add_upu(base, machine, pose, look)
    draw_platform(platform, look)

    at, rails, joints = machine.points(pose), _rails(machine), _joints(machine)
    rods, screw = (at["a"] - at["b"]) / machine.L, screw_inertia(look)
    for i, name in enumerate(machine.joint_names):
        platform.add_site(name=f"joint_{i + 1}", pos=joints[i], size=[0.001] * 3, group=4)
        slider = base.add_body(name=f"slider_{i + 1}", pos=at["b"][i])
        slider.add_joint(
            name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=rails[i], ref=sliders[i],
            armature=screw,
        )  # fmt: skip
        draw_slider(slider, look, i)
        rod = slider.add_body(name=f"rod_{i + 1}", quat=_towards(rods[i]))
        rod.add_joint(name=f"s_{i + 1}", type=mujoco.mjtJoint.mjJNT_BALL, damping=FRICTION)
        rod.add_site(name=f"end_{i + 1}", pos=machine.L * UP, size=[0.001] * 3, group=4)
        draw_rod(rod, look)
        close_loop(spec, f"loop_{i + 1}", (f"end_{i + 1}", f"joint_{i + 1}"), SOLVER)
        add_drive(spec, name, float(sliders[i]), screw + carried(look), bandwidth=SERVO)
    draw_stage(spec, look)
    return spec


def coordinates(machine: Pss5Upu, poses: FloatArray, home: FloatArray) -> dict[str, FloatArray]:
    """Return every joint's values at poses (n, 5) of the twin built at ``home``, by joint.

    The rods are turned to their places without a spin.
    """
    machine = machine.real()
    values = dict(zip(UPU_JOINTS, np.moveaxis(_upu(machine, poses), -1, 0), strict=True))
    values |= dict(zip(machine.joint_names, machine.inverse_kinematics(poses).T, strict=True))
    rods, at_home = (machine.limbs(rows)[..., 3:6] for rows in (poses, home))
    for i in range(LIMBS):
        turned = np.empty(9)
        mujoco.mju_quat2Mat(turned, _towards(at_home[i]))
        values[f"s_{i + 1}"] = _towards(rods[:, i] @ turned.reshape(3, 3))
    return values


def draw_poses(machine: Pss5Upu, n: int, generator: np.random.Generator) -> FloatArray:
    """Return some corners of the box and n random poses of it, (6 + n, 5)."""
    corners = generator.choice([-1.0, 1.0], (CORNERS, LIMBS))
    inside = generator.uniform(-1.0, 1.0, (n, LIMBS))
    return machine.in_box(np.concatenate([corners, inside]))


def course(machine: Pss5Upu, samples: int = 201, task: object = None) -> Course:
    """Return the way once around the Lissajous figure."""
    del task  # the machine has its box
    poses, rates = motion(machine, samples)
    return Course(DURATION, poses, machine.real().twist(poses, rates))


def frames(machine: Pss5Upu, poses: FloatArray) -> FloatArray:
    """Return the platform's axes and centre as columns, (n, 3, 4), at poses (n, 5)."""
    rotation = machine.real().rotation(poses)
    return np.concatenate([rotation, poses[..., :3, None]], axis=-1)


def pose(machine: Pss5Upu, frame: FloatArray) -> FloatArray:
    """Return the pose (5,) of a platform's frame (3, 4), beta within a quarter turn."""
    del machine
    beta = -np.arcsin(np.clip(frame[2, 0], -1.0, 1.0))
    return np.array([*frame[:, 3], beta, np.arctan2(frame[2, 1], frame[2, 2])])


def margins(machine: Pss5Upu, pose: FloatArray, joints: FloatArray) -> FloatArray:
    """Return numbers (6,) > 0 in the modes that the machine is built in.

    The determinant of the limbs' system times the sign that it has at the box's centre, 0 for a
    layout that is singular there; and each rod's cosine to its rail: the slider is behind it.
    """
    machine = machine.real()
    centre = machine.in_box(np.zeros(5))
    side = np.sign(np.linalg.det(machine.system(centre))) * (machine.rank(centre) == SIX)
    rotation, rails = machine.rotation(pose), _rails(machine)
    arms = _joints(machine) @ rotation.T
    rods = (pose[:3] + arms - machine.rails()[:, 0] - joints[:, None] * rails) / machine.L
    held = np.concatenate([rods, np.cross(arms, rods) / machine.r], axis=1)
    row = machine.system(pose)[5]
    determinant = np.linalg.det(np.concatenate([held, row[None]]))
    return np.array([side * determinant, *(rods * rails).sum(axis=1)])


# Its parts ----------------------------------------------------------------------------------------

UPU_JOINTS = ("upu_tilt", "upu_lean", "upu_length", "upu_nod", "upu_roll")


def _add_upu(
    base: mujoco.MjsBody, machine: Pss5Upu, pose: FloatArray, look: Look
) -> mujoco.MjsBody:
    """Add the passive limb at a pose (5,), its U joints as hinges; return the platform on it."""
    tilt, lean, length, nod, roll = _upu(machine, pose)
    hinge, slide = mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE
    first, second = _x(tilt) @ _y(lean), _y(nod) @ _x(roll)
    leg = base.add_body(name="upu_leg", quat=quaternion(first))
    leg.add_joint(name="upu_tilt", type=hinge, axis=_y(lean)[0], ref=tilt)
    leg.add_joint(name="upu_lean", type=hinge, axis=[0.0, 1.0, 0.0], ref=lean)
    draw_leg(leg, look)
    stem = leg.add_body(name="upu_stem", pos=length * UP)
    stem.add_joint(name="upu_length", type=slide, axis=UP, ref=length)
    draw_stem(stem, look)
    platform = stem.add_body(name="platform", quat=quaternion(second))
    platform.add_joint(name="upu_nod", type=hinge, axis=_x(roll)[1], ref=nod)
    platform.add_joint(name="upu_roll", type=hinge, axis=[1.0, 0.0, 0.0], ref=roll)
    platform.add_site(name="tcp", size=[0.001] * 3, group=4)
    return platform


def _upu(machine: Pss5Upu, pose: FloatArray) -> FloatArray:
    """Return the values (..., 5) of the passive limb's joints at poses (..., 5), rad and m.

    From O outwards: about the base's x axis, about y, the length, about y, about the platform's x.
    """
    x, y, z = np.moveaxis(np.asarray(pose, dtype=float)[..., :3], -1, 0)
    rotation = machine.rotation(pose)
    tilt = np.arctan2(-y, z)
    lean = np.arctan2(x, np.hypot(y, z))
    (ux, uy, uz), (_, vy, vz), (_, wy, wz) = np.moveaxis(rotation, (-1, -2), (0, 1))
    cosine, sine = np.cos(tilt), np.sin(tilt)
    nodded = np.arctan2(uy * sine - uz * cosine, ux)
    roll = np.arctan2(-cosine * wy - sine * wz, cosine * vy + sine * vz)
    return np.stack([tilt, lean, machine.upu_length(pose), nodded - lean, roll], axis=-1)


def _rails(machine: Pss5Upu) -> FloatArray:
    """Return the unit vectors (5, 3) of the rails."""
    return machine.layout.reshape(LIMBS, PER_LIMB)[:, 4:]


def _joints(machine: Pss5Upu) -> FloatArray:
    """Return the S joints (5, 3) in the platform's frame, m."""
    return np.pad(machine.layout.reshape(LIMBS, PER_LIMB)[:, :2], ((0, 0), (0, 1)))


def _towards(rods: FloatArray) -> FloatArray:
    """Return the quaternions (..., 4) that turn z to unit vectors (..., 3) on the shortest way."""
    x, y, z = np.moveaxis(rods, -1, 0)
    found = np.stack([1.0 + z, -y, x, np.zeros_like(x)], axis=-1)
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))


def _x(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def _y(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
