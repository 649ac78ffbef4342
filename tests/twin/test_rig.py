"""A rig: its path, what it measures, and whether the machine is still in its modes."""

from __future__ import annotations

import copy
import pickle

import mujoco
import numpy as np
import pytest

import pkm_gym
from pkm_gym.twin.check import random_designs
from pkm_gym.twin.model import Twin
from pkm_gym.twin.rig import Rig


@pytest.fixture
def speed(twinned):
    """The speed, in paths of the paper, at which the environment drives the twin."""
    return twinned.declared.motion.get("speed", 1.0)


@pytest.fixture
def rig(machine, speed):
    return Rig(machine, speed=speed, frame_skip=5)


def test_it_stands_at_the_start_of_its_path(rig, machine):
    state, start = rig.state, rig.path.poses[0]
    np.testing.assert_allclose(state.joints, machine.inverse_kinematics(start), atol=1e-12)
    np.testing.assert_allclose(state.pose, start, atol=1e-12)
    np.testing.assert_allclose(state.position, rig.path.positions[0], atol=1e-12)
    np.testing.assert_allclose(state.velocity, 0.0, atol=1e-12)
    assert state.gap < 1e-12
    assert rig.assembled


def test_the_path_is_the_paper_s_at_half_control_steps(rig, machine, speed):
    course = rig.twin.module.course(machine, 4001).at_speed(speed)
    path = rig.path
    assert path.steps == np.ceil(course.duration / rig.dt - 1e-9)
    times = 0.5 * rig.dt * np.arange(len(path.poses))
    exact = rig.twin.module.frames(machine, course.poses)[:, : path.positions.shape[1], 3]
    known = np.linspace(0.0, course.duration, len(exact))
    for k, column in enumerate(exact.T):
        np.testing.assert_allclose(path.positions[:, k], np.interp(times, known, column), atol=5e-6)
    np.testing.assert_allclose(path.positions[-1], exact[-1], atol=1e-9)
    middle = slice(1, -1)
    change = np.gradient(path.positions, 0.5 * rig.dt, axis=0)[middle]
    moved = path.velocities[middle, machine.turning :]
    np.testing.assert_allclose(change, moved, atol=0.02 * np.abs(moved).max())


def test_every_point_of_every_feasible_design_s_path_is_within_reach(twinned, speed):
    for design in random_designs(twinned, 12, seed=8):
        machine = twinned.mechanism(design)
        rig = Rig(machine, speed=speed)
        assert np.isfinite(machine.inverse_kinematics(rig.path.poses)).all()


def test_twice_the_speed_is_half_the_time_and_four_times_the_acceleration(machine, speed):
    one, two = (Rig(machine, speed=k * speed, frame_skip=1) for k in (1.0, 2.0))
    assert two.path.steps == pytest.approx(0.5 * one.path.steps, abs=1)
    ratio = np.abs(two.path.accelerations).max() / np.abs(one.path.accelerations).max()
    assert ratio == pytest.approx(4.0, rel=1e-2)


def test_a_control_step_is_so_many_steps_of_mujoco(rig, machine):
    forces = 0.3 * rig.twin.bearing_forces()
    for _ in range(20):
        rig.drive(forces)
    twin = Twin(machine, rig.path.poses[0])
    twin.release()
    twin.data.ctrl[twin.motors] = forces
    mujoco.mj_step(twin.model, twin.data, 20 * rig.frame_skip)
    np.testing.assert_allclose(rig.twin.data.qpos, twin.data.qpos, rtol=0.0, atol=1e-12)
    assert rig.twin.data.time == pytest.approx(20 * rig.dt)


def test_bearing_forces_hold_it(rig):
    for _ in range(40):
        rig.drive(rig.twin.bearing_forces())
    np.testing.assert_allclose(rig.state.position, rig.path.positions[0], atol=1e-6)


def test_bearing_forces_at_rest_are_the_exact_drive_forces(rig):
    still = np.zeros(rig.path.velocities.shape[1])
    borne = rig.twin.bearing_forces()
    np.testing.assert_allclose(borne, rig.twin.drive_forces(still, still), atol=1e-6)


def test_it_can_be_put_on_its_path_in_motion(rig, machine):
    module = rig.twin.module
    course = module.course(machine, 41)
    pose, twist = course.poses[9], course.twists[9]
    rig.reset(pose, twist)
    expected = rig.twin.position_of(module.frames(machine, pose[None]))[0]
    np.testing.assert_allclose(rig.state.position, expected, atol=2e-6)
    np.testing.assert_allclose(rig.state.velocity, twist, atol=1e-9)
    assert np.abs(twist).max() > 1e-3
    assert rig.state.gap < 1e-9
    rig.reset()
    np.testing.assert_allclose(rig.state.pose, rig.path.poses[0], atol=1e-12)


