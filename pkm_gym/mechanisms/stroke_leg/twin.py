"""The leg as a MuJoCo model.

Two chains hang from the hip: A-O-F with the bars FJ and JI, D-O-E with the bars EH and HI; each bar
turns on the one before. Barrels turn on the frame at B and C, in each slides a rod. Kept in one
place are the bars' middles at G, their ends at the foot I, and the rods' ends at A and D. The paper
gives no masses: those here are aluminium links, barrels and rods of steel, as they are drawn.

The servos are as stiff as cylinders of oil, so the twin is without gravity: what its weight does to
them is tens of times larger at the foot, and known without a simulation.
"""

from __future__ import annotations

from typing import NamedTuple

import mujoco
import numpy as np

from pkm_gym.core.planar_twin import AXES, add_box
from pkm_gym.core.twin import (
    ALUMINIUM,
    BANDWIDTH,
    STEEL,
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
from pkm_gym.mechanisms.stroke_leg.mechanism import Leg
from pkm_gym.mechanisms.stroke_leg.step import Step
from pkm_gym.mechanisms.stroke_leg.workspace import GaitLeg

SOLVER = Solver(timestep=2.5e-4, solref=(1e-3, 1.0), integrator="Euler", gravity=False)
STIFFNESS = 2e6  # N/m, of a servo
DAMPING = 1.0  # N m s/rad, of a hinge: the servos alone leave what is heavy at the foot swinging
SIDE = 0.26  # m, of the rhombi that the default step is for
CLEAR = np.radians(1.0)  # of a dead line, where cylinders still hold the cranks

# Where things are, in thicknesses from the plane of the inner bars towards who looks at the leg.
OUTER = (-1.7, 1.7)
CRANK, CYLINDER = 2.9, 4.1  # of D
FRAME = (-3.2, 5.6)


def build(machine: Leg, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin assembled at a pose (2,).

    Raises:
        ValueError: for a pose out of reach.
    """
    pose = np.asarray(pose, dtype=float)
    check_reach(machine.inverse_kinematics(pose), pose)
    values = {name: float(row[0]) for name, row in coordinates(machine, pose[None], pose).items()}
    spec = new_spec("stroke_leg", SOLVER)
    thick = 0.05 * machine.l
    height = _hip_height(machine) + 1.3 * thick
    base = add_machine(spec, AXES, height)
    l, at = machine.l, machine.points(pose)

    for chain, (crank, length, angle, planes) in {
        ("alpha", "E", "H"): ("D", machine.l5, machine.gamma, (0.0,)),
        ("beta", "F", "J"): ("A", machine.l1, machine.phi, OUTER),
    }.items():
        across = OUTER if planes == (0.0,) else (0.0,)
        upper, middle, lower = _add_chain(base, chain, values, l)
        end = length * np.array([np.cos(angle), -np.sin(angle)])
        _add_site(upper, crank, end)
        _add_site(middle, f"G_{chain[1]}", (l, 0.0))
        _draw_crank(upper, end, crank, thick)
        for body, bar, where in ((upper, l, planes), (middle, 2.0 * l, across), (lower, l, planes)):
            _draw_bar(body, bar, where, thick)

    _add_site(spec.body("JI"), "tcp", (l, 0.0))
    _add_site(spec.body("HI"), "I", (l, 0.0))
    _draw_foot(spec.body("HI"), l, thick)
    shortest = _shortest(machine, pose)
    for k, (frame, crank, plane) in enumerate((("B", "A", 0.0), ("C", "D", CYLINDER))):
        name = machine.joint_names[k]
        barrel = _add_link(base, f"barrel{name[1:]}", frame, at[frame], values[frame])
        rod = barrel.add_body(name=f"rod{name[1:]}", pos=[values[name], 0.0, 0.0])
        slide = mujoco.mjtJoint.mjJNT_SLIDE
        rod.add_joint(name=name, type=slide, axis=[1.0, 0.0, 0.0], ref=values[name])
        _add_site(rod, f"end{name[1:]}", (0.0, 0.0))
        _draw_cylinder(barrel, rod, shortest[k], plane * thick, thick)
        add_drive(spec, name, values[name], STIFFNESS / BANDWIDTH**2)
    for one, other in (("G_F", "G_E"), ("tcp", "I"), ("end_2", "A"), ("end_4", "D")):
        close_loop(spec, f"loop_{other}", (one, other), SOLVER)
    _draw_frame(base, at, height, thick)
    top = at["B"][1] + 4.0 * thick
    add_stage(
        spec, (0.2 * machine.l, 0.0, 0.5 * (height + top)), 1.12 * (height + top),
        seen_from=(0.55, -1.0, 0.22),
    )  # fmt: skip
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
    """
    grid = machine.workspace_grid(25, 25)
    corners = grid[[0, 0, -1, -1], [0, -1, 0, -1]]
    inside = grid.reshape(-1, 2)
    clear, drawn = _clear(machine, corners), inside[_clear(machine, inside)]
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


class PistonSpeeds(NamedTuple):
    """What two cylinders do along a step.

    Times are (n,), s; the poses (n, 2), m, are the foot's in MuJoCo; the speeds (n, 2), m/s, are
    what MuJoCo has, what the Jacobian says of the foot's motion in MuJoCo, and what it says of the
    step as it is planned.
    """

    times: FloatArray
    poses: FloatArray
    twin: FloatArray
    analytic: FloatArray
    planned: FloatArray


def piston_speeds(machine: Leg, step: Step | None = None, samples: int = 200) -> PistonSpeeds:
    """Let the servos take the twin along a step, by default its own; compare its piston speeds.

    The servos know the lengths and rates of inverse kinematics but no inertia, so the foot lags by
    some tenths of a millimetre and the speeds differ from the planned ones by some 1e-4 m/s. Hence
    the Jacobian gets the foot's motion as MuJoCo has it: its way over a time step, at the middle of
    that way, since MuJoCo's velocities are those from one position to the next.

    Raises:
        ValueError: for a step out of reach.
    """
    step = step or step_of(machine)
    moves = round(step.period / SOLVER.timestep)
    times = np.linspace(0.0, step.period, moves + 1)
    motion = step.motion(times)
    lengths = machine.inverse_kinematics(motion.position)
    check_reach(lengths, motion.position[0])
    planned = np.einsum("nij,nj->ni", machine.inverse_jacobian(motion.position), motion.velocity)
    controls = lengths - lengths[0] + 2.0 / BANDWIDTH * planned  # the servos brake by kv = 2 kp / w

    model = build(machine, motion.position[0]).compile()
    data = mujoco.MjData(model)
    servos = [model.actuator(f"servo_{name}").id for name in machine.joint_names]
    rates = [model.joint(name).dofadr[0] for name in machine.joint_names]
    origin, foot = (model.site(name).id for name in ("origin", "tcp"))
    wanted = np.round(np.linspace(0, moves, samples + 1)[1:]).astype(int)
    measured, ends = [], []
    for k in range(1, moves + 1):
        data.ctrl[servos] = controls[k]
        mujoco.mj_step(model, data)
        if k == wanted[len(measured)]:
            before = data.site_xpos[foot].copy()
            mujoco.mj_kinematics(model, data)
            ends.append(np.stack([before, data.site_xpos[foot]]) - data.site_xpos[origin])
            measured.append(data.qvel[rates].copy())
    way = np.array(ends) @ AXES[:, :2]
    poses = way.mean(axis=1)
    inverse = machine.inverse_jacobian(poses)
    analytic = np.einsum("nij,nj->ni", inverse, np.diff(way, axis=1)[:, 0] / SOLVER.timestep)
    return PistonSpeeds(times[wanted], poses, np.array(measured), analytic, planned[wanted])


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
    base: mujoco.MjsBody, joints: tuple[str, str, str], values: dict[str, float], l: float
) -> tuple[mujoco.MjsBody, mujoco.MjsBody, mujoco.MjsBody]:
    """Add an upper link of the rhombi, the long bar on it, and the lower link on that one."""
    turn, first, second = joints
    upper = _add_link(base, f"O{first}", turn, (0.0, 0.0), values[turn])
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


# How it looks, and what it weighs -----------------------------------------------------------------


def _draw_bar(body: mujoco.MjsBody, length: float, planes: tuple[float, ...], thick: float) -> None:
    """Draw a bar in the middle, or two outside, with an eye at either end."""
    for z in (plane * thick for plane in planes):
        radius, wide = (0.7, 0.8) if len(planes) == 1 else (0.5, 0.55)
        add_bar(body, [(0, 0, z), (length, 0, z)], radius * thick, "rod", density=ALUMINIUM)
        for x in (0.0, length):
            _draw_eye(body, (x, 0.0), (z - wide * thick, z + wide * thick), 1.0 * thick, "rod")


def _draw_crank(body: mujoco.MjsBody, end: FloatArray, name: str, thick: float) -> None:
    planes = OUTER if name == "A" else (CRANK,)
    for z in (plane * thick for plane in planes):
        add_bar(body, [(0, 0, z), (*end, z)], 0.5 * thick, "arm", density=ALUMINIUM)
        for point in ((0.0, 0.0), end):
            _draw_eye(body, point, (z - 0.55 * thick, z + 0.55 * thick), 1.1 * thick, "arm")


def _draw_eye(
    body: mujoco.MjsBody, at: tuple[float, float] | FloatArray, between: tuple[float, float],
    radius: float, color: str,
) -> None:  # fmt: skip
    add_cylinder(body, [(*at, between[0]), (*at, between[1])], radius, color)


def _draw_foot(body: mujoco.MjsBody, l: float, thick: float) -> None:
    _draw_eye(body, (l, 0.0), (-1.3 * thick, 1.3 * thick), 1.3 * thick, "platform")


def _draw_cylinder(
    barrel: mujoco.MjsBody, rod: mujoco.MjsBody, shortest: float, z: float, thick: float
) -> None:
    long = 0.8 * shortest
    add_cylinder(barrel, [(0.1 * long, 0, z), (long, 0, z)], 1.1 * thick, "base", density=STEEL)
    _draw_eye(barrel, (0.0, 0.0), (z - 0.7 * thick, z + 0.7 * thick), 1.1 * thick, "base")
    add_bar(rod, [(-0.92 * shortest, 0, z), (0, 0, z)], 0.5 * thick, "metal", density=STEEL)
    _draw_eye(rod, (0.0, 0.0), (z - 0.6 * thick, z + 0.6 * thick), 0.9 * thick, "metal")


def _draw_frame(
    base: mujoco.MjsBody, at: dict[str, FloatArray], height: float, thick: float
) -> None:
    for z in (plane * thick for plane in FRAME):
        for one, other in ("OC", "CB", "BO"):
            add_bar(base, [(*at[one], z), (*at[other], z)], 0.5 * thick, "base")
