"""The five-bar as a MuJoCo model: uniform arms and rods, and a tool."""

from __future__ import annotations

import mujoco

from five_bar.declared import FiveBarTask
from five_bar.mechanism import FiveBar
from pkm_gym.core.planar_twin import (
    Masses,
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

__all__ = [
    "SOLVER", "build", "coordinates", "course", "draw_poses", "frames", "margins", "pose",
]  # fmt: skip

SOLVER = Solver(timestep=2e-4, solref=(4e-4, 1.0))
ARM, ROD, TOOL = 1.2, 0.5, 0.4  # kg/m, kg/m, kg
CYCLE = 1.2  # s, from one end of the workspace's bottom edge to the other


def build(machine: FiveBar, pose: FloatArray) -> mujoco.MjSpec:
    """Return the twin assembled at a pose (2,).

    Raises:
        ValueError: for a pose out of reach.
    """
    arm, rod = ARM * machine.l1, ROD * machine.l2
    inertia = arm * machine.l1**2 / 3.0
    moved = inertia + (rod + TOOL) * machine.l1**2
    masses = Masses(inertia, 0.5 * arm * machine.l1, rod, TOOL, moved)
    spec = assembled("five_bar", machine, pose, masses, SOLVER)
    thick = thickness(machine)
    add_cylinder(spec.body("platform"), [(0, 0, -thick), (0, 0, thick)], 0.5 * thick, "platform")
    return spec


def course(machine: FiveBar, samples: int = 201, task: FiveBarTask | None = None) -> Course:
    """Return a move over the workspace's width and a tenth of its height; it knows no dynamics."""
    del task  # the machine has its workspace
    cycle = pick_and_place_course(machine, machine.b, 0.1 * machine.h, CYCLE, 0.5, samples)
    return cycle._replace(accelerations=None)
