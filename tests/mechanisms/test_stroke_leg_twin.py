"""The leg's twin: other designs of it, its solver, its sag, its servos on a step."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.twin import INTEGRATORS
from pkm_gym.mechanisms.stroke_leg import twin as module
from pkm_gym.mechanisms.stroke_leg.step import Step
from pkm_gym.twin.check import check, random_designs
from pkm_gym.twin.model import Twin

NAMES = ("stroke_leg", "stroke_leg_gait")
SPEED = 1.6e-6  # m/s, what the paper states of its own simulation


@pytest.fixture
def leg():
    problem = pkm_gym.make_problem("stroke_leg")
    return problem.mechanism(problem.printed_design())


@pytest.fixture(params=NAMES)
def legs(request):
    """The printed or default leg and random feasible ones of both problems."""
    problem = pkm_gym.make_problem(request.param)
    designs = [problem.printed_design(), *random_designs(problem, 4, seed=20)]
    return [problem.mechanism(design) for design in designs]


def rows_of(machine, poses=None):
    return {row.quantity: row for row in check(machine, poses)}


def test_legs_of_both_problems_hold(legs):
    for machine in legs:
        rows = rows_of(machine)
        assert [name for name, row in rows.items() if not row.holds] == []
        assert rows["settled position"].worst < 1e-9
        assert rows["piston speeds, driven"].limit == SPEED


def test_the_design_with_d_above_its_dead_line_holds(leg):
    other = replace(leg, gamma=leg.gamma + np.pi)
    assert other.home_mode.tolist() == [1.0, 1.0]
    rows = rows_of(other)
    assert [name for name, row in rows.items() if not row.holds] == []
    mid = other.sample_poses()[0]
    assert (module.margins(other, mid, other.inverse_kinematics(mid)) > 0.0).all()


def test_unequal_cranks_hold(leg):
    rows = rows_of(replace(leg, l5=0.9 * leg.l5))
    assert [name for name, row in rows.items() if not row.holds] == []


def test_it_is_solved_by_euler_without_gravity(leg):
    option = Twin(leg, leg.sample_poses()[0]).model.opt
    assert option.integrator == INTEGRATORS["Euler"]
    np.testing.assert_array_equal(option.gravity, 0.0)


def test_the_other_integrator_breaks_down(leg, monkeypatch):
    monkeypatch.setattr(module, "SOLVER", replace(module.SOLVER, integrator="implicitfast"))
    twin = Twin(leg, leg.sample_poses()[0])
    said = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(said.append)
    try:
        twin.settle(leg.inverse_kinematics(leg.foot(np.radians([40.0, 10.0]))))
    finally:
        mujoco.set_mju_user_warning(before)
    assert any("unstable" in warning for warning in said)


def test_the_servos_are_as_stiff_as_oil_and_sag_is_what_virtual_work_says(leg):
    pose = leg.foot(np.radians([30.0, 10.0]))
    twin = Twin(leg, leg.sample_poses()[0])
    np.testing.assert_allclose(twin.model.actuator_gainprm[twin.servos, 0], 2e6)
    sag = rows_of(leg, pose[None])["sag with gravity"]
    assert sag.limit is None
    twin.model.opt.gravity[:] = mujoco.MjOption().gravity
    twin.place(twin.coordinates(pose[None])[0])
    borne = twin.bearing_forces()
    expected = np.linalg.norm(leg.jacobian(pose) @ borne / module.STIFFNESS)
    assert sag.worst == pytest.approx(expected, rel=0.02)
    assert sag.worst > 1e-4


def test_a_driven_twin_s_pistons_move_as_the_jacobian_says(leg):
    speeds = module.piston_speeds(leg)
    assert len(speeds.times) == 200
    assert speeds.times[-1] == pytest.approx(2.0)
    assert np.abs(speeds.twin - speeds.analytic).max() < SPEED
    assert np.abs(speeds.twin - speeds.planned).max() < 1e-3
    lag = np.linalg.norm(speeds.poses - module.step_of(leg).motion(speeds.times).position, axis=1)
    assert lag.max() < 1e-3
    peaks = np.abs(speeds.planned).max(axis=0)
    np.testing.assert_allclose(peaks, [0.0888, 0.0949], rtol=5e-3)


def test_a_wrong_leg_s_piston_speeds_are_found_out(leg, monkeypatch):
    build = module.build
    monkeypatch.setattr(
        module, "build", lambda one, pose: build(replace(one, l3=1.001 * one.l3), pose)
    )
    speeds = module.piston_speeds(leg)
    assert np.abs(speeds.twin - speeds.analytic).max() > 10.0 * SPEED


def test_another_step_and_one_out_of_reach(leg):
    short = module.piston_speeds(leg, Step(stride=0.2, lift=0.05, period=1.0), samples=50)
    assert len(short.twin) == 50
    with pytest.raises(ValueError, match="out of the machine's reach"):
        module.piston_speeds(leg, Step(hip_height=1.1))


def test_the_course_is_the_step_to_the_leg_s_scale(leg):
    course = module.course(leg, 41)
    low, high = course.poses.min(axis=0), course.poses.max(axis=0)
    np.testing.assert_allclose(low, [-0.2, -0.8], atol=1e-12)
    np.testing.assert_allclose(high, [0.2, -0.7], atol=1e-12)
    assert course.duration == 2.0
    double = module.course(replace(leg, l=2.0 * leg.l), 41)
    np.testing.assert_allclose(double.poses, 2.0 * course.poses)


def test_a_gait_leg_steps_in_its_own_rectangle():
    problem = pkm_gym.make_problem("stroke_leg_gait", task={"x0": 0.05, "lift": 0.1})
    machine = problem.mechanism(problem.printed_design())
    course = module.course(machine, 401)
    np.testing.assert_allclose(course.poses.min(axis=0), machine.workspace().min(axis=0), atol=1e-9)
    np.testing.assert_allclose(course.poses.max(axis=0), machine.workspace().max(axis=0), atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_every_feasible_leg_of_the_family_can_take_its_step(name, rng):
    problem = pkm_gym.mechanisms.family_problem(name)
    tasks = problem.draw_tasks(40_000, rng)
    designs = rng.uniform(problem.low, problem.high, (len(tasks), len(problem.low)))
    lucky = np.flatnonzero(problem.evaluate(designs, tasks).feasible)[:30]
    assert len(lucky) > 5
    for k in lucky:
        machine = problem.mechanism(designs[k], problem.unpack(tasks[k]))
        assert np.isfinite(machine.inverse_kinematics(module.course(machine).poses)).all()


def test_a_step_across_a_dead_line_is_refused(leg):
    with pytest.raises(ValueError, match="the crank OA crosses its dead line on the step"):
        module.course(replace(leg, phi=np.radians(175.0)))


def test_margins_change_sign_at_each_singularity(leg):
    pose = leg.sample_poses()[0]
    joints = leg.inverse_kinematics(pose)
    assert (module.margins(leg, pose, joints) > 0.0).all()
    across = leg.foot(np.radians([75.0, 25.0]))  # A below OB
    assert module.margins(leg, across, leg.inverse_kinematics(across))[0] < 0.0
    across = replace(leg, gamma=np.radians(80.0))  # D above OC with the cylinder long
    pose = across.foot(np.radians([15.0, 29.0]))
    assert module.margins(across, pose, across.inverse_kinematics(pose))[1] < 0.0


def test_the_twin_draws_only_poses_that_the_cylinders_hold(leg, rng):
    poses = module.draw_poses(leg, 50, rng)
    assert 50 < len(poses) < 54  # one corner at least is across the printed design's dead line
    clear = leg.dead_point_angles(poses)
    assert np.min(list(clear.values())) > 0.0


def test_parts_weigh_what_they_are_drawn_as(leg):
    model = Twin(leg, leg.sample_poses()[0]).model
    assert 4.0 < model.body_mass.sum() < 8.0
    for name in ("OF", "FJ", "JI", "OE", "EH", "HI", "barrel_2", "rod_2", "barrel_4", "rod_4"):
        assert model.body(name).mass[0] > 0.1


HINGED = (
    "machine-OF", "machine-OE", "OF-OE", "OF-FJ", "FJ-JI", "OE-EH", "EH-HI", "FJ-EH", "JI-HI",
    "machine-barrel_2", "machine-barrel_4", "barrel_2-rod_2", "barrel_4-rod_4", "rod_2-OF",
    "rod_4-OE",
)  # fmt: skip


def test_nothing_runs_through_anything_else(legs):
    joined = {frozenset(pair.split("-")) for pair in HINGED}
    for machine in legs:
        twin = Twin(machine, machine.sample_poses()[0])
        model = twin.model
        bodies = [model.body(body).name for body in model.geom_bodyid]
        apart = [
            (one, other)
            for one in range(model.ngeom)
            for other in range(one)
            if "world" not in (bodies[one], bodies[other])
            and bodies[one] != bodies[other]
            and frozenset((bodies[one], bodies[other])) not in joined
        ]
        assert len(apart) > 500
        for coordinates in twin.coordinates(
            module.draw_poses(machine, 20, np.random.default_rng(1))
        ):
            twin.place(coordinates)
            for one, other in apart:
                between = mujoco.mj_geomDistance(model, twin.data, one, other, 0.01, None)
                assert between > 0.0, (bodies[one], bodies[other])
