"""The 5-PSS/UPU's twin: its freedom and yaw, its modes, its path, its looks, a push at home."""

from __future__ import annotations

from dataclasses import replace

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import pkm_gym
from pkm_gym.envs.baselines import run, servo
from pkm_gym.mechanisms.pss5_upu import twin as module
from pkm_gym.mechanisms.pss5_upu.free_motion import free_motion, pushed
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu
from pkm_gym.twin.check import check
from pkm_gym.twin.model import Twin
from pkm_gym.twin.rig import Rig

DEG = np.pi / 180.0
GOOD = {
    "r": 0.290, "R": 0.595, "L": 0.615, "theta": 56 * DEG, "lam0": 0.97, "a2": -52 * DEG,
    "a3": -2 * DEG, "b2": 28 * DEG, "b3": 26 * DEG,
}  # fmt: skip


@pytest.fixture(scope="module")
def machine():
    problem = pkm_gym.make_problem("pss5_upu_skew")
    return problem.mechanism(problem.printed_design())


@pytest.fixture(scope="module")
def paper():
    """The paper's layout, with the yaw that it has in the paper: none."""
    problem = pkm_gym.make_problem("pss5_upu")
    return problem.mechanism(problem.printed_design())


@pytest.fixture
def twin(machine):
    return Twin(machine, machine.sample_poses()[1])


def broken(rows):
    return [row.quantity for row in rows if not row.holds]


# The model ----------------------------------------------------------------------------------------


def test_the_machine_is_the_rounded_design_in_mm_and_degrees(machine):
    azimuths = [
        np.degrees(np.arctan2(rows[1], rows[0]))
        for rows in machine.layout.reshape(5, 7)[:, [[0, 1], [2, 3]]].transpose(1, 2, 0)
    ]
    assert (machine.r, machine.R, machine.L) == pytest.approx((0.358, 0.633, 0.509))
    assert (machine.theta, machine.lam0) == pytest.approx((56.2 * DEG, 0.97))
    np.testing.assert_allclose(azimuths[0], [0, 77, 170, -170, -77], atol=1e-9)
    np.testing.assert_allclose(azimuths[1], [0, 114, 134, -134, -114], atol=1e-9)


def test_it_has_25_coordinates_and_15_independent_loop_equations(twin):
    rows = []
    for ends in twin.loops:
        one, other = np.zeros((2, 3, twin.model.nv))
        mujoco.mj_jacSite(twin.model, twin.data, one, None, ends[0])
        mujoco.mj_jacSite(twin.model, twin.data, other, None, ends[1])
        rows.append(one - other)
    loops = np.concatenate(rows)
    assert loops.shape == (15, 25)
    assert np.linalg.svd(loops, compute_uv=False).min() > 0.05


def test_what_it_does_freely_is_to_spin_its_rods(twin):
    """A spin moves no point of the platform, and the damping of its joint stops it."""
    model, data = twin.model, twin.data
    spins = [model.joint(f"s_{i}").dofadr[0] + 2 for i in range(1, 6)]
    model.opt.gravity[:] = 0.0
    data.qvel[spins] = 1.0
    before = twin.frame
    mujoco.mj_step(model, data, 200)
    np.testing.assert_allclose(twin.frame, before, atol=1e-9)
    assert np.abs(data.qvel[spins]).max() < 1e-3


def test_the_limb_gives_the_yaw_of_a_upu(machine, twin, rng):
    """Whatever its joints do: the chain is MuJoCo's, the rods are left out."""
    model, data = twin.model, twin.data
    for _ in range(20):
        angles = rng.uniform(-0.5, 0.5, 4)
        for name, value in zip(("tilt", "lean", "nod", "roll"), angles, strict=True):
            data.qpos[model.joint(f"upu_{name}").qposadr[0]] = value
        data.qpos[model.joint("upu_length").qposadr[0]] = rng.uniform(0.4, 0.9)
        mujoco.mj_kinematics(model, data)
        axes, centre = twin.frame[:, :3], twin.frame[:, 3]
        alpha, beta = Rotation.from_matrix(axes).as_euler("ZYX")[:2]
        assert np.sin(alpha) == pytest.approx(-centre[1] / centre[2] * np.tan(beta), abs=1e-12)
        found = module.pose(machine, twin.frame)
        np.testing.assert_allclose(module.frames(machine, found[None])[0], twin.frame, atol=1e-12)


def test_other_layouts_and_sizes_agree(machine):
    twice = {name: 2.0 * getattr(machine, name) for name in ("r", "R", "L", "x", "y", "z")}
    aside = {"x0": 0.03, "y": 0.04, "gamma": 12 * DEG}
    for changes in (GOOD, twice, aside):
        other = replace(machine, **changes)
        poses = module.draw_poses(other, 2, np.random.default_rng(1))[-4:]
        assert broken(check(other, poses)) == []


