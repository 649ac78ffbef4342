"""Where the 6-PUS stands: geometry, sliders of poses and poses of sliders, symmetries."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pkm_gym.mechanisms.pus6.mechanism import Pus6

from .conftest import Pair, pair
from .model import lattice

GOLDEN = np.array([0.03, -0.02, 0.015, 0.2, -0.1, 0.15])


def test_the_golden_pose(printed: Pair) -> None:
    q = 100.0 * printed.machine.inverse_kinematics(GOLDEN)
    known = [5.02142519, -0.40603332, 0.8685449, -6.7788048, 2.05927297, 5.42509069]
    np.testing.assert_allclose(q, known, rtol=0.0, atol=6e-9)


@pytest.mark.parametrize(
    ("L", "R", "drop"), [(45, 10, 32.923374), (46, 19, 38.165459), (55, 20, 48.855881)]
)
def test_known_drops_at_home(L: float, R: float, drop: float) -> None:
    one = pair(0.01 * L, 0.01 * R)
    assert 100.0 * one.machine.h0 == pytest.approx(drop, abs=6e-7)
    assert one.machine.home == pytest.approx(one.model.home, rel=1e-15)


def test_screws_and_joints_stand_where_the_paper_puts_them(printed: Pair) -> None:
    at = printed.machine.points(np.zeros(6))
    azimuths = {name: np.degrees(np.arctan2(p[:, 1], p[:, 0])) % 360.0 for name, p in at.items()}
    screws, joints = [82.5, 97.5, 202.5, 217.5, 322.5, 337.5], [45, 135, 165, 255, 285, 15]
    np.testing.assert_allclose(azimuths["A"], screws, atol=1e-12)
    np.testing.assert_allclose(azimuths["C"], joints, atol=1e-12)
    assert np.trunc(screws).astype(int).tolist() == [82, 97, 202, 217, 322, 337]  # as printed
    np.testing.assert_allclose(np.linalg.norm(at["A"][:, :2], axis=1), 0.38, rtol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(at["C"][:, :2], axis=1), 0.19, rtol=1e-15)


def test_rods_hang_from_the_sliders_and_keep_their_length(
    pairs: list[Pair], rng: np.random.Generator
) -> None:
    for one in pairs:
        poses = one.poses(rng, 200)
        at = one.machine.points(poses)
        rods = at["C"] - at["A"]
        np.testing.assert_allclose(np.linalg.norm(rods, axis=-1), one.model.L, rtol=1e-14)
        assert (rods[..., 2] < 0.0).all()
        screws = np.broadcast_to(one.model.screws[:, :2], rods[..., :2].shape)
        np.testing.assert_allclose(at["A"][..., :2], screws, rtol=0.0, atol=1e-15)
        turned = np.einsum("nij,kj->nki", one.machine.rotation(poses), one.model.joints)
        np.testing.assert_allclose(at["C"], poses[:, None, :3] + turned, rtol=0.0, atol=1e-15)


def test_the_platform_turns_about_its_own_axes_in_turn(printed: Pair) -> None:
    alpha, beta, gamma = GOLDEN[3:]
    about = [np.cos([alpha, beta, gamma]), np.sin([alpha, beta, gamma])]
    (ca, cb, cg), (sa, sb, sg) = about
    x = np.array([[1, 0, 0], [0, ca, -sa], [0, sa, ca]])
    y = np.array([[cb, 0, sb], [0, 1, 0], [-sb, 0, cb]])
    z = np.array([[cg, -sg, 0], [sg, cg, 0], [0, 0, 1]])
    np.testing.assert_allclose(printed.machine.rotation(GOLDEN), x @ y @ z, rtol=0.0, atol=1e-15)


def test_sliders_are_those_of_the_model(pairs: list[Pair], rng: np.random.Generator) -> None:
    out = 0
    for one in pairs:
        poses = np.concatenate([one.poses(rng, 200), one.poses(rng, 200, 6.0)])
        expected = one.model.sliders(poses)
        reached = np.isfinite(expected).all(axis=1)
        out += int((~reached).sum())
        found = one.machine.inverse_kinematics(poses)
        np.testing.assert_allclose(found[reached], expected[reached], rtol=0.0, atol=1e-14)
        assert np.isnan(found[~reached]).all()
    assert out > 300


def test_all_sliders_stand_at_zero_at_home(pairs: list[Pair]) -> None:
    for one in pairs:
        np.testing.assert_allclose(one.machine.inverse_kinematics(np.zeros(6)), 0.0, atol=2e-16)


def test_z_moves_all_sliders_alike(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs:
        poses = one.poses(rng, 50)
        lifted = poses + 0.07 * np.eye(6)[2]
        moved = one.machine.inverse_kinematics(lifted) - one.machine.inverse_kinematics(poses)
        np.testing.assert_allclose(moved, 0.07, rtol=0.0, atol=1e-15)
        for verb in (one.machine.jacobian, one.machine.hessian):
            np.testing.assert_array_equal(verb(lifted), verb(poses))


def test_the_mirror_image_exchanges_legs(pairs: list[Pair], rng: np.random.Generator) -> None:
    (mirror,) = pairs[0].machine.symmetries()
    for one in pairs:
        poses = one.poses(rng, 50)
        found = one.model.sliders(mirror.pose(poses))
        expected = mirror.joints(one.model.sliders(poses))
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-15)


def test_a_third_of_a_turn_passes_the_legs_on(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs:
        poses = one.poses(rng, 50)
        found = one.machine.inverse_kinematics(turned_by_a_third(poses))
        expected = np.roll(one.machine.inverse_kinematics(poses), 2, axis=1)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-14)


def turned_by_a_third(poses: np.ndarray) -> np.ndarray:
    """The poses (n, 6) of a machine that is turned by 120 deg about its axis."""
    turn = Rotation.from_euler("z", 120.0, degrees=True)
    angles = (turn * Rotation.from_euler("XYZ", poses[:, 3:]) * turn.inv()).as_euler("XYZ")
    return np.concatenate([turn.apply(poses[:, :3]), angles], axis=1)


def test_forward_kinematics_from_home(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs:
        poses = one.poses(rng, 60)
        joints = one.machine.inverse_kinematics(poses)
        found = one.machine.forward_kinematics(joints)
        np.testing.assert_allclose(found, poses, rtol=0.0, atol=1e-10)
        near = one.machine.forward_kinematics(joints, near=poses[::-1])
        np.testing.assert_allclose(near, poses, rtol=0.0, atol=1e-10)


def test_a_singularity_bars_the_way_from_home(printed: Pair) -> None:
    poses = lattice()[::97]
    poses = poses[np.isfinite(printed.model.sliders(poses)).all(axis=1)]
    side = printed.model.aspect(poses)
    joints = printed.machine.inverse_kinematics(poses)
    found = printed.machine.forward_kinematics(joints)
    came = np.isfinite(found).all(axis=1)
    assert (came & (side > 0.0)).sum() > 100
    # where it came it stands on the home side, with the same sliders
    assert (printed.model.aspect(found[came]) > 0.0).all()
    np.testing.assert_allclose(printed.model.sliders(found[came]), joints[came], atol=1e-13)
    beyond = side < 0.0
    assert beyond.sum() > 30
    across = np.abs(found[beyond] - poses[beyond]).max(axis=1)
    assert not (across < 1e-6).any()  # NaN, or another pose of the same sliders
    near = printed.machine.forward_kinematics(joints[beyond], near=poses[beyond])
    np.testing.assert_allclose(near, poses[beyond], rtol=0.0, atol=1e-10)


def test_sliders_that_no_pose_has(printed: Pair) -> None:
    far = np.array([0.3, -0.3, 0.3, -0.3, 0.3, -0.3])
    poses = printed.machine.forward_kinematics(np.stack([far, 0.0 * far, far * np.nan]))
    assert np.isnan(poses[[0, 2]]).all()
    np.testing.assert_allclose(poses[1], 0.0, atol=1e-14)


def test_rods_that_are_too_short_reach_nothing(printed: Pair) -> None:
    short = replace(printed.machine, L=0.2)
    assert np.isnan(short.h0)
    assert np.isnan(short.inverse_kinematics(np.zeros((3, 6)))).all()
    assert np.isnan(short.jacobian(np.zeros(6))).any()


def test_impossible_angles_are_refused() -> None:
    for angle in (0.0, np.radians(120.0)):
        with pytest.raises(ValueError, match=r"phi_C is .* must be finite and greater than 0 and"):
            Pus6(L=0.46, R=0.19, phi_C=float(angle))
