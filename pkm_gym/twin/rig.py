"""A twin on its path: what its motors are told, step by step, and what is measured."""

from __future__ import annotations

from math import ceil, isfinite
from typing import Any, NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.twin import check_reach, rotation_vector, twin_module
from pkm_gym.core.types import FloatArray
from pkm_gym.twin.model import Twin

SAMPLES = 601  # of a path, with straight lines between them: 3 micrometres on the Diamond's cycle
LONGEST = 8e-3  # s, between samples: a long path has more of them
EVERY = 6  # of these samples, where the path's extremes are looked for
FORCES = 41  # samples where the path's forces are looked for, at least
SPARSE = 16  # control steps between them, at most
LEVER = 0.1  # m, at which a turn counts as a way
WHOLE = mujoco.mjtState.mjSTATE_INTEGRATION


class State(NamedTuple):
    """What is measured of a twin.

    Joints and rates are (joints,), rad or m; the tool's position, m, has as many coordinates as its
    velocity, the velocity is all its twist; axes are the platform's (3, 3), as columns; the pose is
    (k,); the gap says how far the loops are open, m.
    """

    joints: FloatArray
    rates: FloatArray
    position: FloatArray
    velocity: FloatArray
    axes: FloatArray
    pose: FloatArray
    gap: float


class Path(NamedTuple):
    """The tool's path at half control steps, at rest after its end.

    Positions are (2 steps + 1, n) as in ``State``, velocities (twists) and accelerations (2 steps +
    1, twist), poses (2 steps + 1, k), axes of the platform (2 steps + 1, 3, 3).
    """

    steps: int
    positions: FloatArray
    velocities: FloatArray
    accelerations: FloatArray
    poses: FloatArray
    axes: FloatArray