def test_a_machine_without_yaw_is_built_and_checked_with_it(machine):
    ideal = replace(machine, upu=0.0)
    pose = machine.in_box(np.array([0.2, 0.9, 0.0, 0.9, -0.5]))
    twin = Twin(ideal, pose)
    assert twin.mechanism == machine
    np.testing.assert_allclose(twin.frame, module.frames(machine, pose[None])[0], atol=1e-12)
    assert np.abs(twin.frame[:, :3] - ideal.rotation(pose)).max() > 0.02
    assert broken(check(ideal, pose[None])) == []


def test_rods_are_placed_without_a_spin(machine, rng):
    home, *poses = machine.in_box(rng.uniform(-1.0, 1.0, (9, 5)))
    values = module.coordinates(machine, np.array(poses), home)
    for i in range(1, 6):
        np.testing.assert_array_equal(values[f"s_{i}"][:, 3], 0.0)
        np.testing.assert_allclose(np.linalg.norm(values[f"s_{i}"], axis=1), 1.0)


# Its modes ----------------------------------------------------------------------------------------


def test_the_first_margin_changes_sign_at_a_direct_singularity(machine, rng):
    poses = machine.in_box(rng.uniform(-4.0, 4.0, (600, 5)))
    joints = machine.inverse_kinematics(poses)
    centre = np.linalg.det(machine.system(machine.in_box(np.zeros(5))))
    signs = []
    for pose, sliders in zip(poses, joints, strict=True):
        if np.isfinite(sliders).all():
            first, *cosines = module.margins(machine, pose, sliders)
            side = np.linalg.det(machine.system(pose)) / centre
            assert np.sign(first) == np.sign(side)
            np.testing.assert_allclose(cosines, machine.limbs(pose)[:, 6], atol=1e-12)
            signs.append(np.sign(side))
    assert len(signs) > 50
    assert min(signs) < 0.0 < max(signs)


def test_a_slider_in_front_of_its_rod_has_a_negative_margin(machine):
    pose = machine.sample_poses()[1]
    joints = machine.inverse_kinematics(pose)
    joints[3] += 2.0 * machine.L * machine.limbs(pose)[3, 6]  # the other root
    cosines = module.margins(machine, pose, joints)[1:]
    np.testing.assert_array_equal(cosines < 0.0, np.arange(5) == 3)


def test_the_paper_s_layout_is_in_no_mode_and_is_not_driven(paper):
    pose = paper.sample_poses()[0]
    assert module.margins(paper, pose, paper.real().inverse_kinematics(pose))[0] == 0.0
    with pytest.raises(ValueError, match="can't stand in its assembly mode"):
        Rig(paper)


# Its path -----------------------------------------------------------------------------------------


def test_the_course_goes_once_around_through_60_percent_of_the_box(machine):
    course = module.course(machine, 4001)
    shares = (course.poses - machine.in_box(np.zeros(5))) / (
        machine.x, machine.y, machine.z, machine.beta, machine.gamma
    )  # fmt: skip
    assert course.duration == 4.0
    np.testing.assert_allclose(shares.max(axis=0), 0.6, atol=1e-5)
    np.testing.assert_allclose(shares.min(axis=0), -0.6, atol=1e-5)
    np.testing.assert_allclose(course.poses[0], course.poses[-1], atol=1e-12)
    np.testing.assert_allclose(course.twists[[0, -1]], 0.0, atol=1e-12)
    spread = np.linalg.svd(shares, compute_uv=False)  # no coordinate follows from the others
    assert spread[-1] > 0.2 * spread[0]


def test_twists_are_the_course_s_differences(machine):
    course = module.course(machine, 8001)
    frames = module.frames(machine, course.poses)
    step = 2.0 * course.duration / 8000
    turned = Rotation.from_matrix(frames[2:, :, :3] @ np.swapaxes(frames[:-2, :, :3], 1, 2))
    moved = frames[2:, :, 3] - frames[:-2, :, 3]
    found = np.concatenate([turned.as_rotvec(), moved], axis=1) / step
    np.testing.assert_allclose(found, course.twists[1:-1], atol=2e-5)


def test_a_servo_follows_within_half_a_millimetre(machine):
    env = gym.make("PKM/PSS5UPUMotion-v0").unwrapped
    assert env.rig.twin.mechanism == machine
    done = run(env, servo, seed=0)
    assert done.reason == "finished"
    assert done.errors.max() < 5e-4


# How it is drawn ----------------------------------------------------------------------------------


