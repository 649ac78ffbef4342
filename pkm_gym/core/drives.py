"""What the drives of a machine do along a motion: torques, rates and accelerations."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.task import TaskLike
from pkm_gym.core.types import FloatArray

if TYPE_CHECKING:
    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.twin import Course

SAMPLES = 801


class Drives(NamedTuple):
    """What drives do at n equal time steps, the first and the last instant included.

    Attributes:
        duration: s.
        torques: array (n, joints), N m of a hinge, N of a slider; of the machine without the
            inertia of its motors and gears.
        rates: array (n, joints), rad/s or m/s.
        accelerations: array (n, joints), rad/s^2 or m/s^2.
    """

    duration: float
    torques: FloatArray
    rates: FloatArray
    accelerations: FloatArray

    def with_inertia(self, inertia: float) -> FloatArray:
        """Return the torques (n, joints) with an inertia at each drive, kg m^2 or kg."""
        return self.torques + inertia * self.accelerations

    def rms(self, values: FloatArray) -> FloatArray:
        """Return the root mean square (joints,) over time of values (n, joints)."""
        return np.sqrt(np.trapezoid(values**2, axis=0) / (len(values) - 1))


def has_dynamics(machine: Mechanism) -> bool:
    """Whether a mechanism has inverse dynamics, a Hessian and the inertia of its drives."""
    return all(hasattr(machine, name) for name in ("inverse_dynamics", "hessian", "drive_inertia"))


def cycle_drives(
    problem: DesignProblem, design: FloatArray, task: TaskLike = None, samples: int = SAMPLES
) -> Drives:
    """Return what the drives of a design (d,) do over the cycle of a task.

    Args:
        problem: of a mechanism with dynamics.
        design: array (d,).
        task: the problem's own if None.
        samples: instants of the cycle.

    Raises:
        ValueError: for a mechanism without dynamics, or a design that makes no machine or doesn't
            reach the cycle.
    """
    from pkm_gym.core.twin import twin_module

    machine = problem.mechanism(design, task)
    if not (has_dynamics(machine) and problem.cycle(problem.task)):
        raise ValueError(
            f"{problem.name} has no dynamics (nothing says what its bodies weigh), only statics: "
            "evaluate it with --load to see what its drives hold of a load"
        )
    chosen = problem.task if task is None else problem.task_type.of(task)
    return drives_along(machine, twin_module(machine).course(machine, samples, chosen))


def drives_along(machine: Any, motion: Course) -> Drives:
    """Return what a machine's drives do along a motion.

    Args:
        machine: a mechanism with ``inverse_dynamics(pose, velocity, acceleration)``, with
            ``hessian(pose)`` (joint acceleration_i = Ji a + v^T K_i v) and ``drive_inertia``, what
            its dynamics count of motor and gear at each drive (kg m^2 or kg).
        motion: a ``twin.Course``: duration, poses, twists and accelerations (n, k).

    Raises:
        ValueError: for a machine without dynamics, or a motion that leaves its reach.
    """
    if not has_dynamics(machine):
        raise ValueError(
            f"{type(machine).__name__} has no dynamics: its drives' torques are unknown"
        )
    poses, twists, pushed = motion.poses, motion.twists, motion.accelerations
    if pushed is None:
        raise ValueError("the motion has no accelerations: its drives' torques are unknown")
    inverse = machine.inverse_jacobian(poses)
    rates = np.einsum("nij,nj->ni", inverse, twists)
    accelerations = np.einsum("nij,nj->ni", inverse, pushed)
    accelerations += np.einsum("nijk,nj,nk->ni", machine.hessian(poses), twists, twists)
    torques = machine.inverse_dynamics(poses, twists, pushed)
    if not np.isfinite(torques).all():
        raise ValueError("the motion leaves the machine's reach: its drives' torques are undefined")
    own = torques - machine.drive_inertia * accelerations
    return Drives(motion.duration, own, rates, accelerations)
