"""The Diamond as a MuJoCo model.

A planar machine of two limbs, whose parallelograms keep the platform from turning. An arm and its
elbow are one body: about a fixed axis only I_A and m_A r_A act.
"""

from __future__ import annotations

import mujoco

from pkm_gym.core.planar_twin import (
    Masses,
    add_box,
    assembled,
    coordinates,
    draw_poses,
    frames,
    margins,
    pick_and_place_course,
    pose,
    thickness,
)
from pkm_gym.core.twin import Course, Solver, add_cylinder
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.declared import DiamondTask
from pkm_gym.mechanisms.diamond.mechanism import Diamond
from pkm_gym.mechanisms.diamond.problem import cycle_path, packed_task

__all__ = [  # what a twin's module holds; a good part of it is the same for all planar machines
    "SOLVER", "build", "build_lumped", "coordinates", "course", "draw_poses", "frames", "margins",
    "pose",
]  # fmt: skip

SOLVER = Solver(timestep=2e-4, solref=(4e-4, 1.0))
LIGHT_ROD = 1e-9  # kg, of the lumped twin; its weight is what the torques then differ by
PLANES = (-1.15, 1.15)  # of a limb's two rods, in thicknesses


def build(machine: Diamond, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin with uniform rods of their real mass, assembled at a pose (2,).

    What eq. (9) counts to elbow and platform of the rods' mass is in the rods instead.

    Raises:
        ValueError: for a pose out of reach, or rods that outweigh the machine.
    """
    rod, elbow, platform = machine.rod, machine.rod_elbow, machine.rod_platform
    inertia, moment = machine.I_A - elbow * machine.l1**2, machine.mr_A - elbow * machine.l1
    mass = machine.m - platform
    if min(inertia, moment, mass) <= 0.0:
        raise ValueError(f"rods of {machine.l2:g} m outweigh the machine: it has no twin")
    return _build(machine, pose, (inertia, moment, max(2.0 * rod, LIGHT_ROD), mass))


def build_lumped(machine: Diamond, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin that eq. (9) describes: the rods' mass in arms and platform.

    Raises:
        ValueError: for a pose out of reach.
    """
    return _build(machine, pose, (machine.I_A, machine.mr_A, LIGHT_ROD, machine.m))


def course(machine: Diamond, samples: int = 201, task: DiamondTask | None = None) -> Course:
    """Return a task's pick-and-place cycle along the bottom edge; the default task's if None."""
    task = task or DiamondTask(b=machine.b)
    return pick_and_place_course(machine, *cycle_path(packed_task(task)), samples)


def _build(
    machine: Diamond, pose: FloatArray, masses: tuple[float, float, float, float]
) -> mujoco.MjSpec:
    """Return the twin with arm inertia, arm moment, mass of the rods and of the platform."""
    moved = machine.I_A + machine.m * machine.l1**2
    spec = assembled("diamond", machine, pose, Masses(*masses, moved), SOLVER, PLANES)
    _draw_platform(spec.body("platform"), thickness(machine))
    return spec


def _draw_platform(platform: mujoco.MjsBody, thick: float) -> None:
    add_cylinder(platform, [(0, 0, -1.8 * thick), (0, 0, 1.8 * thick)], 0.36 * thick, "metal")
    half = (0.75 * thick, 0.65 * thick, 0.75 * thick)
    add_box(platform, (0.0, 0.0, 0.0), half, "platform")
    add_cylinder(platform, [(0, -1.8 * thick, 0), (0, 0, 0)], 0.3 * thick, "metal")
    add_cylinder(platform, [(0, -2.2 * thick, 0), (0, -1.7 * thick, 0)], 0.75 * thick, "platform")