def test_a_pose_out_of_reach_is_refused_and_changes_nothing(rig, machine, out_of_reach):
    before = rig.save()
    with pytest.raises(ValueError, match="out of the machine's reach"):
        rig.reset(out_of_reach(machine))
    np.testing.assert_array_equal(rig.save(), before)


def test_poses_follow_from_frames(machine, rng):
    module = Twin(machine, machine.sample_poses()[0]).module
    poses = module.draw_poses(machine, 20, rng)
    for pose, frame in zip(poses, module.frames(machine, poses), strict=True):
        np.testing.assert_allclose(module.pose(machine, frame), pose, atol=1e-12)


def test_margins_are_positive_all_over_the_workspace(twinned, rng):
    for design in random_designs(twinned, 5, seed=3):
        machine = twinned.mechanism(design)
        module = Twin(machine, machine.sample_poses()[0]).module
        poses = module.draw_poses(machine, 30, rng)
        for pose, joints in zip(poses, machine.inverse_kinematics(poses), strict=True):
            assert (module.margins(machine, pose, joints) > 0.0).all()


def margins(name, rng):
    """Margins (n, k) of random poses of the printed design, and its local indices there."""
    problem = pkm_gym.make_problem(name)
    machine = problem.mechanism(problem.printed_design())
    module = Twin(machine, machine.sample_poses()[0]).module
    poses = module.draw_poses(machine, 30, rng)
    pairs = zip(poses, machine.inverse_kinematics(poses), strict=True)
    return np.array([module.margins(machine, *pair) for pair in pairs]), machine.local_indices(
        poses
    )


def test_the_diamond_s_margins_are_the_sines_of_its_angles(rng):
    found, local = margins("diamond", rng)
    np.testing.assert_allclose(found[:, 0], local["sin_alpha"], atol=1e-12)
    np.testing.assert_allclose(found[:, 1:].min(axis=1), local["sin_beta"], atol=1e-12)


def test_the_3_spr_s_first_margin_is_its_determinant(rng):
    found, local = margins("spr3", rng)
    np.testing.assert_allclose(found[:, 0], local["det"], atol=1e-12)


def test_the_diamond_s_other_modes_have_a_negative_margin():
    problem = pkm_gym.make_problem("diamond")
    machine = problem.mechanism(problem.printed_design())
    module = Twin(machine, machine.sample_poses()[0]).module
    pose = machine.sample_poses()[0]
    outward = machine.inverse_kinematics(pose)
    inward = []
    for drive, angle in zip((machine.e, -machine.e), outward, strict=True):
        away = np.arctan2(pose[1], pose[0] - drive)
        inward.append(2.0 * away - angle)  # the elbow mirrored in the line from drive to platform
    margins = module.margins(machine, pose, np.array(inward))
    assert (margins[1:] < 0.0).all()
    above = pose.copy()
    above[1] *= -1.0  # the mirror image of the machine: elbows above, platform above
    mirrored = module.margins(machine, above, -outward)
    assert mirrored[0] < 0.0


def test_the_path_s_largest_force_is_that_of_the_exact_drive_forces(rig):
    peak = rig.peak_force()
    path, twin = rig.path, rig.twin
    found = []
    for k in range(0, len(path.poses), 3):
        twin.place(twin.coordinates(path.poses[k : k + 1])[0])
        found.append(np.abs(twin.drive_forces(path.velocities[k], path.accelerations[k])).max())
    assert peak == pytest.approx(max(found), rel=0.05)


def test_what_was_saved_is_gone_on_from_to_the_bit(rig):
    for _ in range(5):
        rig.drive(rig.twin.bearing_forces())
    saved, forces = rig.save(), 1.5 * rig.twin.bearing_forces()
    rig.drive(forces)
    ahead = rig.state
    rig.reset()
    rig.load(saved)
    rig.drive(forces)
    for one, other in zip(ahead, rig.state, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda rig: pickle.loads(pickle.dumps(rig))])
def test_a_copy_goes_on_to_the_bit_by_itself(rig, copied):
    for _ in range(5):
        rig.drive(rig.twin.bearing_forces())
    other, forces = copied(rig), 1.5 * rig.twin.bearing_forces()
    assert other.twin.model is other.twin.data.model is not rig.twin.model
    for _ in range(3):
        rig.drive(forces)
    for _ in range(3):
        other.drive(forces)
    for one, two in zip(rig.state, other.state, strict=True):
        np.testing.assert_array_equal(one, two)


def test_a_simulation_that_breaks_down_keeps_the_state_before(rig):
    before = rig.state
    rig.drive(np.full(len(rig.twin.motors), 1e12))
    assert not rig.stable
    assert rig.state is before
    rig.reset()
    assert rig.stable
    assert mujoco.get_mju_user_warning() is None
