"""Drive a twin along its path by computed torque, and read its motors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.types import FloatArray
from pkm_gym.twin.model import Twin

STIFFNESS = 120.0  # rad/s, of the feedback, critically damped


@dataclass(frozen=True)
class Drive:
    """What was measured on the way.

    Attributes:
        forces: array (n, joints) of the motors, N or N m.
        errors: array (n,), m: how far the tool was from the path.
    """

    forces: FloatArray
    errors: FloatArray

    @property
    def peak(self) -> float:
        """The largest force of a motor, N or N m."""
        return float(np.abs(self.forces).max())


def computed_torque(mechanism: Mechanism) -> Drive:
    """Let a twin follow its path once, its motors driven by the mechanism's dynamics.

    The motors get ``inverse_dynamics`` of the measured position and velocity and of the wanted
    acceleration, corrected by what is missing in position and velocity.

    Raises:
        ValueError: for a mechanism without dynamics, whose pose is not its tool's position.
    """
    if not hasattr(mechanism, "inverse_dynamics"):
        raise ValueError(f"{type(mechanism).__name__} has no dynamics to compute torques from")
    dynamics: Any = mechanism
    twin = Twin(mechanism, mechanism.sample_poses()[0])
    step = twin.model.opt.timestep
    samples = 1 + round(twin.module.course(mechanism, 2).duration / step)
    course = twin.module.course(mechanism, samples)
    assert course.accelerations is not None  # the mechanism has dynamics
    twin.release()
    twin.place(twin.coordinates(course.poses[:1])[0])
    forces, errors = np.empty((samples, len(mechanism.joint_names))), np.empty(samples)
    for k in range(samples):
        mujoco.mj_step1(twin.model, twin.data)
        position, velocity = twin.tool_state()
        off, lag = course.poses[k] - position, course.twists[k] - velocity
        wanted = course.accelerations[k] + STIFFNESS**2 * off + 2.0 * STIFFNESS * lag
        forces[k] = dynamics.inverse_dynamics(position, velocity, wanted)
        errors[k] = np.linalg.norm(off)
        twin.data.ctrl[twin.motors] = forces[k]
        mujoco.mj_step2(twin.model, twin.data)
    return Drive(forces, errors)
