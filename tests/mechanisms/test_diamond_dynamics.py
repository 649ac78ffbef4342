"""The Diamond's inverse dynamics and cycle against energy, virtual work and Lagrange's equations.

The machine here is one mass at the platform and two arms about their drives, with joint angles from
``inverse_kinematics`` alone: none of the formulas under test is used to check it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.trajectory import pick_and_place
from pkm_gym.mechanisms.diamond.dynamics import GRAVITY


@pytest.fixture(scope="module")
def diamond() -> DesignProblem:
    return pkm_gym.make_problem("diamond", cycle=True)


@pytest.fixture(scope="module")
def drawn(diamond: DesignProblem, draw: Callable[[DesignProblem, int], Any]) -> Any:
    return draw(diamond, 60)


def states(machine: Any, rng: np.random.Generator, n: int = 20) -> tuple[np.ndarray, ...]:
    """Random poses in the workspace, velocities about 3 m/s and accelerations about 50 m/s^2."""
    corner = np.array([-0.5 * machine.b, -machine.H - machine.h])
    poses = corner + [machine.b, machine.h] * rng.random((n, 2))
    return poses, 3.0 * rng.normal(size=(n, 2)), 50.0 * rng.normal(size=(n, 2))


def slope(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, step: float) -> np.ndarray:
    """Gradient (..., 2) by central differences of sixth order."""
    columns = []
    for d in np.eye(2):
        one, two, three = (
            function(at + k * step * d) - function(at - k * step * d) for k in (1, 2, 3)
        )
        columns.append((1.5 * one - 0.3 * two + three / 30.0) / (2.0 * step))
    return np.stack(columns, axis=-1)


def mass_matrix(machine: Any, poses: np.ndarray) -> np.ndarray:
    """M (..., 2, 2) of the kinetic energy v^T M v / 2, from the slopes of the arm angles."""
    rates = slope(machine.inverse_kinematics, poses, 2e-3 * machine.l1)
    arms = machine.I_A * np.einsum("...ki,...kj->...ij", rates, rates)
    return machine.m * np.eye(2) + arms


def potential(machine: Any, poses: np.ndarray) -> np.ndarray:
    arms = machine.mr_A * np.sin(machine.inverse_kinematics(poses)).sum(axis=-1)
    return GRAVITY * (machine.m * poses[..., 1] + arms)


def lagrange_forces(
    machine: Any, poses: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray
) -> np.ndarray:
    """Forces (n, 2) on the platform that Lagrange's equations in x and y ask for."""
    step = 2e-3 * machine.l1
    bend = slope(lambda p: mass_matrix(machine, p), poses, step)  # (n, i, j, k) = dM_ij / dq_k
    inertia = np.einsum("nij,nj->ni", mass_matrix(machine, poses), accelerations)
    coriolis = np.einsum("nijk,nj,nk->ni", bend, velocities, velocities)
    coriolis -= 0.5 * np.einsum("njki,nj,nk->ni", bend, velocities, velocities)
    return inertia + coriolis + slope(lambda p: potential(machine, p), poses, step)


def test_torques_satisfy_lagranges_equations(drawn: Any, rng: np.random.Generator) -> None:
    for machine in drawn.machines:
        poses, velocities, accelerations = states(machine, rng)
        torques = machine.inverse_dynamics(poses, velocities, accelerations)
        rates = slope(machine.inverse_kinematics, poses, 2e-3 * machine.l1)
        forces = np.einsum("nki,nk->ni", rates, torques)
        expected = lagrange_forces(machine, poses, velocities, accelerations)
        scale = np.abs(expected).max(axis=-1, keepdims=True)
        assert (np.abs(forces - expected) / scale).max() < 1e-5


def test_holding_torques_do_the_virtual_work_of_gravity(
    drawn: Any, rng: np.random.Generator
) -> None:
    still = np.zeros(2)
    for machine in drawn.machines:
        poses, virtual, _ = states(machine, rng)
        step = 1e-6 * virtual
        joints = machine.inverse_kinematics(poses + step) - machine.inverse_kinematics(poses - step)
        work = (machine.inverse_dynamics(poses, still, still) * joints).sum(axis=-1)
        lifted = potential(machine, poses + step) - potential(machine, poses - step)
        np.testing.assert_allclose(work, lifted, rtol=1e-5, atol=1e-9)


