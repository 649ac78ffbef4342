"""The 6-PUS's twin: its freedom, its modes, other hexagons, what it engraves, how it is drawn."""

from __future__ import annotations

from dataclasses import replace

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pkm_gym
from pkm_gym.envs.baselines import run, servo
from pkm_gym.mechanisms.pus6 import twin as module
from pkm_gym.mechanisms.pus6.drawn_twin import BAR, SPINDLE, columns
from pkm_gym.mechanisms.pus6.engraving import plane
from pkm_gym.mechanisms.pus6.mechanism import Pus6
from pkm_gym.twin import camera
from pkm_gym.twin.check import check, random_designs
from pkm_gym.twin.model import Twin

TOLD = "accelerations"


@pytest.fixture
def machine():
    problem = pkm_gym.make_problem("pus6")
    return problem.mechanism(problem.printed_design())


def broken(rows):
    return [row.quantity for row in rows if not row.holds]


# The model ----------------------------------------------------------------------------------------


def test_it_has_24_coordinates_and_18_independent_loop_equations(machine):
    twin = Twin(machine, machine.sample_poses()[1])
    rows = []
    for one, other in twin.loops:
        ends = np.zeros((2, 3, twin.model.nv))
        for site, rates in zip((one, other), ends, strict=True):
            mujoco.mj_jacSite(twin.model, twin.data, rates, None, site)
        rows.append(ends[0] - ends[1])
    loops = np.concatenate(rows)
    assert loops.shape == (18, 24)
    assert np.linalg.svd(loops, compute_uv=False).min() > 0.05


def test_machines_with_a_tool_and_other_hexagons_agree():
    problem = pkm_gym.make_problem("pus6_layout", task={"tool": 0.06})
    for design in random_designs(problem, 3, seed=5):
        machine = problem.mechanism(design)
        assert machine.tool == 0.06
        rows = check(machine)
        assert broken(rows) == []
        assert {row.quantity: row.worst for row in rows}["settled position"] < 1e-7


def test_a_wrong_hessian_is_found_out_by_the_accelerations_alone(machine, monkeypatch):
    poses = machine.sample_poses()
    right = Pus6.hessian
    monkeypatch.setattr(Pus6, "hessian", lambda *given: 1.00001 * right(*given))
    assert broken(check(machine, poses)) == [TOLD]


def test_accelerations_are_the_twist_s_differences(machine, rng):
    pose, rates, more = machine.sample_poses()[1], *0.1 * rng.normal(size=(2, 6))
    step = 1e-4
    times = step * np.arange(-2, 3)[:, None]
    joints = machine.inverse_kinematics(pose) + times * rates + 0.5 * times**2 * more
    poses = machine.forward_kinematics(joints, pose)
    twists = np.einsum("nij,nj->ni", machine.jacobian(poses), rates + times * more)
    expected = (8.0 * (twists[3] - twists[1]) - (twists[4] - twists[0])) / (12.0 * step)
    found = machine.acceleration(pose, rates, more)
    np.testing.assert_allclose(found, expected, atol=1e-8 * np.abs(found).max())


def test_the_screws_inertia_is_felt_at_the_sliders(machine):
    model = Twin(machine, machine.sample_poses()[0]).model
    felt = [model.dof_armature[model.joint(name).dofadr[0]] for name in machine.joint_names]
    screw = next(
        geom for geom in range(model.ngeom)
        if model.body(model.geom_bodyid[geom]).name == "column_1"
        and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CYLINDER
    )  # fmt: skip
    radius, half = model.geom_size[screw, :2]
    turning = 0.5 * (7850.0 * np.pi * radius**2 * 2.0 * half) * radius**2
    np.testing.assert_allclose(felt, turning * (2.0 * np.pi / 0.01) ** 2, rtol=1e-12)


