"""The 6-PUS as a MuJoCo model.

Six sliders on vertical screws; on each a rod on the two hinges of its U joint; a platform that
slides and turns freely. The end of each rod is kept in its place on the platform: eighteen
independent loop equations for twenty-four coordinates. The paper gives no masses: those here are
what is drawn, see ``drawn_twin``.
"""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

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
from pkm_gym.mechanisms.pus6.drawn_twin import (
    BELOW,
    carried,
    columns,
    draw_base,
    draw_platform,
    draw_rod,
    draw_slider,
    draw_stage,
    draw_work,
    screw_inertia,
)
from pkm_gym.mechanisms.pus6.engraving import motion, plane
from pkm_gym.mechanisms.pus6.mechanism import Pus6

SOLVER = Solver(timestep=5e-4, solref=(1e-3, 1.0))
CORNERS = 6  # of the box, of 64, that the twin is tried at
COLUMNS = columns()  # (6, 3, 3): the axes of each leg's column as columns: outwards, along, up


def build(machine: Pus6, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin assembled at a pose (6,).

    Raises:
        ValueError: for a pose out of reach.
    """
    pose = np.asarray(pose, dtype=float)
    heights = machine.inverse_kinematics(pose)
    check_reach(heights, pose)
    spec = new_spec("pus6", SOLVER)
    base = add_machine(spec, np.eye(3), BELOW)
    draw_base(spec, base, machine)
    draw_work(base, plane(machine))

    platform = base.add_body(name="platform", pos=pose[:3], quat=quaternion(machine.rotation(pose)))
    for name, axis, home in zip("xyz", np.eye(3), pose[:3], strict=True):
        # the axes of a slide are the body's, which is turned
        local = machine.rotation(pose).T @ axis
        platform.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=local, ref=home)
    platform.add_joint(name="turn", type=mujoco.mjtJoint.mjJNT_BALL)
    platform.add_site(name="tcp", size=[0.001] * 3, group=4)
    joints, _ = _layout(machine)
    draw_platform(platform, machine, joints)

    screw = screw_inertia(machine)
    feet, angles = machine.points(pose)["A"], _angles(machine, pose)
    for i, name in enumerate(machine.joint_names):
        platform.add_site(name=f"joint_{i + 1}", pos=joints[i], size=[0.001] * 3, group=4)
        slider = base.add_body(name=f"slider_{i + 1}", pos=feet[i])
        slider.add_joint(
            name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[0.0, 0.0, 1.0], ref=heights[i],
            armature=screw,
        )  # fmt: skip
        draw_slider(slider)
        _add_rod(slider, machine, i, angles[i])
        close_loop(spec, f"loop_{i + 1}", (f"end_{i + 1}", f"joint_{i + 1}"), SOLVER)
        add_drive(spec, name, float(heights[i]), screw + carried(machine, joints))
    draw_stage(spec, machine)
    return spec


def coordinates(machine: Pus6, poses: FloatArray, home: FloatArray) -> dict[str, FloatArray]:
    """Return every joint's values at poses (n, 6) of the twin built at ``home``, by joint."""
    turned = np.swapaxes(machine.rotation(home), -1, -2) @ machine.rotation(poses)
    values = {"turn": np.array([quaternion(matrix) for matrix in turned])}
    values |= dict(zip("xyz", poses[:, :3].T, strict=True))
    values |= dict(zip(machine.joint_names, machine.inverse_kinematics(poses).T, strict=True))
    angles = _angles(machine, poses)
    for i in range(6):
        values |= {f"swing_{i + 1}": angles[:, i, 0], f"lean_{i + 1}": angles[:, i, 1]}
    return values


def draw_poses(machine: Pus6, n: int, generator: np.random.Generator) -> FloatArray:
    """Return some corners of the box and n random poses of it, (6 + n, 6)."""
    corners = generator.choice([-1.0, 1.0], (CORNERS, 6))
    inside = generator.uniform(-1.0, 1.0, (n, 6))
    return machine.in_box(np.concatenate([corners, inside]))


def course(machine: Pus6, samples: int = 201, task: object = None) -> Course:
    """Return the way along the spiral that is engraved, from the park and back."""
    del task  # the machine has its box
    duration, poses, rates = motion(machine, samples)
    return Course(duration, poses, machine.twist(poses, rates))


def frames(machine: Pus6, poses: FloatArray) -> FloatArray:
    """Return the platform's axes and the tool's tip as columns, (n, 3, 4), at poses (n, 6)."""
    return np.concatenate([machine.rotation(poses), poses[..., :3, None]], axis=-1)


def pose(machine: Pus6, frame: FloatArray) -> FloatArray:
    """Return the pose (6,) of a platform's frame (3, 4), beta within a quarter turn."""
    del machine
    return np.array([
        *frame[:, 3],
        np.arctan2(-frame[1, 2], frame[2, 2]),
        np.arcsin(np.clip(frame[0, 2], -1.0, 1.0)),
        np.arctan2(-frame[0, 1], frame[0, 0]),
    ])  # fmt: skip


def margins(machine: Pus6, pose: FloatArray, joints: FloatArray) -> FloatArray:
    """Return numbers (7,) > 0 in the modes that the machine is built in.

    The determinant of the rods' lines over its value at home, > 0 on this side of the direct
    singularities, and how far each slider is above its S joint, m: the rods hang.
    """
    arms, rods = _rods(machine, pose, joints)
    at_home = _determinant(*_rods(machine, np.zeros(6), np.zeros(6)))
    return np.array([_determinant(arms, rods) / at_home, *-rods[:, 2]])


def engraves(machine: Pus6, poses: FloatArray) -> npt.NDArray[np.bool_]:
    """Return whether the tool leaves a line (n,) at poses (n, 6) of its course."""
    return plane(machine).holds(poses)


def _rods(machine: Pus6, pose: FloatArray, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return arms and rods (6, 3), m: from the tip to the S joints, from the sliders to them."""
    on_platform, screws = _layout(machine)
    arms = on_platform @ machine.rotation(pose).T
    feet = np.column_stack([screws, machine.home + joints])
    return arms, pose[:3] + arms - feet


def _determinant(arms: FloatArray, rods: FloatArray) -> float:
    return float(np.linalg.det(np.concatenate([np.cross(arms, rods), rods], axis=1)))


def _layout(machine: Pus6) -> tuple[FloatArray, FloatArray]:
    """Return the S joints (6, 3) in the platform's frame and where the screws stand (6, 2), m."""
    rows = machine.layout.reshape(6, -1)
    return rows[:, :3], rows[:, 3:]


def _angles(machine: Pus6, pose: FloatArray) -> FloatArray:
    """Return the angles (..., 6, 2), rad, of the U joints: of the first hinge and of the second.

    The first turns about the tangent at the column, the second about what was radial there; at 0
    both, the rod hangs straight down.
    """
    at = machine.points(pose)
    rods = np.einsum("ikj,...ik->...ij", COLUMNS, at["C"] - at["A"]) / machine.L
    swing = np.arctan2(-rods[..., 0], -rods[..., 2])
    return np.stack([swing, np.arcsin(rods[..., 1])], axis=-1)


def _add_rod(slider: mujoco.MjsBody, machine: Pus6, i: int, angles: FloatArray) -> None:
    """Add a rod, along its -z, on the hinges of its U joint; it ends at a site."""
    (c, d), (s, e) = np.cos(angles), np.sin(angles)
    turned = np.array([[c, s * e, s * d], [0.0, d, -e], [-s, c * e, c * d]])  # Ry(swing) Rx(lean)
    rod = slider.add_body(name=f"rod_{i + 1}", quat=quaternion(COLUMNS[i] @ turned))
    for name, axis, angle in (
        (f"swing_{i + 1}", [0.0, d, -e], angles[0]), (f"lean_{i + 1}", [1.0, 0.0, 0.0], angles[1]),
    ):  # fmt: skip
        rod.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis, ref=angle)
    rod.add_site(name=f"end_{i + 1}", pos=[0.0, 0.0, -machine.L], size=[0.001] * 3, group=4)
    draw_rod(rod, machine.L)