def test_torques_are_linear_in_the_inertias(drawn: Any, rng: np.random.Generator) -> None:
    for machine in drawn.machines:
        state = states(machine, rng)
        whole = machine.inverse_dynamics(*state)
        parts = sum(
            replace(machine, **{n: 1e-30 for n in ("I_A", "m", "mr_A") if n != name})
            .inverse_dynamics(*state)
            for name in ("I_A", "m", "mr_A")
        )  # fmt: skip
        np.testing.assert_allclose(parts, whole, rtol=1e-9, atol=1e-9)


# The cycle ----------------------------------------------------------------------------------------


def path(machine: Any, task: Any, n: int) -> tuple[np.ndarray, ...]:
    """Instants (n,), poses, velocities and accelerations (n, 2) of the task's cycle."""
    width = task.cycle_width_ratio * task.b
    time = 0.30 * task.cycle_time_ratio * np.sqrt(task.b / 0.8)
    t = np.linspace(0.0, time, n)
    lift = task.cycle_lift_ratio * width
    rows = np.array([pick_and_place(instant, width, lift, time, task.overlap) for instant in t])
    floor = np.array([0.0, -machine.H - machine.h])
    return t, floor + rows[:, :2], rows[:, 2:4], rows[:, 4:]


def test_the_drives_work_is_the_energy_at_every_instant(drawn: Any) -> None:
    for i, machine in enumerate(drawn.machines):
        t, poses, velocities, accelerations = path(machine, drawn.evaluation.task(i), 4001)
        torques = machine.inverse_dynamics(poses, velocities, accelerations)
        rates = np.einsum("nij,nj->ni", machine.inverse_jacobian(poses), velocities)
        power = (torques * rates).sum(axis=-1)
        work = np.concatenate([[0.0], np.cumsum(0.5 * (power[1:] + power[:-1]) * np.diff(t))])
        arms = 0.5 * machine.I_A * (rates**2).sum(axis=-1)
        energy = arms + 0.5 * machine.m * (velocities**2).sum(axis=-1) + potential(machine, poses)
        gained = energy - energy[0]
        assert np.abs(work - gained).max() < 1e-5 * np.abs(gained).max()


def test_cycle_indices_are_the_extremes_along_the_path(drawn: Any) -> None:
    indices = drawn.evaluation.indices
    for i, machine in enumerate(drawn.machines):
        samples = drawn.evaluation.problem.options.cycle_samples
        t, poses, velocities, accelerations = path(machine, drawn.evaluation.task(i), samples)
        torques = machine.inverse_dynamics(poses, velocities, accelerations)
        rates = np.einsum("nij,nj->ni", machine.inverse_jacobian(poses), velocities)
        mean_squares = np.trapezoid(torques**2, t, axis=0) / t[-1]
        expected = {
            "tau_peak": np.abs(torques).max(),
            "tau_rms": np.sqrt(mean_squares.max()),
            "power_peak": np.abs(torques * rates).max(),
            "speed_peak": np.abs(rates).max(),
        }
        for name, value in expected.items():
            assert indices[name][i] == pytest.approx(value, rel=1e-9), name


def test_the_cycles_samples_are_within_a_thousandth_of_finer_ones(drawn: Any) -> None:
    evaluation = drawn.evaluation
    finer = pkm_gym.make_problem("diamond", cycle=True, cycle_samples=16001)
    fine = finer.evaluate(evaluation.designs, evaluation.tasks).indices
    for name in ("tau_peak", "tau_rms", "power_peak", "speed_peak"):
        np.testing.assert_allclose(evaluation.indices[name], fine[name], rtol=1e-3, err_msg=name)


def test_the_torque_index_bounds_the_inertial_torque(drawn: Any, rng: np.random.Generator) -> None:
    still = np.zeros(2)
    for tau_G, machine in zip(drawn.evaluation.indices["tau_G"], drawn.machines, strict=True):
        poses, _, accelerations = states(machine, rng, 200)
        inertial = machine.inverse_dynamics(poses, still, accelerations)
        inertial -= machine.inverse_dynamics(poses, still, still)
        bound = 1.002 * tau_G * np.linalg.norm(accelerations, axis=-1)
        assert (np.abs(inertial) <= bound[:, None]).all()
