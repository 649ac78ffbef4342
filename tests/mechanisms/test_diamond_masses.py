"""The Diamond with masses and motors of one's own: energy, the twin, limits over the cycle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

import pkm_gym
from pkm_gym.core.drives import Drives, cycle_drives, drives_along
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import polish, solve_tasks
from pkm_gym.core.trajectory import pick_and_place
from pkm_gym.core.twin import Course, twin_module
from pkm_gym.mechanisms.diamond.masses import presets
from pkm_gym.twin.check import check
from pkm_gym.twin.model import Twin

GRAVITY = 9.81
TASK = {"b": 0.6, "h_ratio": 1.0 / 6.0, "payload": 1.5, "cycle_time_ratio": 1.3}
OWN = {"m_arm": 0.42, "m_rod": 0.09, "m_d": 0.25, "m_p": 0.6, "motor": 3e-3}
LIMITS = {
    "torque": ("torque_max", "tau_peak"), "rms": ("rms_max", "tau_rms"),
    "speed": ("speed_max", "speed_peak"), "power": ("power_max", "power_peak"),
}  # fmt: skip


@pytest.fixture(scope="module")
def own() -> DesignProblem:
    return pkm_gym.make_problem("diamond", task=TASK, inertia="static", cycle=True, **OWN)


@pytest.fixture(scope="module")
def design() -> np.ndarray:
    return np.array([0.55, 2.3, 0.42])


@pytest.fixture(scope="module")
def drives(own: DesignProblem, design: np.ndarray) -> Drives:
    return cycle_drives(own, design, samples=4001)


# Masses -------------------------------------------------------------------------------------------


def energy(machine: Any, poses: np.ndarray, velocities: np.ndarray) -> np.ndarray:
    """Kinetic and potential energy (n,) of the bodies, from what they weigh.

    Uniform arms, elbows as points, half of both rods of a limb at its elbow and half at the tool.
    """
    angles = machine.inverse_kinematics(poses)
    ahead, behind = (machine.inverse_kinematics(poses + s * 1e-6 * velocities) for s in (1.0, -1.0))
    rates = (ahead - behind) / 2e-6
    elbow, tool = OWN["m_d"] + OWN["m_rod"], OWN["m_p"] + 2.0 * OWN["m_rod"] + TASK["payload"]
    about = OWN["motor"] + OWN["m_arm"] * machine.l1**2 / 3.0 + elbow * machine.l1**2
    kinetic = 0.5 * about * (rates**2).sum(axis=1) + 0.5 * tool * (velocities**2).sum(axis=1)
    arms = (0.5 * OWN["m_arm"] + elbow) * machine.l1 * np.sin(angles).sum(axis=1)
    return np.asarray(kinetic + GRAVITY * (arms + tool * poses[:, 1]))


def test_the_drives_power_is_what_the_bodies_energy_gains(
    own: DesignProblem, design: np.ndarray, drives: Drives
) -> None:
    machine: Any = own.mechanism(design)
    course = twin_module(machine).course(machine, 4001, own.task)
    held = energy(machine, course.poses, course.twists)
    gained = np.gradient(held, np.linspace(0.0, course.duration, 4001), edge_order=2)
    torques = machine.inverse_dynamics(course.poses, course.twists, course.accelerations)
    power = (torques * drives.rates).sum(axis=1)
    assert np.abs(power - gained).max() < 1e-4 * np.abs(power).max()


def test_the_drives_torques_are_without_the_motors_inertia(drives: Drives) -> None:
    bare = pkm_gym.make_problem("diamond", task=TASK, inertia="static", **{**OWN, "motor": 0.0})
    alone = cycle_drives(bare, np.array([0.55, 2.3, 0.42]), samples=4001)
    np.testing.assert_allclose(drives.torques, alone.torques, rtol=1e-9, atol=1e-9)
    gained = cumulative_trapezoid(drives.accelerations, dx=drives.duration / 4000, axis=0)
    step, jerk = drives.duration / 4000, np.abs(np.diff(drives.accelerations, axis=0)).max()
    np.testing.assert_allclose(drives.rates[1:], gained, rtol=0, atol=step * jerk)  # of trapezoids


def test_the_twin_agrees_and_its_bodies_weigh_what_is_given(
    own: DesignProblem, design: np.ndarray
) -> None:
    machine = own.mechanism(design)
    rows = {row.quantity: row for row in check(machine)}
    assert all(row.holds for row in rows.values())
    assert rows["torques on the path"].limit is not None
    model = Twin(machine, machine.sample_poses()[0]).model
    assert model.body("rod_1").mass[0] == pytest.approx(2.0 * OWN["m_rod"])
    assert model.body("platform").mass[0] == pytest.approx(OWN["m_p"] + TASK["payload"])


@pytest.mark.parametrize("preset", presets())
def test_the_twin_s_rods_weigh_what_the_preset_says(preset: str) -> None:
    problem = pkm_gym.make_problem("diamond", inertia=preset)
    machine: Any = problem.mechanism(problem.printed_design())
    model = Twin(machine, machine.sample_poses()[0]).model
    table = presets()[preset]
    assert model.body("rod_1").mass[0] == pytest.approx(2.0 * table.mu2 * machine.l2)
    assert model.body("platform").mass[0] == pytest.approx(table.m_p)


def test_density_and_section_make_bodies_heavier_as_they_grow() -> None:
    material = {"arm_density": 2700.0, "arm_section": 4e-4, "rod_density": 1600.0,
                "rod_section": 5e-5}  # fmt: skip
    made = pkm_gym.make_problem("diamond", inertia="static", **material)
    same = pkm_gym.make_problem("diamond", inertia="static", mu1=1.08, mu2=0.08)
    fixed = pkm_gym.make_problem("diamond", inertia="static", m_arm=0.25, m_rod=0.05)
    designs = np.array([[0.4, 2.3, 0.4], [0.7, 2.6, 0.4]])
    for values in designs:
        machines: list[Any] = [p.mechanism(values) for p in (made, same, fixed)]
        one, other, third = machines
        for name in ("I_A", "m", "mr_A", "rod"):
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-12)
        assert one.rod == pytest.approx(1600.0 * 5e-5 * one.l2)
        assert third.rod == 0.05
        table, l1 = presets()["static"], one.l1
        arm = 0.25 * l1**2 / 3.0 + (table.m_d + 0.05) * l1**2 + table.motor
        assert pytest.approx(arm) == third.I_A


def test_own_masses_under_the_printed_shares_are_said_to_be_so() -> None:
    for options, said in (({}, 0), ({"m_p": 0.5}, 0), ({"m_arm": 0.3}, 1), ({"mu2": 0.1}, 1)):
        assert len(pkm_gym.make_problem("diamond", **options).notes) == said
        assert not pkm_gym.make_problem("diamond", inertia="static", **options).notes


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"m_arm": -1.0}, "m_arm is -1.0: it must be a number from 0.001 to 50 kg"),
        ({"m_arm": 0.3, "mu1": 1.0}, "m_arm and mu1 say twice what arms weigh"),
        ({"m_rod": 0.3, "rod_density": 1e3, "rod_section": 1e-4}, "m_rod and rod_density and rod"),
        ({"arm_density": 2700.0}, "arm_density says no mass without arm_section: give both"),
        ({"rod_section": 1e-4}, "rod_section says no mass without rod_density: give both"),
        ({"torque_max": 0.0}, "torque_max is 0.0: it must be a number from 0.001 to 100000 N m"),
        ({"speed_max": float("inf")}, "speed_max is inf: it must"),
        ({"tourqe_max": 3.0}, "unknown argument 'tourqe_max'; did you mean 'torque_max'"),
    ],
)
def test_illegal_masses_and_limits_are_refused(options: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        pkm_gym.make_problem("diamond", **options)


def test_merit_goes_with_the_masses(own: DesignProblem) -> None:
    found = solve_tasks(own, own.pack(None)[None])
    assert found.certified[0]
    best = own.evaluate(found.designs)
    assert abs(best.log_merit[0]) < np.log(2.0)


# Limits of the motors -----------------------------------------------------------------------------


def test_limits_are_off_unless_they_are_given() -> None:
    plain = pkm_gym.make_problem("diamond")
    assert not set(LIMITS) & set(plain.constraint_names)
    off = pkm_gym.make_problem("diamond", torque_max=None, m_arm=None)
    assert off.hash() == plain.hash()
    on = pkm_gym.make_problem("diamond", torque_max=30.0)
    assert on.constraint_names == (*plain.constraint_names, "torque")
    assert "tau_peak" in on.index_names
    other = pkm_gym.make_problem("diamond", torque_max=31.0)
    assert len({plain.hash(), on.hash(), other.hash()}) == 3
    assert on.with_task({"payload": 1.0}).hash() == on.hash()
    assert on.with_task({}, torque_max=None, cycle=False).hash() == plain.hash()


def dense(machine: Any, task: Any) -> dict[str, float]:
    """Torque, speed and power over 20,001 instants of the cycle."""
    width, time = task.cycle_width_ratio * task.b, 0.3 * task.cycle_time_ratio
    time *= np.sqrt(task.b / 0.8)
    rows = np.array([
        pick_and_place(t, width, task.cycle_lift_ratio * width, time, task.overlap)
        for t in np.linspace(0.0, time, 20_001)
    ])  # fmt: skip
    rows[:, 1] -= machine.H + machine.h
    found = drives_along(machine, Course(time, rows[:, :2], rows[:, 2:4], rows[:, 4:]))
    torques = found.with_inertia(machine.drive_inertia)
    return {
        "tau_peak": float(np.abs(torques).max()), "tau_rms": float(found.rms(torques).max()),
        "speed_peak": float(np.abs(found.rates).max()),
        "power_peak": float(np.abs(torques * found.rates).max()),
    }  # fmt: skip


@pytest.mark.parametrize("name", LIMITS)
def test_a_limit_holds_up_to_what_a_dense_sample_finds(
    own: DesignProblem, design: np.ndarray, name: str
) -> None:
    option, index = LIMITS[name]
    reached = dense(own.mechanism(design), own.task)[index]
    for share, holds in ((1.01, True), (0.99, False), (0.5, False)):
        limited = own.with_task(None, **{option: share * reached})
        evaluation = limited.evaluate(design[None])
        constraint = evaluation.constraints[0, limited.constraint_names.index(name)]
        assert constraint == pytest.approx(1.0 / share - 1.0, abs=2e-3)
        assert (constraint <= 0.0) == holds
        assert (f"{name}: " in evaluation.explain(0)) != holds


def test_a_search_keeps_to_a_torque(own: DesignProblem) -> None:
    free = own.evaluate(solve_tasks(own, own.pack(None)[None]).designs)
    limited = own.with_task(None, torque_max=float(0.97 * free.indices["tau_peak"][0]))
    found = solve_tasks(limited, limited.pack(None)[None])
    assert found.certified[0]
    assert found.active[0, limited.constraint_names.index("torque")]
    assert found.optima[0] > free.objectives[0, 0]
    # merit's minimiser: its penalty is exact for a tight limit, too
    near = limited.evaluate(polish(limited, free.designs, radius=1.0))
    assert near.feasible[0]
    assert near.objectives[0, 0] == pytest.approx(found.optima[0], rel=1e-5)
