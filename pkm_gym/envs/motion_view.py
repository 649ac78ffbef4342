"""What an agent sees of a machine on its path; ``MotionEnv`` documents the parts."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.observation import scaled_tasks, slices
from pkm_gym.twin.rig import Rig

AHEAD = (1, 2, 4, 8, 16)  # control steps to the next path points
NEAR = 5e-3  # m, where the error's tanh bends
SLOW = 0.1  # share of the path's largest speed, where that of the error's rate bends
NARROW = 0.1  # of the widest range: the narrowest that a pose's coordinate is scaled by


def motion_layout(problem: DesignProblem, mechanism: Mechanism) -> dict[str, slice]:
    """Return the parts of an observation, name -> slice, in order."""
    joints, twist = len(mechanism.joint_names), len(mechanism.twist_names)
    return slices(
        {
            "joints": joints,
            "rates": joints,
            "pose": len(mechanism.pose_names),
            "velocity": twist,
            "error": twist,
            "error_rate": twist,
            "acceleration": twist,
            "path": len(AHEAD) * twist,
            "time_left": 1,
            "design": len(problem.low),
            "task": len(problem.task_variables),
        }
    )


class View:
    """Scales of one rig's observations.

    Args:
        rig: the machine on its path.
        problem: of the machine.
        design: array (d,).
        task: array (m,), packed.
    """

    def __init__(
        self, rig: Rig, problem: DesignProblem, design: FloatArray, task: FloatArray
    ) -> None:
        self.rig = rig
        path = rig.path
        self._middle, self._span = _range(rig.joints)
        self._span = np.full_like(self._span, self._span.max())
        self._rate = 2.0 * np.abs(rig.rates).max()
        self._pose_middle, widths = _range(path.poses)
        self._pose_span = np.maximum(widths, NARROW * widths.max())
        self._levers = rig.levers
        self.speed = float(np.linalg.norm(self._levers * path.velocities, axis=1).max())
        self._acceleration = np.abs(self._levers * path.accelerations).max()
        self._ahead = 2 * np.array(AHEAD)
        self._way = self.speed * rig.dt * np.array(AHEAD)[:, None]
        self._fixed = (
            2.0 * (design - problem.low) / (problem.high - problem.low) - 1.0,
            scaled_tasks(problem, task[None])[0],
        )

    def see(self, step: int) -> npt.NDArray[np.float32]:
        """Return the observation (size,) after ``step`` control steps."""
        state, path, now = self.rig.state, self.rig.path, 2 * step
        ahead = np.minimum(now + self._ahead, 2 * path.steps)
        parts = (
            (state.joints - self._middle) / self._span,
            state.rates / self._rate,
            (state.pose - self._pose_middle) / self._pose_span,
            0.5 * self._levers * state.velocity / self.speed,
            np.tanh(self.rig.off(now) / NEAR),
            np.tanh(self._levers * (path.velocities[now] - state.velocity) / (SLOW * self.speed)),
            self._levers * path.accelerations[now] / self._acceleration,
            (self.rig.ahead(now, ahead) / self._way).ravel(),
            (1.0 - step / path.steps,),
            *self._fixed,
        )
        return np.clip(np.concatenate(parts), -1.0, 1.0).astype(np.float32)


def _range(table: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the middles and widths (k,) of columns (n, k)."""
    low, high = table.min(axis=0), table.max(axis=0)
    return 0.5 * (low + high), high - low
