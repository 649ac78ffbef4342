"""The leg as a MuJoCo model.

Two chains hang from the hip: A-O-F with the bars FJ and JI, D-O-E with the bars EH and HI; each bar
turns on the one before. Barrels turn on the frame at B and C, in each slides a rod. Kept in one
place are the bars' middles at G, their ends at the foot I, and the rods' ends at A and D. The paper
gives no masses: those here are aluminium links, barrels and rods of steel, as they are drawn.

A cylinder that gives way by a tenth of a millimetre moves the foot by millimetres. So the servos
are stiff, and the twin is without gravity; the check reports how far it would sag.
"""

from __future__ import annotations

import mujoco
import numpy as np

from pkm_gym.core.planar_twin import AXES
from pkm_gym.core.twin import (
    BANDWIDTH,
    Course,
    PistonSpeeds,
    Solver,
    add_drive,
    add_machine,
    add_stage,
    check_reach,
    close_loop,
    drive_pistons,
    new_spec,
)
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.drawn_twin import (
    CHAINS,
    CYLINDER,
    FOOT,
    Chain,
    draw_chain,
    draw_cylinder,
    draw_frame,
    thickness,
)
from pkm_gym.mechanisms.stroke_leg.mechanism import Leg
from pkm_gym.mechanisms.stroke_leg.step import Step
from pkm_gym.mechanisms.stroke_leg.workspace import GaitLeg

SOLVER = Solver(timestep=2.5e-4, solref=(1e-3, 1.0), integrator="Euler", gravity=False)
STIFFNESS = 2e6  # N/m, of a servo
DAMPING = 1.0  # N m s/rad, of a hinge: the servos alone leave what is heavy at the foot swinging
SIDE = 0.26  # m, of the rhombi that the default step is for
CLEAR = np.radians(1.0)  # of a dead line, where cylinders still hold the cranks
LOOPS = {"A": ("end_2", "A"), "D": ("end_4", "D"), "G": ("G_FJ", "G_EH"), "I": ("I_J", "I_H")}


