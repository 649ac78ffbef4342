"""What the mechanisms' MuJoCo twins share: solver settings, loops, drives, and their stage.

Every twin stands in a body ``machine`` whose frame is the mechanism's own, marked by the site
``origin``; the site ``tcp`` is the point whose velocity is the mechanism's twist, or the linear
part of it, its body's angular velocity the other. Each joint that is driven bears the mechanism's
name for it and has its value, so does a servo ``servo_NAME`` whose control is the wanted value less
the one of the pose that the twin was built at, and a motor ``motor_NAME`` (N or N m). Every
equality is a ``connect`` that closes a loop.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal, NamedTuple, Protocol

import mujoco
import numpy as np

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.types import FloatArray

COLORS: dict[str, tuple[tuple[float, float, float], float, float]] = {  # rgb, specular, reflectance
    "base": ((0.20, 0.21, 0.23), 0.4, 0.0),
    "arm": ((0.07, 0.20, 0.36), 0.7, 0.0),
    "rod": ((0.36, 0.56, 0.74), 0.7, 0.0),
    "metal": ((0.78, 0.79, 0.81), 1.0, 0.0),
    "platform": ((0.92, 0.58, 0.06), 0.6, 0.0),
    "floor": ((0.93, 0.94, 0.95), 0.0, 0.0),
}
LIGHTS = (((-0.5, -0.8, 1.9), 0.42, True), ((1.6, -0.9, 0.9), 0.2, False))  # towards it, strength
BANDWIDTH = 150.0  # rad/s, of the servos
FIELD_OF_VIEW = 24.0  # deg, of the camera
ALUMINIUM, STEEL = 2700.0, 7850.0  # kg/m^3
INTEGRATORS = {
    "implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST,
    "Euler": mujoco.mjtIntegrator.mjINT_EULER,
}


@dataclass(frozen=True)
class Solver:
    """How MuJoCo simulates a twin; its defaults leave millimetres of error in the loops.

    Attributes:
        timestep: s.
        solref: time constant (s) and damping ratio of the loops.
        solimp: impedance of the loops.
        integrator: of MuJoCo.
        gravity: whether the twin has weight, where it is checked and where it is driven.
        bears: whether the servos bear it in the check; not where some feasible designs are so near
            a singularity that they fall.
    """

    timestep: float
    solref: tuple[float, float]
    solimp: tuple[float, float, float, float, float] = (0.9999, 0.9999, 0.001, 0.5, 2.0)
    integrator: Literal["implicitfast", "Euler"] = "implicitfast"
    gravity: bool = True
    bears: bool = True

    def __str__(self) -> str:
        """Return the settings as the table of the check shows them."""
        held = "" if self.bears else ", held without gravity"
        return (
            f"timestep {self.timestep:g} s, {self.integrator}, Newton 1e-14, "
            f"solref {self.solref[0]:g} {self.solref[1]:g}, solimp {self.solimp[0]:g}"
            f"{held if self.gravity else ', no gravity'}"
        )


class Course(NamedTuple):
    """A motion of the platform at equal time steps.

    Poses and twists are (n, k), so are accelerations where the mechanism has dynamics; the duration
    is in seconds.
    """

    duration: float
    poses: FloatArray
    twists: FloatArray
    accelerations: FloatArray | None = None

    def at_speed(self, factor: float) -> Course:
        """Return the same motion, ``factor`` times as fast."""
        faster = None if self.accelerations is None else factor**2 * self.accelerations
        return Course(self.duration / factor, self.poses, factor * self.twists, faster)


class PistonSpeeds(NamedTuple):
    """What cylinders do that servos take along a course.

    Times are (n,), s; the poses (n, k) are the tool's in MuJoCo; the speeds (n, joints), m/s, are
    what MuJoCo has, what the Jacobian says of the tool's motion in MuJoCo, and what it says of the
    course as it is planned.
    """

    times: FloatArray
    poses: FloatArray
    twin: FloatArray
    analytic: FloatArray
    planned: FloatArray


class TwinModule(Protocol):
    """What the twin.py of a mechanism holds, whose ``twin_module`` names it.

    Where the mechanism has dynamics, ``build_lumped`` beside it returns the model that the dynamics
    describes. ``piston_speeds`` beside it, of a machine of cylinders, returns the ``PistonSpeeds``
    of the twin along its path, which the check compares.
    ``engraves`` beside it says of poses (n, k) of the course whether the tool leaves a line (n,),
    which movies show.
    """

    SOLVER: Solver

    def build(self, machine: Any, pose: FloatArray) -> mujoco.MjSpec:
        """Return the twin assembled at a pose (k,); ValueError where there is none."""

    def coordinates(
        self, machine: Any, poses: FloatArray, home: FloatArray
    ) -> Mapping[str, FloatArray]:
        """Return every joint's values (n, ...) at poses (n, k), by joint, from the home pose on."""

    def frames(self, machine: Any, poses: FloatArray) -> FloatArray:
        """Return the platform's axes and position as columns (n, 3, 4) at poses (n, k)."""

    def pose(self, machine: Any, frame: FloatArray) -> FloatArray:
        """Return the pose (k,) of a platform's frame (3, 4)."""

    def margins(self, machine: Any, pose: FloatArray, joints: FloatArray) -> FloatArray:
        """Return numbers (m,) > 0 in the modes that the machine is assembled in."""

    def draw_poses(self, machine: Any, n: int, generator: np.random.Generator) -> FloatArray:
        """Return telling poses and n random ones of the workspace (..., k)."""

    def course(self, machine: Any, samples: int = 201, task: Any = None) -> Course:
        """Return the motion along a task's path, or the default one."""