def test_parts_weigh_what_they_are_drawn_as(machine, twin):
    """Rods of 18 mm, a frame of bars of 25 mm with a hub of 104 mm, screws of 11 mm, lead 10 mm."""
    rod = 7850.0 * np.pi * 0.009**2 * (machine.L + 4.0 / 3.0 * 0.009)
    assert twin.model.body("rod_3").mass[0] == pytest.approx(rod, rel=1e-9)
    joints = machine.layout.reshape(5, 7)[:, :2]
    ring = joints[np.argsort(np.arctan2(*joints.T[::-1]))]
    around = np.linalg.norm(ring - np.roll(ring, -1, axis=0), axis=1)
    spokes = np.hypot(np.linalg.norm(ring, axis=1) - 0.052, 0.05)
    bars = np.pi * 0.0125**2 * (around.sum() + spokes.sum() + 10 * 4.0 / 3.0 * 0.0125)
    frame = 2700.0 * (bars + np.pi * 0.052**2 * 0.02)
    assert twin.model.body("platform").mass[0] == pytest.approx(frame, rel=1e-9)
    ways = machine.inverse_kinematics(machine.search_poses())
    length = ways.max() - ways.min() + 0.14
    screw = 0.5 * 7850.0 * np.pi * 0.0055**4 * length * (2.0 * np.pi / 0.01) ** 2
    felt = [twin.model.dof_armature[twin.model.joint(f"l_{i}").dofadr[0]] for i in range(1, 6)]
    np.testing.assert_allclose(felt, screw, rtol=1e-9)


def test_only_what_is_joined_meets(machine):
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
            assert apart > 1e-3, (bodies[one], bodies[other])


def _may_meet(one, other):
    """Whether two bodies are one, fixed to one another, or joined."""
    fixed = ("machine", "rail", "world")
    limb = ("machine", "upu_leg", "upu_stem", "platform")
    if one == other or "world" in (one, other):
        return True
    if one.startswith(fixed) and other.startswith(fixed):
        return True
    if one in limb and other in limb:
        return abs(limb.index(one) - limb.index(other)) == 1
    if one == "platform":
        return other.startswith("rod")
    kinds = {one.rpartition("_")[0], other.rpartition("_")[0]}
    return one[-1] == other[-1] and kinds in ({"rod", "slider"}, {"rail", "slider"})


# A push at home -----------------------------------------------------------------------------------


def statics(machine, stiffness, force=100.0):
    """Where a force along x takes the platform, by the least energy of servos and force."""
    home = machine.home
    at_home = machine.inverse_kinematics(home)

    def energy(x):
        ways = machine.inverse_kinematics(home + 0.1 * x) - at_home
        stored = 0.5 * stiffness * (ways**2).sum() - force * 0.1 * x[0]
        return stored if np.isfinite(stored) else np.inf

    options = {"xatol": 1e-9, "fatol": 1e-13, "maxiter": 20_000, "maxfev": 20_000}
    start = np.array([0.3, 0.0, 0.0, 0.3, 0.0])
    for _ in range(4):
        start = minimize(energy, start, method="Nelder-Mead", options=options).x
    return home + 0.1 * start


@pytest.mark.parametrize(
    ("stiffness", "expected"), [(2e5, 0.123), (2e6, 0.064), (2e7, 0.031), (2e8, 0.015)]
)
def test_a_push_moves_the_paper_s_platform_whatever_the_servos(paper, stiffness, expected):
    found = free_motion(paper, [stiffness])
    assert found.displacements[0] == pytest.approx(expected, abs=6e-4)
    rest = statics(paper.real(), stiffness)
    moved = np.linalg.norm((rest - paper.home)[:3])
    assert found.displacements[0] == pytest.approx(moved, rel=5e-3)


def test_the_sliders_hardly_give_way(paper):
    found = free_motion(paper, [2e6])
    assert np.abs(found.deflections).max() == pytest.approx(0.70e-3, abs=1e-5)
    assert np.degrees(found.turns[0]) == pytest.approx(5.2, abs=0.1)


def test_a_layout_that_holds_gives_way_as_its_servos_do(machine):
    found = free_motion(machine, [2e6, 2e7])
    assert found.displacements[0] == pytest.approx(0.07e-3, abs=0.01e-3)
    assert found.displacements[0] / found.displacements[1] == pytest.approx(10.0, rel=0.01)
    compliance = machine.jacobian(machine.home) @ machine.jacobian(machine.home).T / 2e6
    expected = np.linalg.norm(100.0 * compliance[3:, 3])
    assert found.displacements[0] == pytest.approx(expected, rel=0.01)


def test_opposite_pushes_go_opposite_ways_and_none_goes_nowhere(paper):
    forces = np.array([0.0, 50.0, -50.0])
    centres = pushed(paper, forces).frames[..., 3] - paper.home[:3]
    np.testing.assert_allclose(centres[0], 0.0, atol=1e-9)
    assert centres[1, 0] > 0.02
    assert centres[2, 0] < -0.02


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"stiffnesses": []}, r"stiffnesses are \[\]: they must be finite and positive"),
        ({"stiffnesses": [2e6, -1.0]}, r"stiffnesses are \[2000000.0, -1.0\]"),
        ({"stiffnesses": [2e6], "force": np.nan}, r"force are \[nan\]"),
    ],
)
def test_bad_pushes_are_refused(paper, arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        free_motion(paper, **arguments)


def test_a_machine_that_is_not_assembled_at_home_is_refused():
    with pytest.raises(ValueError, match="out of the machine's reach"):
        free_motion(Pss5Upu(r=0.3, R=0.9, L=0.2, lam0=0.999, a2=1.2, b2=-1.2), [2e6])