def test_parts_weigh_what_they_are_drawn_as(machine):
    twin = Twin(machine, machine.sample_poses()[0])
    model, joints = twin.model, machine.points(np.zeros(6))["C"]
    rod = 7850.0 * np.pi * 0.008**2 * (machine.L + 4.0 / 3.0 * 0.008)
    assert model.body("rod_3").mass[0] == pytest.approx(rod, rel=1e-9)
    ends = [*np.stack([joints, np.roll(joints, -1, axis=0)], axis=1)]
    ends += [[0.5 * (one + other), _hub(machine, 0.5 * (one + other))] for one, other in ends[::2]]
    bars = sum(np.linalg.norm(one - other) + 4.0 / 3.0 * BAR for one, other in ends)
    frame = 2700.0 * np.pi * BAR**2 * bars
    assert model.body("platform").mass[0] == pytest.approx(frame + SPINDLE, rel=1e-9)


def _hub(machine, rim):
    """Where the spoke from a point of the rim meets the hub, 0.2 R around the axis, 110 mm up."""
    return np.array([*(0.2 * machine.R * rim[:2] / np.linalg.norm(rim[:2])), 0.11])


# Its modes ----------------------------------------------------------------------------------------


def test_the_first_margin_changes_sign_at_a_direct_singularity(machine, rng):
    turned = rng.uniform(-1.2, 1.2, (400, 6)) * [0.1, 0.1, 0.0, 1.0, 1.0, 1.0]
    joints = machine.inverse_kinematics(turned)
    reached = np.isfinite(joints).all(axis=1)
    at_home = np.linalg.det(machine.inverse_jacobian(np.zeros(6)))
    signs = []
    for pose, heights in zip(turned[reached], joints[reached], strict=True):
        first, *drops = module.margins(machine, pose, heights)
        side = np.linalg.det(machine.inverse_jacobian(pose)) / at_home
        assert np.sign(first) == np.sign(side)
        assert min(drops) > 0.0
        signs.append(np.sign(side))
    assert min(signs) < 0.0 < max(signs)


def test_a_slider_below_its_joint_has_a_negative_margin(machine):
    pose = machine.sample_poses()[1]
    joints = machine.inverse_kinematics(pose)
    drops = module.margins(machine, pose, joints)[1:]
    at = machine.points(pose)
    np.testing.assert_allclose(drops, at["A"][:, 2] - at["C"][:, 2], atol=1e-12)
    joints[4] -= 2.0 * drops[4]  # the rod's mirror image: it stands
    np.testing.assert_array_equal(
        module.margins(machine, pose, joints)[1:] < 0.0, np.arange(6) == 4
    )


# What is engraved ---------------------------------------------------------------------------------


@pytest.mark.parametrize("task", [{}, {"tilt": 0.6, "z": 0.01}, {"xy": 0.01}, {"z": 0.0}])
def test_the_course_stays_in_the_box_and_ends_where_it_began(machine, task):
    other = replace(machine, **task)
    poses = module.course(other, 2001).poses
    half = np.array([other.xy, other.xy, other.z, other.tilt, other.tilt, other.spin])
    assert (np.abs(poses) <= half + 1e-12).all()
    np.testing.assert_allclose(poses[0], poses[-1], atol=1e-12)


def test_twists_are_the_course_s_differences(machine):
    course = module.course(machine, 8001)
    times = np.linspace(0.0, course.duration, 8001)
    frames = module.frames(machine, course.poses)
    step = times[2] - times[0]
    turned = Rotation.from_matrix(frames[2:, :, :3] @ np.swapaxes(frames[:-2, :, :3], 1, 2))
    moved = frames[2:, :, 3] - frames[:-2, :, 3]
    found = np.concatenate([turned.as_rotvec(), moved], axis=1) / step
    np.testing.assert_allclose(found, course.twists[1:-1], atol=2e-5)


def test_the_tool_is_square_to_a_tilted_plane_and_fed_at_50_mm_s(machine):
    course = module.course(machine, 4001)
    cuts = module.engraves(machine, course.poses)
    assert 0.6 < cuts.mean() < 0.8
    frames = module.frames(machine, course.poses[cuts])
    normal = frames[0, :, 2]
    assert np.degrees(np.arccos(normal[2])) == pytest.approx(8.0)
    np.testing.assert_allclose(frames[..., 2], np.tile(normal, (len(frames), 1)), atol=1e-12)
    np.testing.assert_allclose((frames[..., 3] - frames[0, :, 3]) @ normal, 0.0, atol=1e-9)
    speed = np.linalg.norm(course.twists[cuts, 3:], axis=1)
    assert speed.max() == pytest.approx(0.05, rel=1e-6)
    assert (speed > 0.049999).mean() > 0.6
    np.testing.assert_allclose(course.twists[cuts, :3], 0.0, atol=1e-12)