CONTRACT = ("SOLVER", "build", "coordinates", "frames", "pose", "margins", "draw_poses", "course")


def twin_module(mechanism: Mechanism) -> TwinModule:
    """Return the module that builds a mechanism's twin.

    Raises:
        ValueError: for a mechanism that has none, or a module that lacks part of the contract.
    """
    if not mechanism.twin_module:
        raise ValueError(f"{type(mechanism).__name__} has no MuJoCo twin")
    module: Any = import_module(mechanism.twin_module)
    missing = [name for name in CONTRACT if not hasattr(module, name)]
    if missing:
        raise ValueError(
            f"{mechanism.twin_module} lacks {', '.join(missing)}: the module of a twin holds "
            f"{', '.join(CONTRACT)}"
        )
    found: TwinModule = module
    return found


def new_spec(name: str, solver: Solver) -> mujoco.MjSpec:
    """Return an empty model in radians, without contacts, with the solver and the colours set."""
    spec = mujoco.MjSpec()
    spec.modelname = name
    spec.compiler.degree = False
    option = spec.option
    option.timestep = solver.timestep
    option.integrator = INTEGRATORS[solver.integrator]
    if not solver.gravity:
        option.gravity = [0.0, 0.0, 0.0]
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.tolerance = 1e-14
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    for color, (rgb, specular, reflectance) in COLORS.items():
        spec.add_material(
            name=color, rgba=[*rgb, 1.0], specular=specular, shininess=0.6, reflectance=reflectance
        )
    return spec


def add_machine(spec: mujoco.MjSpec, rotation: FloatArray, height: float) -> Any:
    """Add the body ``machine`` with its origin at a height (m) over the floor; return it.

    ``rotation`` (3, 3) holds the mechanism's axes as columns, in a world whose z points up.
    """
    machine = spec.worldbody.add_body(name="machine", pos=[0, 0, height], quat=quaternion(rotation))
    machine.add_site(name="origin", size=[0.001] * 3, group=4)
    return machine


def close_loop(spec: mujoco.MjSpec, name: str, sites: tuple[str, str], solver: Solver) -> None:
    """Keep two sites in one place."""
    spec.add_equality(
        name=name,
        type=mujoco.mjtEq.mjEQ_CONNECT,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=sites[0],
        name2=sites[1],
        solref=solver.solref,
        solimp=solver.solimp,
    )