class Rig:
    """A machine's twin with its motors only, assembled at the start of its path.

    Args:
        mechanism: the machine.
        task: whose path it is; the default one if None.
        speed: how many times as fast as the path's own speed.
        frame_skip: MuJoCo's steps in a control step.

    Raises:
        ValueError: for a machine that has no twin or can't follow the path.
    """

    def __init__(
        self, mechanism: Mechanism, task: Any = None, *, speed: float = 1.0, frame_skip: int = 5
    ) -> None:
        mechanism = mechanism.real()
        module = twin_module(mechanism)
        course = module.course(mechanism, SAMPLES, task).at_speed(speed)
        if course.duration > LONGEST * (SAMPLES - 1):
            samples = 1 + ceil(course.duration / LONGEST)
            course = module.course(mechanism, samples, task).at_speed(speed)
        self.frame_skip = frame_skip
        self.joints = mechanism.inverse_kinematics(course.poses[::EVERY])
        if not np.isfinite(self.joints).all():
            raise ValueError("its path leaves the machine's reach")
        if not (module.margins(mechanism, course.poses[0], self.joints[0]) > 0.0).all():
            start = mechanism.place(course.poses[0])
            raise ValueError(f"its twin can't stand in its assembly mode {start}, the path's start")
        self.twin = Twin(mechanism, course.poses[0])
        self.twin.release()
        self.dt = frame_skip * float(self.twin.model.opt.timestep)
        inverse = mechanism.inverse_jacobian(course.poses[::EVERY])
        self.rates = np.einsum("nij,nj->ni", inverse, course.twists[::EVERY])
        self.path = self._resampled(course)
        self.reset()

    def reset(self, pose: FloatArray | None = None, twist: FloatArray | None = None) -> None:
        """Put the twin at the start of its path, or at a pose (k,); at rest, or with a twist.

        Raises:
            ValueError: for a pose out of reach; nothing has changed then.
        """
        twin = self.twin
        coordinates = twin.model.qpos0 if pose is None else twin.coordinates(pose[None])[0]
        check_reach(coordinates, twin.home if pose is None else pose)
        mujoco.mj_resetData(twin.model, twin.data)
        twin.data.qpos[:] = coordinates
        mujoco.mj_step1(twin.model, twin.data)
        if twist is not None:
            twin.data.qvel[:] = twin.velocities(twist)
            mujoco.mj_step1(twin.model, twin.data)
        self.stable = True
        self.state = self._measure()

    def drive(self, forces: FloatArray) -> None:
        """Let the motors give forces (joints,), N or N m, for a control step, and measure.

        A simulation that becomes unstable keeps the state that was measured before.
        """
        model, data = self.twin.model, self.twin.data
        data.ctrl[self.twin.motors] = forces
        warnings: list[str] = []  # MuJoCo otherwise prints them and writes them to a file
        before = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(warnings.append)
        try:
            mujoco.mj_step2(model, data)
            if self.frame_skip > 1:
                mujoco.mj_step(model, data, self.frame_skip - 1)
            mujoco.mj_step1(model, data)
        finally:
            mujoco.set_mju_user_warning(before)
        self.stable = not warnings and isfinite(data.qpos.sum() + data.qvel.sum())
        if self.stable:
            self.state = self._measure()

    def off(self, now: int) -> FloatArray:
        """Return the way (twist,), m, from the platform to where the path is at a half step.

        Turns count as ways at a lever of 0.1 m.
        """
        state = self.state
        return self._way(state.axes, state.position, now)

    def ahead(self, now: int, then: npt.NDArray[np.int_]) -> FloatArray:
        """Return the ways (n, twist), m, of the path from one half step to others (n,)."""
        return self._way(self.path.axes[now], self.path.positions[now], then)

    @property
    def levers(self) -> FloatArray:
        """What makes a way, m, of each entry of a twist (twist,)."""
        mechanism = self.twin.mechanism
        return np.where(np.arange(len(mechanism.twist_names)) < mechanism.turning, LEVER, 1.0)

    def save(self) -> FloatArray:
        """Return what the simulation goes on from."""
        size = mujoco.mj_stateSize(self.twin.model, WHOLE)
        saved = np.empty(size)
        mujoco.mj_getState(self.twin.model, self.twin.data, saved, WHOLE)
        return saved

    def load(self, saved: FloatArray) -> None:
        """Go on from what ``save`` returned, of the same machine."""
        mujoco.mj_setState(self.twin.model, self.twin.data, saved, WHOLE)
        mujoco.mj_step1(self.twin.model, self.twin.data)
        self.stable = True
        self.state = self._measure()

    @property
    def assembled(self) -> bool:
        """Whether the machine still is in the modes that it was built in."""
        margins = self.twin.module.margins(self.twin.mechanism, self.state.pose, self.state.joints)
        return bool((margins > 0.0).all())

    def peak_force(self) -> float:
        """Return the largest force that the path asks of a motor, N or N m; resets the twin."""
        samples = max(FORCES, self.path.steps // SPARSE)
        every = np.linspace(0, len(self.path.poses) - 1, samples).astype(int)
        peak = 0.0
        for coordinates, velocity, acceleration in zip(
            self.twin.coordinates(self.path.poses[every]),
            self.path.velocities[every],
            self.path.accelerations[every],
            strict=True,
        ):
            self.twin.place(coordinates)
            forces = self.twin.drive_forces(velocity, acceleration)
            peak = max(peak, float(np.abs(forces).max()))
        self.reset()
        return peak

    def _measure(self) -> State:
        data, frame = self.twin.data, self.twin.frame
        return State(
            data.qpos[self.twin.values],
            data.qvel[self.twin.rates],
            self.twin.position_of(frame),
            self.twin.tool_velocity,
            frame[:, :3],
            self.twin.module.pose(self.twin.mechanism, frame),
            self.twin.gap,
        )

    def _resampled(self, course: Any) -> Path:
        module, mechanism = self.twin.module, self.twin.mechanism
        steps = ceil(course.duration / self.dt - 1e-9)
        times = 0.5 * self.dt * np.arange(2 * steps + 1)
        known = np.linspace(0.0, course.duration, len(course.poses))
        accelerations = course.accelerations
        if accelerations is None:
            accelerations = np.gradient(course.twists, known, axis=0)
        positions = self.twin.position_of(module.frames(mechanism, course.poses))
        tables = (positions, course.twists, accelerations, course.poses)
        positions, twists, accelerations, poses = (
            _interpolated(times, known, table) for table in tables
        )
        axes = module.frames(mechanism, poses)[..., :3]
        return Path(steps, positions, twists, accelerations, poses, axes)

    def _way(
        self, axes: FloatArray, position: FloatArray, then: int | npt.NDArray[np.int_]
    ) -> FloatArray:
        """Return the way (..., twist), m, from axes and a position to half steps of the path."""
        way, turning = self.path.positions[then] - position, self.twin.mechanism.turning
        if not turning:
            return way
        turn = rotation_vector(self.path.axes[then] @ axes.T)[..., :turning]
        return np.concatenate([LEVER * turn, way], axis=-1)


def _interpolated(times: FloatArray, known: FloatArray, table: FloatArray) -> FloatArray:
    return np.stack([np.interp(times, known, column) for column in table.T], axis=-1)
