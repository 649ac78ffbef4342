"""Compare twins with the analytic models: the same dimensions, another engine."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import inf
from typing import Any

import mujoco
import numpy as np

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.twin import Course
from pkm_gym.core.types import FloatArray
from pkm_gym.twin.model import Twin

POSES = 4  # random ones a machine, beside the corners of its workspace
PISTONS = 1.6e-6  # m/s: as near as the leg's paper says that its simulation came
BATCH, BATCHES = 1024, 10_000  # of random designs


@dataclass(frozen=True)
class Row:
    """The worst disagreement of a quantity.

    Attributes:
        mechanism: name of the mechanism.
        quantity: what was compared.
        worst: the largest error, in ``unit``.
        limit: what it must not exceed; None where it is only reported.
        unit: unit of both; "" for a share of the largest value.
        where: the pose of the worst.
        solver: MuJoCo's settings.
        design: the design of the worst, by variable; empty if a machine was given.
    """

    mechanism: str
    quantity: str
    worst: float
    limit: float | None
    unit: str
    where: str
    solver: str
    design: Mapping[str, float] = field(default_factory=dict)

    @property
    def holds(self) -> bool:
        """Whether the worst error is within the limit."""
        return self.limit is None or self.worst <= self.limit


@dataclass(frozen=True)
class Errors:
    """How far a quantity is off at each of some poses."""

    quantity: str
    values: FloatArray
    poses: FloatArray
    limit: float | None
    unit: str = ""


def check(mechanism: Mechanism, poses: FloatArray | None = None) -> tuple[Row, ...]:
    """Compare a machine's twin with its analytic model.

    Args:
        mechanism: the machine.
        poses: array (n, k) within reach; the corners of the workspace and random ones if None.

    Returns:
        A row a quantity: closure of the loops at the analytic poses; the platform that servos hold
        against gravity, against forward kinematics of the joints measured there (where the twin's
        solver is without gravity, what gravity adds is only reported, and where it doesn't bear it,
        not even that); Jacobian by virtual work;
        joint rates along its path; where the mechanism has ``acceleration``, that at random
        steady joint rates; where the twin's module has ``piston_speeds``, those of the driven twin;
        and, where the mechanism has dynamics, the drives' torques on the path.

    Raises:
        ValueError: for a mechanism without a twin, or a pose out of reach.
    """
    mechanism = mechanism.real()
    twin = Twin(mechanism, mechanism.sample_poses()[0])
    if poses is None:
        poses = twin.module.draw_poses(mechanism, POSES, np.random.default_rng(0))
    poses = np.asarray(poses, dtype=float)
    if not np.isfinite(mechanism.inverse_kinematics(poses)).all():
        raise ValueError("a pose is out of the machine's reach: the twin can't be checked there")
    course = twin.module.course(mechanism)
    errors = [*_geometry(twin, poses), *_settled(twin, poses), _rates(twin, course)]
    if hasattr(mechanism, "acceleration"):
        errors.append(_accelerations(twin, poses))
    if hasattr(twin.module, "piston_speeds"):
        errors.append(_piston_speeds(twin))
    if course.accelerations is not None:
        errors += _torques(twin, course)
    return tuple(_row(twin, item) for item in errors)


def check_designs(
    problem: DesignProblem, designs: FloatArray, progress: Callable[[], None] = lambda: None
) -> tuple[Row, ...]:
    """Check a problem's machines of designs (n, d), for its task; keep the worst of each quantity.

    ``progress`` is called after each design.
    """
    worst: dict[str, Row] = {}
    for design in designs:
        for row in check(problem.mechanism(design)):
            kept = worst.get(row.quantity)
            if kept is None or not row.worst <= kept.worst:
                worst[row.quantity] = replace(row, design=problem.named(design))
        progress()
    return tuple(worst.values())


def random_designs(problem: DesignProblem, n: int, seed: int) -> FloatArray:
    """Return n feasible designs (n, d), drawn uniformly from the box for the problem's task.

    Feasible under the ``finer`` options, too, that the problem declares.

    Raises:
        ValueError: where too few of ten million random designs are feasible.
    """
    generator = np.random.default_rng(seed)
    finer = problem.with_task(problem.task, **problem.declared.finer)
    found = np.empty((0, len(problem.low)))
    for _ in range(BATCHES):
        if len(found) >= n:
            return found[:n]
        drawn = generator.uniform(problem.low, problem.high, (BATCH, len(problem.low)))
        drawn = drawn[problem.evaluate(drawn).feasible]
        if finer.options != problem.options:
            drawn = drawn[finer.evaluate(drawn).feasible]
        found = np.concatenate([found, drawn])
    raise ValueError(
        f"{problem.name} has {len(found)} feasible designs among {BATCH * BATCHES:,} random ones: "
        f"{n} were asked for"
    )


def _row(twin: Twin, errors: Errors) -> Row:
    at = int(np.argmax(errors.values))
    return Row(
        twin.mechanism.twin_module.split(".")[-2],
        errors.quantity,
        float(errors.values[at]),
        errors.limit,
        errors.unit,
        twin.mechanism.place(errors.poses[at]),
        str(twin.module.SOLVER),
    )


def _geometry(twin: Twin, poses: FloatArray) -> Iterator[Errors]:
    closure, matrices = np.empty(len(poses)), []
    for k, coordinates in enumerate(twin.coordinates(poses)):
        twin.place(coordinates)
        closure[k] = twin.gap
        matrices.append(twin.jacobian)
    analytic = twin.mechanism.jacobian(poses)
    off = np.abs(np.array(matrices) - analytic).max(axis=(1, 2))
    yield Errors("loop closure", closure, poses, 1e-12, "m")
    yield Errors("Jacobian", off / np.abs(analytic).max(axis=(1, 2)), poses, 1e-6)


def _settled(twin: Twin, poses: FloatArray) -> Iterator[Errors]:
    held = twin
    if not twin.module.SOLVER.bears:
        held = Twin(twin.mechanism, twin.home)
        held.model.opt.gravity[:] = 0.0
    off, from_wanted = _settled_off(held, poses)
    yield Errors("settled position", np.linalg.norm(off[..., 3], axis=1), poses, 1e-6, "m")
    if len(twin.mechanism.pose_names) > 2:  # the platform turns
        turned = np.abs(off[..., :3]).max(axis=(1, 2))
        yield Errors("settled axes", turned, poses, 1e-6)
    if not twin.module.SOLVER.gravity:
        yield Errors("distance to the wanted pose", from_wanted, poses, None, "m")
        heavy = Twin(twin.mechanism, twin.home)
        heavy.model.opt.gravity[:] = mujoco.MjOption().gravity
        off, from_wanted = _settled_off(heavy, poses)
        sagged = np.linalg.norm(off[..., 3], axis=1)
        yield Errors("settled position with gravity", sagged, poses, None, "m")
        yield Errors("sag with gravity", from_wanted, poses, None, "m")


def _settled_off(twin: Twin, poses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return how far frames are off where servos hold the twin at poses (n, k).

    From those of the joints measured there (n, 3, 4), in the mode that it rests in, and from the
    wanted positions (n,), m.
    """
    off, from_wanted = np.full((len(poses), 3, 4), inf), np.full(len(poses), inf)
    wanted = twin.module.frames(twin.mechanism, poses)[..., 3]
    for k, joints in enumerate(twin.mechanism.inverse_kinematics(poses)):
        try:
            settled = twin.settle(joints)
        except RuntimeError:  # it never rests: infinitely far off
            continue
        near = twin.module.pose(twin.mechanism, settled.frame)
        pose = twin.mechanism.forward_kinematics(settled.joints[None], near)
        off[k] = twin.module.frames(twin.mechanism, pose)[0] - settled.frame
        from_wanted[k] = np.linalg.norm(wanted[k] - settled.frame[:, 3])
    return off, from_wanted