def add_drive(
    spec: mujoco.MjSpec,
    joint: str,
    home: float,
    inertia: float,
    span: tuple[float, float] | None = None,
    bandwidth: float = BANDWIDTH,
) -> None:
    """Add a servo and a motor to a joint.

    Args:
        spec: the model.
        joint: the joint's name.
        home: its value at the pose of the twin, where the servo's control is 0.
        inertia: what the servo moves, kg or kg m^2; it is critically damped with this one.
        span: least and greatest value that the servo takes.
        bandwidth: of the servo with this inertia, rad/s.
    """
    kp, kv = inertia * bandwidth**2, 2.0 * inertia * bandwidth
    common: dict[str, Any] = {"target": joint, "trntype": mujoco.mjtTrn.mjTRN_JOINT}
    if span is not None:
        common |= {"ctrlrange": [span[0] - home, span[1] - home], "ctrllimited": True}
    spec.add_actuator(
        name=f"servo_{joint}",
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=[kp, *[0.0] * 9],
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=[kp * home, -kp, -kv, *[0.0] * 7],
        **common,
    )
    spec.add_actuator(
        name=f"motor_{joint}", target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT, gear=[1.0] + [0] * 5
    )


def add_stage(
    spec: mujoco.MjSpec, centre: Sequence[float], size: float, seen_from: Sequence[float]
) -> None:
    """Add the floor, the lights and the camera ``picture``.

    Args:
        spec: the model.
        centre: (3,), m, in the world: what the camera looks at.
        size: m, diameter of what it sees.
        seen_from: (3,), direction from the centre to the camera.
    """
    world, middle = spec.worldbody, np.asarray(centre, dtype=float)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.80, 0.86, 0.93],
        rgb2=[0.97, 0.98, 0.99],
        width=32,
        height=192,
    )
    world.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        size=[0.0, 0.0, 0.1],
        material="floor",
        contype=0,
        conaffinity=0,
    )
    away = np.asarray(seen_from, dtype=float)
    away /= np.linalg.norm(away)
    right = np.cross([0.0, 0.0, 1.0], away)
    right /= np.linalg.norm(right)
    distance = 0.5 * size / np.tan(0.5 * np.radians(FIELD_OF_VIEW))
    world.add_camera(
        name="picture",
        pos=middle + distance * away,
        quat=quaternion(np.stack([right, np.cross(away, right), away], axis=-1)),
        fovy=FIELD_OF_VIEW,
    )
    for toward, strength, shadow in LIGHTS:
        world.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            pos=middle + 1.5 * size * np.asarray(toward),
            dir=-np.asarray(toward),
            diffuse=[strength] * 3,
            specular=[0.5 * strength] * 3,
            castshadow=shadow,
        )
    visual = spec.visual
    visual.headlight.ambient = [0.46] * 3
    visual.headlight.diffuse = [0.16] * 3
    visual.headlight.specular = [0.0] * 3
    visual.rgba.haze = [0.97, 0.98, 0.99, 1.0]
    visual.map.haze = 0.5
    visual.map.shadowclip = 2.0
    visual.global_.offwidth, visual.global_.offheight = 1920, 1440
    visual.quality.shadowsize = 8192
    visual.quality.offsamples = 8
    visual.quality.numslices = 64
    spec.stat.center, spec.stat.extent = middle, size


def add_bar(body: Any, ends: Sequence[Any], radius: float, color: str, **more: Any) -> None:
    """Add a round bar between two points (3,) of the body's frame; without mass by itself."""
    _add_geom(body, mujoco.mjtGeom.mjGEOM_CAPSULE, ends, radius, color, more)


def add_cylinder(body: Any, ends: Sequence[Any], radius: float, color: str, **more: Any) -> None:
    """Add a cylinder between the centres (3,) of its faces; without mass by itself."""
    _add_geom(body, mujoco.mjtGeom.mjGEOM_CYLINDER, ends, radius, color, more)


def _add_geom(
    body: Any, kind: Any, ends: Sequence[Any], radius: float, color: str, more: Any
) -> None:
    fromto = np.concatenate([np.asarray(end, dtype=float) for end in ends])
    body.add_geom(
        type=kind, fromto=fromto, size=[radius, 0.0, 0.0], material=color,
        **{"density": 0.0, "contype": 0, "conaffinity": 0, **more},
    )  # fmt: skip


