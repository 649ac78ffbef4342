"""Controllers that drive a ``MotionEnv`` through its own actions, and how well a run went."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.motion import MotionEnv

Controller = Callable[[MotionEnv, Any], FloatArray]

STIFFNESS = 120.0  # rad/s, of computed torque's feedback, critically damped
BANDWIDTH = 60.0  # rad/s, of the servos, critically damped


class Run(NamedTuple):
    """How well a path was tracked.

    Attributes:
        reason: why it ended.
        mean_reward: the return over the path's steps, so that what is missing counts as 0.
        errors: array (n,), m, after each step.
        shares: array (n, joints), the forces over their limit.
    """

    reason: str
    mean_reward: float
    errors: FloatArray
    shares: FloatArray

    @property
    def rms(self) -> float:
        """The errors' root mean square, m."""
        return float(np.sqrt((self.errors**2).mean()))


def computed_torque(env: MotionEnv, observation: Any = None) -> FloatArray:
    """Return the action (joints,) by the mechanism's own inverse dynamics.

    Of the measured position and velocity and the acceleration wanted in the middle of the coming
    step, corrected by what is missing in position and velocity.

    Raises:
        ValueError: for a mechanism without dynamics.
    """
    del observation
    rig, now = env.rig, 2 * env.steps_done
    dynamics: Any = rig.twin.mechanism
    if not hasattr(dynamics, "inverse_dynamics"):
        raise ValueError(f"{type(dynamics).__name__} has no dynamics to compute torques from")
    path, state = rig.path, rig.state
    off, lag = path.positions[now] - state.position, path.velocities[now] - state.velocity
    wanted = path.accelerations[now + 1] + STIFFNESS**2 * off + 2.0 * STIFFNESS * lag
    forces = dynamics.inverse_dynamics(state.position, state.velocity, wanted)
    return _action(env, forces)


def servo(env: MotionEnv, observation: Any = None) -> FloatArray:
    """Return the action (joints,) of a servo at each joint that also bears the machine's weight.

    The servos hold the joints on the values and rates that inverse kinematics asks for; the weight
    is shared out among the motors by virtual work.
    """
    del observation
    rig, now = env.rig, 2 * env.steps_done
    mechanism, state, pose = rig.twin.mechanism, rig.state, rig.path.poses[now]
    off = mechanism.inverse_kinematics(pose) - state.joints
    lag = mechanism.inverse_jacobian(pose) @ rig.path.velocities[now] - state.rates
    forces = rig.twin.servo_inertia * (BANDWIDTH**2 * off + 2.0 * BANDWIDTH * lag)
    return _action(env, forces + rig.twin.bearing_forces())


def idle(env: MotionEnv, observation: Any = None) -> FloatArray:
    """Return the action (joints,) of motors that are off."""
    del observation
    return np.zeros(env.action_space.shape or ())


def random(env: MotionEnv, observation: Any = None) -> FloatArray:
    """Return a random action (joints,) from the action space's own generator."""
    del observation
    return np.asarray(env.action_space.sample(), dtype=float)


BASELINES: dict[str, Controller] = {
    "computed-torque": computed_torque,
    "servo": servo,
    "idle": idle,
    "random": random,
}


def baseline(name: str) -> Controller:
    """Return a baseline by name.

    Raises:
        ValueError: for an unknown one, with its closest match.
    """
    check_known("baseline", [name], BASELINES)
    return BASELINES[name]


def run(
    env: MotionEnv,
    controller: Controller,
    *,
    seed: int | None = None,
    options: dict[str, Any] | None = None,
) -> Run:
    """Let a controller drive one episode.

    ``seed`` and ``options`` are those of ``reset``; the seed is the action space's too.
    """
    observation: npt.NDArray[Any]
    observation, _ = env.reset(seed=seed, options=options)
    env.action_space.seed(seed)
    errors, shares, total, ended = [], [], 0.0, False
    info: dict[str, Any] = {}
    while not ended:
        observation, reward, ended, _, info = env.step(controller(env, observation))
        errors.append(info["error"])
        shares.append([force / env.force_limit for force in info["forces"].values()])
        total += reward
    mean = total / env.rig.path.steps
    return Run(info["reason"], mean, np.array(errors), np.array(shares))


def _action(env: MotionEnv, forces: FloatArray) -> FloatArray:
    return np.clip(forces / env.force_limit, -1.0, 1.0)
