"""Computed torque keeps the Diamond on its path, with the torques that the path asks for."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.twin.check import random_designs
from pkm_gym.twin.drive import computed_torque
from pkm_gym.twin.model import Twin


@pytest.fixture(scope="module")
def machines():
    problem = pkm_gym.make_problem("diamond")
    designs = [problem.printed_design(), *random_designs(problem, 2, seed=1)]
    return [problem.mechanism(design) for design in designs]


def test_the_tool_stays_within_a_millimetre_of_the_path(machines):
    for machine in machines:
        assert computed_torque(machine).errors.max() < 1e-3


def test_the_motors_give_the_torques_of_the_twin_s_own_inverse_dynamics(machines):
    for machine in machines:
        drive = computed_torque(machine)
        twin = Twin(machine, machine.sample_poses()[0])
        course = twin.module.course(machine, len(drive.forces))
        every = slice(None, None, 25)
        exact = []
        for coordinates, twist, acceleration in zip(
            twin.coordinates(course.poses[every]),
            course.twists[every],
            course.accelerations[every],
            strict=True,
        ):
            twin.place(coordinates)
            exact.append(twin.drive_forces(twist, acceleration))
        off = np.abs(drive.forces[every] - exact).max()
        assert off < 0.03 * np.abs(exact).max()


def test_a_mechanism_without_dynamics_is_refused():
    problem = pkm_gym.make_problem("spr3")
    with pytest.raises(ValueError, match="Spr3 has no dynamics"):
        computed_torque(problem.mechanism(problem.printed_design()))
