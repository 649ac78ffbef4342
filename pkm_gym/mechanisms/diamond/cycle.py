"""A machine's torques along its task's pick-and-place cycle, which is ours, part by part."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pkm_gym.core.task import Task
from pkm_gym.core.trajectory import pick_and_place
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.mechanism import Diamond
from pkm_gym.mechanisms.diamond.problem import cycle_path, packed_task


@dataclass(frozen=True)
class Cycle:
    """What the drives do at n instants.

    Attributes:
        time: array (n,), s.
        rates: array (n, 2), rad/s, of the arms.
        total: array (n, 2), N m, the torques.
        parts: what they are made of, "inertia", "velocity" and "gravity" -> array (n, 2), N m.
    """

    time: FloatArray
    rates: FloatArray
    total: FloatArray
    parts: dict[str, FloatArray]


def driven(machine: Diamond, task: Task, samples: int = 801) -> Cycle:
    """Return torques and arm rates along the bottom edge of the workspace."""
    width, lift, duration, overlap = cycle_path(packed_task(task))
    time = np.linspace(0.0, duration, samples)
    states = np.array([pick_and_place(t, width, lift, duration, overlap) for t in time.tolist()])
    states[:, 1] -= machine.H + machine.h
    pose, velocity, acceleration = states[:, :2], states[:, 2:4], states[:, 4:]
    rest = np.zeros_like(velocity)
    gravity = machine.inverse_dynamics(pose, rest, rest)
    parts = {
        "inertia": machine.inverse_dynamics(pose, rest, acceleration) - gravity,
        "velocity": machine.inverse_dynamics(pose, velocity, rest) - gravity,
        "gravity": gravity,
    }
    rates = (machine.inverse_jacobian(pose) @ velocity[..., None])[..., 0]
    return Cycle(time, rates, machine.inverse_dynamics(pose, velocity, acceleration), parts)