def build(machine: Leg, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin assembled at a pose (2,).

    Raises:
        ValueError: for a pose out of reach.
    """
    pose = np.asarray(pose, dtype=float)
    check_reach(machine.inverse_kinematics(pose), pose)
    values = {name: float(row[0]) for name, row in coordinates(machine, pose[None], pose).items()}
    spec = new_spec("stroke_leg", SOLVER)
    thick = thickness(machine)
    height = _hip_height(machine) + FOOT * thick
    base = add_machine(spec, AXES, height)
    l, at = machine.l, machine.points(pose)
    draw_frame(spec, base, (at["O"], at["C"], at["B"]), height, thick)
    for look in CHAINS:
        crank, bar = look.letters[0], look.letters[1:]
        links = _add_chain(base, look, values, l)
        length, angle = {"A": (machine.l1, machine.phi), "D": (machine.l5, machine.gamma)}[crank]
        end = length * np.array([np.cos(angle), -np.sin(angle)])
        _add_site(links[0], crank, end)
        _add_site(links[1], f"G_{bar}", (l, 0.0))
        _add_site(links[2], f"I_{bar[1]}", (l, 0.0))
        draw_chain(links, look, l, end, thick)
    _add_site(spec.body("JI"), "tcp", (l, 0.0))
    shortest = _shortest(machine, pose)
    for name, frame, long, plane in zip(
        machine.joint_names, "BC", shortest, (0.0, CYLINDER), strict=True
    ):
        barrel = _add_link(base, f"barrel{name[1:]}", frame, at[frame], values[frame])
        rod = _add_rod(barrel, name, values[name])
        draw_cylinder(barrel, rod, long, plane * thick, thick)
        add_drive(spec, name, values[name], STIFFNESS / BANDWIDTH**2)
    for loop, ends in LOOPS.items():
        close_loop(spec, f"loop_{loop}", ends, SOLVER)
    top = height + at["B"][1] + 3.0 * thick
    add_stage(spec, (0.45 * machine.l, 0.0, 0.5 * top), 1.12 * top, seen_from=(0.4, -1.0, 0.3))
    return spec


def coordinates(machine: Leg, poses: FloatArray, home: FloatArray) -> dict[str, FloatArray]:
    """Return every joint's values (n,) at poses (n, 2) of the twin built at ``home``, by joint."""
    theta, varphi = machine.opening(poses).T
    at, then = machine.points(poses), machine.points(home)
    values = {
        "alpha": 1.5 * np.pi - varphi + theta,
        "beta": 1.5 * np.pi - varphi - theta,
        "F": 2.0 * theta,
        "J": -2.0 * theta,
        "E": -2.0 * theta,
        "H": 2.0 * theta,
        **dict(zip(machine.joint_names, machine.inverse_kinematics(poses).T, strict=True)),
    }
    for frame, crank in ("BA", "CD"):
        start = _direction(then[crank] - then[frame])
        turned = _direction(at[crank] - at[frame]) - start
        values[frame] = start + np.remainder(turned + np.pi, 2.0 * np.pi) - np.pi
    return values


def draw_poses(machine: Leg, n: int, generator: np.random.Generator) -> FloatArray:
    """Return the workspace's corners and n random poses of it, as far as both cranks are clear.

    Across a dead line (a design that isn't feasible) cylinders can't hold the leg as it was built.

    Raises:
        ValueError: where no pose is clear.
    """
    grid = machine.workspace_grid(25, 25)
    corners = grid[[0, 0, -1, -1], [0, -1, 0, -1]]
    inside = grid.reshape(-1, 2)
    clear, drawn = _clear(machine, corners), inside[_clear(machine, inside)]
    if not len(drawn):
        raise ValueError("its cranks cross their dead lines at every pose of its workspace")
    return np.concatenate([corners[clear], drawn[generator.integers(len(drawn), size=n)]])


def course(machine: Leg, samples: int = 201, task: object = None) -> Course:
    """Return a step of the leg: swing and stance.

    Raises:
        ValueError: where a crank comes to its dead line on the step.
    """
    del task  # the machine has all of it
    step = step_of(machine)
    motion = step.motion(np.linspace(0.0, step.period, samples))
    angles = machine.dead_point_angles(motion.position)
    name = min(angles, key=lambda name: float(np.nanmin(angles[name], initial=np.pi)))
    if np.nanmin(angles[name], initial=np.pi) <= 0.0:
        raise ValueError(f"the crank O{name[5]} crosses its dead line on the step")
    return Course(step.period, motion.position, motion.velocity)


def piston_speeds(machine: Leg, step: Step | None = None, samples: int = 200) -> PistonSpeeds:
    """Let the servos take the twin along a step, by default its own; compare its piston speeds.

    The foot lags by some tenths of a millimetre and the speeds differ from the planned ones by some
    1e-4 m/s.

    Raises:
        ValueError: for a step out of reach.
    """
    step = step or step_of(machine)
    motion = step.motion(np.linspace(0.0, step.period, round(step.period / SOLVER.timestep) + 1))
    course = Course(step.period, motion.position, motion.velocity)
    home = motion.position[0]
    spec = build(machine, home)
    return drive_pistons(machine, spec, home, course, samples, lambda points: points[:, :2])


def step_of(machine: Leg) -> Step:
    """Return the step that a leg takes: in its own rectangle, or the default one to its scale."""
    if isinstance(machine, GaitLeg):
        return Step(machine.stride, machine.lift, hip_height=machine.hip_height, x0=machine.x0)
    scale, usual = machine.l / SIDE, Step()
    return Step(scale * usual.stride, scale * usual.lift, hip_height=scale * usual.hip_height)


def frames(machine: Leg, poses: FloatArray) -> FloatArray:
    """Return the axes of the bar JI and the foot as columns, (n, 3, 4), at poses (n, 2)."""
    theta, varphi = machine.opening(poses).T
    beta = 1.5 * np.pi - varphi - theta
    found = np.zeros((len(poses), 3, 4))
    found[:, 0, 0] = found[:, 1, 1] = np.cos(beta)
    found[:, 1, 0], found[:, 0, 1] = np.sin(beta), -np.sin(beta)
    found[:, 2, 2], found[:, :2, 3] = 1.0, poses
    return found


def pose(machine: Leg, frame: FloatArray) -> FloatArray:
    """Return the pose (2,) of the foot's frame (3, 4)."""
    del machine
    return frame[:2, 3]


def margins(machine: Leg, pose: FloatArray, joints: FloatArray) -> FloatArray:
    """Return numbers (4,) > 0 in the modes that the machine is built in.

    The sines of the angles of OA to OB and of OD to OC, > 0 in the home mode, and what the rhombi
    that these cylinders open lack to being stretched and flat, rad; NaN when folded through.
    """
    a, d = np.sin(machine.crank_angles(pose))
    theta = machine.opening(machine.forward_kinematics(joints))[0]
    return np.array([a, machine.home_mode[1] * d, theta, 0.5 * np.pi - theta])


def _clear(machine: Leg, poses: FloatArray) -> FloatArray:
    """Return whether both cranks are on their side of the dead line at poses (n, 2)."""
    return np.min(list(machine.dead_point_angles(poses).values()), axis=0) > CLEAR


def _direction(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.arctan2(vectors[..., 1], vectors[..., 0]))


def _add_chain(
    base: mujoco.MjsBody, look: Chain, values: dict[str, float], l: float
) -> tuple[mujoco.MjsBody, mujoco.MjsBody, mujoco.MjsBody]:
    """Add an upper link of the rhombi, the long bar on it, and the lower link on that one."""
    first, second = look.letters[1], look.letters[2]
    upper = _add_link(base, f"O{first}", look.joint, (0.0, 0.0), values[look.joint])
    middle = _add_link(upper, f"{first}{second}", first, (l, 0.0), values[first])
    return upper, middle, _add_link(middle, f"{second}I", second, (2.0 * l, 0.0), values[second])


def _add_link(
    parent: mujoco.MjsBody,
    name: str,
    joint: str,
    at: tuple[float, float] | FloatArray,
    angle: float,
) -> mujoco.MjsBody:
    """Add a body whose x axis is along it, on a hinge at a point (2,) of another."""
    quat = [np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)]
    body = parent.add_body(name=name, pos=[*at, 0.0], quat=quat)
    hinge = mujoco.mjtJoint.mjJNT_HINGE
    body.add_joint(name=joint, type=hinge, axis=[0.0, 0.0, 1.0], ref=angle, damping=DAMPING)
    return body