def quaternion(rotation: FloatArray) -> FloatArray:
    """Return the unit quaternion (4,), scalar first, of a rotation matrix (3, 3)."""
    found = np.empty(4)
    mujoco.mju_mat2Quat(found, np.ascontiguousarray(rotation, dtype=float).ravel())
    return found


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """Return axis times angle (..., 3), rad, of rotation matrices (..., 3, 3) of less than pi."""
    across = 0.5 * (rotation - np.swapaxes(rotation, -1, -2))
    sines = np.stack([across[..., 2, 1], across[..., 0, 2], across[..., 1, 0]], axis=-1)
    sine = np.linalg.norm(sines, axis=-1)
    angle = np.arctan2(sine, 0.5 * (np.trace(rotation, axis1=-2, axis2=-1) - 1.0))
    return np.asarray(sines * (angle / np.where(sine > 0.0, sine, 1.0))[..., None])


def drive_pistons(
    machine: Mechanism,
    spec: mujoco.MjSpec,
    home: FloatArray,
    course: Course,
    samples: int,
    pose_at: Callable[[FloatArray], FloatArray],
) -> PistonSpeeds:
    """Let the servos take a twin along a course; compare its cylinders' speeds at some instants.

    The servos know the lengths and rates of inverse kinematics but no inertia, so the tool lags and
    the speeds differ from the planned ones. Hence the Jacobian gets the tool's motion as MuJoCo has
    it: its way over a time step, at the middle of that way, since MuJoCo's velocities are those
    from one position to the next.

    Args:
        machine: whose twin it is.
        spec: the twin, built at the pose ``home`` (k,).
        home: where the servos' controls are 0.
        course: at each time step, the first included.
        samples: how many instants are compared, equally spaced.
        pose_at: takes the tool's positions (n, 3), m, in the machine's frame to poses (n, k).

    Raises:
        ValueError: for a course out of reach.
    """
    lengths = machine.inverse_kinematics(course.poses)
    check_reach(lengths, course.poses[0])
    planned = np.einsum("nij,nj->ni", machine.inverse_jacobian(course.poses), course.twists)
    controls = lengths - machine.inverse_kinematics(home)
    controls += 2.0 / BANDWIDTH * planned  # the servos brake by kv = 2 kp / w

    model = spec.compile()
    data, moves = mujoco.MjData(model), len(lengths) - 1
    start = twin_module(machine).coordinates(machine, course.poses[:1], home)
    for name, values in start.items():
        data.joint(name).qpos[:] = values[0]
    servos = [model.actuator(f"servo_{name}").id for name in machine.joint_names]
    rates = [model.joint(name).dofadr[0] for name in machine.joint_names]
    origin, tool = (model.site(name).id for name in ("origin", "tcp"))
    wanted = np.round(np.linspace(0, moves, samples + 1)[1:]).astype(int)
    measured: list[FloatArray] = []
    ends: list[FloatArray] = []
    for k in range(1, moves + 1):
        data.ctrl[servos] = controls[k]
        mujoco.mj_step(model, data)
        if k == wanted[len(measured)]:
            before = data.site_xpos[tool].copy()
            mujoco.mj_kinematics(model, data)
            ends.append(np.stack([before, data.site_xpos[tool]]) - data.site_xpos[origin])
            measured.append(data.qvel[rates].copy())
    way = np.array(ends) @ data.site_xmat[origin].reshape(3, 3)
    poses, timestep = pose_at(way.mean(axis=1)), model.opt.timestep
    speeds = np.diff(way, axis=1)[:, 0, : len(machine.twist_names)] / timestep
    analytic = np.einsum("nij,nj->ni", machine.inverse_jacobian(poses), speeds)
    times = course.duration / moves * wanted
    return PistonSpeeds(times, poses, np.array(measured), analytic, planned[wanted])


def check_reach(reached: FloatArray, pose: FloatArray) -> None:
    """Refuse to build a twin at a pose whose joints are not all finite.

    Raises:
        ValueError: where the pose is out of reach.
    """
    if not np.isfinite(reached).all():
        shown = ", ".join(f"{x:.6g}" for x in np.ravel(pose))
        raise ValueError(f"no twin stands at the pose ({shown}): it is out of the machine's reach")