def test_it_is_a_spiral_of_three_turns(machine):
    course, flat = module.course(machine, 4001), plane(machine)
    cuts = module.engraves(machine, course.poses)
    points = (course.poses[cuts, :3] - flat.middle) @ flat.axes
    radius = np.linalg.norm(points[:, :2], axis=1)
    angle = np.unwrap(np.arctan2(points[1:, 1], points[1:, 0]))  # at the middle there is none
    assert radius[-1] == pytest.approx(0.04)
    assert angle[-1] == pytest.approx(6.0 * np.pi, abs=1e-6)
    np.testing.assert_allclose(radius[1:], 0.04 * angle / angle[-1], atol=1e-9)
    walked = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert walked == pytest.approx(flat.along, rel=1e-4)


def test_a_servo_follows_within_a_tenth_of_a_millimetre():
    env = gym.make("PKM/PUS6Motion-v0").unwrapped
    done = run(env, servo, seed=0)
    assert done.reason == "finished"
    assert done.errors.max() < 1e-4


# How it is drawn ----------------------------------------------------------------------------------


def test_a_movie_shows_the_line_grow(machine, monkeypatch):
    shown = []
    monkeypatch.setattr(camera.Camera, "shot", lambda _, __, lines: shown.append(lines))
    list(camera.movie(machine, camera.Camera(), 20))
    lengths = np.array([len(line) for (line,) in shown])
    assert lengths[0] == 0
    assert (np.diff(lengths) >= 0).all()
    assert (np.diff(lengths) > 0).sum() > 10
    flat, (whole,) = plane(machine), shown[-1]
    np.testing.assert_allclose((whole - flat.middle) @ flat.axes[:, 2], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(whole[-1] - flat.middle), flat.radius, rtol=2e-2)


def test_nothing_is_engraved_by_machines_that_do_not_say_so(monkeypatch):
    problem = pkm_gym.make_problem("diamond")
    shown = []
    monkeypatch.setattr(camera.Camera, "shot", lambda _, __, lines: shown.append(lines))
    list(camera.movie(problem.mechanism(problem.printed_design()), camera.Camera(), 4))
    assert [len(line) for (line,) in shown] == [0] * 4


def test_the_screws_stand_where_the_paper_has_them():
    azimuths = np.degrees(np.arctan2(columns()[:, 1, 0], columns()[:, 0, 0])) % 360.0
    np.testing.assert_allclose(azimuths, [90.0, 90.0, 210.0, 210.0, 330.0, 330.0])
    for axes in columns():
        np.testing.assert_allclose(axes.T @ axes, np.eye(3), atol=1e-15)
        assert np.linalg.det(axes) == pytest.approx(1.0)


def test_only_the_tool_s_tip_touches_the_plate_and_only_what_is_joined_meets(machine):
    twin = Twin(machine, machine.sample_poses()[0])
    model = twin.model
    bodies = [model.body(body).name for body in model.geom_bodyid]
    pairs = [
        (one, other)
        for one in range(model.ngeom)
        for other in range(one)
        if not _may_meet(*sorted((bodies[one], bodies[other])))
    ]
    assert len(pairs) > 1000
    for coordinates in twin.coordinates(module.course(machine, 25).poses):
        twin.place(coordinates)
        for one, other in pairs:
            apart = mujoco.mj_geomDistance(model, twin.data, one, other, 0.01, None)
            tip = {bodies[one], bodies[other]} == {"machine", "platform"}
            assert apart > (-1e-6 if tip else 1e-3), (bodies[one], bodies[other])


def _may_meet(one, other):
    """Whether two bodies are one, fixed to one another, or joined."""
    fixed = ("world", "machine", "column_1", "column_2", "column_3")
    if one == other or "world" in (one, other) or (one in fixed and other in fixed):
        return True
    if one == "platform":
        return other.startswith("rod")
    leg = other[-1]
    if one == f"column_{(int(leg) + 1) // 2}" if leg.isdigit() else False:
        return True
    return one[-1] == leg and one.startswith("rod")