def _add_rod(barrel: mujoco.MjsBody, joint: str, length: float) -> mujoco.MjsBody:
    """Add a rod that slides in a barrel along its x axis and ends at a site."""
    rod = barrel.add_body(name=f"rod{joint[1:]}", pos=[length, 0.0, 0.0])
    slide = mujoco.mjtJoint.mjJNT_SLIDE
    rod.add_joint(name=joint, type=slide, axis=[1.0, 0.0, 0.0], ref=length)
    _add_site(rod, f"end{joint[1:]}", (0.0, 0.0))
    return rod


def _add_site(body: mujoco.MjsBody, name: str, at: tuple[float, float] | FloatArray) -> None:
    body.add_site(name=name, pos=[*at, 0.0], size=[0.001] * 3, group=4)


def _hip_height(machine: Leg) -> float:
    """Return how high the hip stands over the ground, or else over all that the foot reaches, m."""
    if isinstance(machine, GaitLeg):
        return machine.hip_height
    return -float(machine.workspace()[:, 1].min())


def _shortest(machine: Leg, pose: FloatArray) -> FloatArray:
    """Return the cylinders' shortest lengths (2,) in the workspace and at a pose, m."""
    poses = np.concatenate([machine.workspace_grid(5, 5).reshape(-1, 2), pose[None]])
    return np.asarray(np.nanmin(machine.inverse_kinematics(poses), axis=0))
