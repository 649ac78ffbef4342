"""A twin's masses, energies, drives and poses, against what the model says of them."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.twin import INTEGRATORS, twin_module
from pkm_gym.mechanisms.diamond.problem import REFERENCE
from pkm_gym.twin.model import Twin


@pytest.fixture
def diamond():
    problem = pkm_gym.make_problem("diamond")
    return problem.mechanism(problem.printed_design())


def test_a_solver_chooses_the_integrator_and_may_be_without_gravity(machine, monkeypatch):
    module = twin_module(machine)
    for name, integrator in INTEGRATORS.items():
        for gravity, expected in ((True, -9.81), (False, 0.0)):
            solver = replace(module.SOLVER, integrator=name, gravity=gravity)
            monkeypatch.setattr(module, "SOLVER", solver)
            option = Twin(machine, machine.sample_poses()[0]).model.opt
            assert option.integrator == integrator
            np.testing.assert_array_equal(option.gravity, [0.0, 0.0, expected])


def mass_matrix(twin):
    mass = np.empty((twin.model.nv, twin.model.nv))
    mujoco.mj_fullM(twin.model, twin.data, mass)
    return mass


def test_a_twin_is_assembled_at_the_pose_it_was_built_at(machine):
    for pose in machine.sample_poses():
        twin = Twin(machine, pose)
        assert twin.gap < 1e-12
        np.testing.assert_allclose(
            twin.data.qpos[twin.values], machine.inverse_kinematics(pose), atol=1e-12
        )
        np.testing.assert_allclose(
            twin.frame, twin.module.frames(machine, pose[None])[0], atol=1e-12
        )


def test_its_loops_leave_the_mechanism_s_freedom_and_no_more(machine):
    """What else is free moves none of the points that are marked: a rod's spin about itself."""
    twin = Twin(machine, machine.sample_poses()[1])
    sites = np.zeros((twin.model.nsite, 3, twin.model.nv))
    for site, rows in enumerate(sites):
        mujoco.mj_jacSite(twin.model, twin.data, rows, None, site)
    loops = sites[twin.loops[:, 0]] - sites[twin.loops[:, 1]]
    held, marked = (np.linalg.matrix_rank(x.reshape(-1, twin.model.nv)) for x in (loops, sites))
    assert marked - held == len(machine.joint_names)
    spins = (twin.model.jnt_type == mujoco.mjtJoint.mjJNT_BALL).sum()
    assert twin.model.nv - marked <= spins


def test_joints_slide_or_turn_as_the_mechanism_says(machine):
    twin = Twin(machine, machine.sample_poses()[0])
    kinds = {"m": mujoco.mjtJoint.mjJNT_SLIDE, "rad": mujoco.mjtJoint.mjJNT_HINGE}
    for name in machine.joint_names:
        assert twin.model.joint(name).type[0] == kinds[machine.joint_unit]


def test_velocities_keep_the_loops_closed_and_move_the_tool(machine, rng):
    pose = machine.sample_poses()[1]
    twin = Twin(machine, pose)
    twist = machine.jacobian(pose) @ rng.normal(size=len(machine.joint_names))
    step = 1e-6
    twin.data.qvel[:] = twin.velocities(twist)
    before = twin.frame
    mujoco.mj_integratePos(twin.model, twin.data.qpos, twin.data.qvel, step)
    mujoco.mj_forward(twin.model, twin.data)
    turned = (twin.frame[:, :3] - before[:, :3]) @ before[:, :3].T / step
    angular = np.array([turned[2, 1], turned[0, 2], turned[1, 0]])[: machine.turning]
    linear = (twin.frame - before)[: len(twist) - machine.turning, 3] / step
    np.testing.assert_allclose([*angular, *linear], twist, atol=1e-4)
    assert twin.gap < 1e-9


def test_the_lumped_diamond_has_the_energy_of_equation_9(diamond, rng):
    for pose in diamond.sample_poses():
        twin = Twin(diamond, pose, lumped=True)
        velocity = rng.normal(size=2)
        rates = diamond.inverse_jacobian(pose) @ velocity
        all_rates = twin.velocities(velocity)
        kinetic = 0.5 * all_rates @ mass_matrix(twin) @ all_rates
        expected = 0.5 * diamond.m * velocity @ velocity + 0.5 * diamond.I_A * rates @ rates
        assert kinetic == pytest.approx(expected, rel=1e-7)