def _rates(twin: Twin, course: Course) -> Errors:
    analytic = np.einsum("nij,nj->ni", twin.mechanism.inverse_jacobian(course.poses), course.twists)
    rates = np.empty_like(analytic)
    for k, coordinates in enumerate(twin.coordinates(course.poses)):
        twin.place(coordinates)
        rates[k] = twin.velocities(course.twists[k])[twin.rates]
    return _against(analytic, rates, "joint rates on the path", course.poses, 1e-6)


def _accelerations(twin: Twin, poses: FloatArray) -> Errors:
    mechanism: Any = twin.mechanism
    rates = np.random.default_rng(0).normal(size=(len(poses), len(mechanism.joint_names)))
    analytic = mechanism.acceleration(poses, rates, np.zeros_like(rates))
    measured = np.empty_like(analytic)
    for k, coordinates in enumerate(twin.coordinates(poses)):
        twin.place(coordinates)
        measured[k] = twin.acceleration(rates[k])
    return _against(analytic, measured, "accelerations", poses, 1e-6)


def _piston_speeds(twin: Twin) -> Errors:
    module: Any = twin.module
    speeds = module.piston_speeds(twin.mechanism)
    off = np.abs(speeds.twin - speeds.analytic).max(axis=1)
    return Errors("piston speeds, driven", off, speeds.poses, PISTONS, "m/s")


def _torques(twin: Twin, course: Course) -> Iterator[Errors]:
    dynamics: Any = twin.mechanism
    analytic = dynamics.inverse_dynamics(course.poses, course.twists, course.accelerations)
    lumped = Twin(twin.mechanism, twin.home, lumped=True)
    off = np.abs(_drive_forces(lumped, course) - analytic).max(axis=1)
    yield Errors("torques on the path", off, course.poses, 1e-6, "N m")
    forces = _drive_forces(twin, course)
    yield _against(analytic, forces, "the same, uniform rods", course.poses, None)


def _drive_forces(twin: Twin, course: Course) -> FloatArray:
    assert course.accelerations is not None
    forces = []
    states = twin.coordinates(course.poses), course.twists, course.accelerations
    for coordinates, twist, acceleration in zip(*states, strict=True):
        twin.place(coordinates)
        forces.append(twin.drive_forces(twist, acceleration))
    return np.array(forces)


def _against(
    analytic: FloatArray, measured: FloatArray, name: str, poses: FloatArray, limit: float | None
) -> Errors:
    """Return errors (n,) of (n, k) as shares of the largest analytic value."""
    off = np.abs(measured - analytic).max(axis=1) / np.abs(analytic).max()
    return Errors(name, off, poses, limit)