def test_the_diamond_s_bodies_have_the_masses_of_the_tables(diamond):
    twin = Twin(diamond, diamond.sample_poses()[0])
    table = REFERENCE.data["inertia"]["printed"]
    pair = 2.0 * table["mu2"] * diamond.l2
    mass = {name: twin.model.body(name).mass[0] for name in ("platform", "rod_1", "rod_2")}
    assert mass == pytest.approx({"platform": table["m_p"], "rod_1": pair, "rod_2": pair})


def test_every_feasible_diamond_has_a_legal_arm():
    problem = pkm_gym.make_problem("diamond")
    designs = np.random.default_rng(0).uniform(problem.low, problem.high, (400, 3))
    designs = designs[problem.evaluate(designs).feasible]
    assert len(designs) > 10
    for design in designs:
        machine = problem.mechanism(design)
        model = Twin(machine, machine.sample_poses()[0]).model
        arm = model.body("arm_1")
        about_axis = arm.inertia[2] + arm.mass[0] * arm.ipos[0] ** 2
        rod = 2.0 / 3.0 * REFERENCE.data["inertia"]["printed"]["mu2"] * machine.l2
        assert about_axis == pytest.approx(machine.I_A - rod * machine.l1**2, rel=1e-6)
        assert arm.mass[0] * arm.ipos[0] == pytest.approx(machine.mr_A - rod * machine.l1, rel=1e-6)


def test_servos_at_zero_hold_the_pose(machine):
    pose = machine.sample_poses()[1]
    twin = Twin(machine, pose)
    mujoco.mj_step(twin.model, twin.data, 2000)
    held = twin.data.qpos[twin.values]
    np.testing.assert_allclose(held, machine.inverse_kinematics(pose), atol=2e-3)
    assert np.abs(twin.data.qvel).max() < 1e-3


def test_motors_that_give_the_drive_forces_keep_the_twin_still(machine):
    twin = Twin(machine, machine.sample_poses()[1])
    twin.model.opt.gravity[:] = mujoco.MjOption().gravity  # without it nothing falls
    twin.place(twin.model.qpos0)
    still = np.zeros(len(machine.twist_names))
    forces = twin.drive_forces(still, still)
    twin.release()
    mujoco.mj_forward(twin.model, twin.data)
    falling = np.abs(twin.data.qacc).max()
    twin.data.ctrl[twin.motors] = forces
    mujoco.mj_forward(twin.model, twin.data)
    assert np.abs(twin.data.qacc).max() < 1e-3 * falling


def test_a_twin_that_never_rests_says_so(machine, monkeypatch):
    monkeypatch.setattr("pkm_gym.twin.model.HOLD", 0.01)
    twin = Twin(machine, machine.sample_poses()[0])
    with pytest.raises(RuntimeError, match="has not come to rest"):
        twin.settle(machine.inverse_kinematics(machine.sample_poses()[1]))


def test_a_pose_out_of_reach_is_refused(machine, out_of_reach):
    pose = out_of_reach(machine)
    with pytest.raises(
        ValueError, match=r"no twin stands at the pose \(.*out of the machine's reach"
    ):
        Twin(machine, pose)


def test_a_mechanism_without_a_twin_says_so(machine, monkeypatch):
    monkeypatch.setattr(type(machine), "twin_module", "")
    with pytest.raises(ValueError, match=f"{type(machine).__name__} has no MuJoCo twin"):
        Twin(machine, machine.sample_poses()[0])


def test_the_tool_stands_over_the_floor(machine):
    twin = Twin(machine, machine.sample_poses()[0])
    assert twin.data.site_xpos[twin.tool][2] > 0.0


def axis_that_points_up(name):
    problem = pkm_gym.make_problem(name)
    machine = problem.mechanism(problem.printed_design())
    twin = Twin(machine, machine.sample_poses()[0])
    return twin.data.site_xmat[twin.origin].reshape(3, 3)[2]


def test_the_diamond_hangs_below_its_drives():
    np.testing.assert_allclose(axis_that_points_up("diamond"), [0.0, 1.0, 0.0], atol=1e-15)


def test_the_3_spr_hangs_from_its_fixed_platform():
    np.testing.assert_allclose(axis_that_points_up("spr3"), [0.0, 0.0, -1.0], atol=1e-15)
