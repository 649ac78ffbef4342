"""Influence coefficients of both orders against 6x6 matrices, limb screws and differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from .conftest import Pair
from .model import turned
from .test_positions import GOLDEN

CONVENTIONS = ("influence", "symmetric")


def slope(function: Callable[[float], np.ndarray], h: float = 1e-3) -> np.ndarray:
    """Derivative at 0 by central differences of sixth order."""
    one, two, three = (function(k * h) - function(-k * h) for k in (1, 2, 3))
    return (1.5 * one - 0.3 * two + three / 30.0) / (2.0 * h)


def assert_near(found: np.ndarray, expected: np.ndarray, share: float) -> None:
    """Each matrix to a share of its largest number."""
    scale = np.abs(expected).max(axis=(-1, -2), keepdims=True)
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0.0, atol=share)


# First order --------------------------------------------------------------------------------------


def test_the_golden_pose(printed: Pair) -> None:
    row = 0.01 * printed.machine.jacobian(GOLDEN)[0]  # rad/cm
    known = [0.0095941, 0.0028281, 0.00984818, -0.01346096, -0.02517635, 0.01636693]
    np.testing.assert_allclose(row, known, rtol=0.0, atol=6e-9)
    H = printed.machine.hessian(GOLDEN)
    norms = np.linalg.norm(H, axis=(1, 2)) * np.repeat([1e-4, 1e-2], 3)  # rad/cm^2 and 1/cm
    known = [0.00246158, 0.00261245, 0.00104537, 0.03028033, 0.02170333, 0.04656865]
    np.testing.assert_allclose(norms, known, rtol=0.0, atol=6e-9)


def test_first_order_is_that_of_rods_of_constant_length(
    pairs: list[Pair], rng: np.random.Generator
) -> None:
    for one in pairs:
        poses = one.poses(rng, 100)
        assert_near(one.machine.inverse_jacobian(poses), one.model.inverse(poses), 1e-14)
        assert_near(one.machine.jacobian(poses), one.model.first(poses), 1e-11)


def test_first_order_by_differences(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs:
        pose, twist = one.poses(rng, 1)[0], rng.normal(size=6)

        def moved(t: float, pose: np.ndarray = pose, twist: np.ndarray = twist) -> np.ndarray:
            turn = Rotation.from_rotvec(t * twist[:3]) * Rotation.from_euler("XYZ", pose[3:])
            return np.concatenate([pose[:3] + t * twist[3:], turn.as_euler("XYZ")])

        rates = slope(lambda t, one=one, at=moved: one.machine.inverse_kinematics(at(t)), 2e-4)
        expected = one.machine.inverse_jacobian(pose) @ twist
        np.testing.assert_allclose(rates, expected, rtol=0.0, atol=1e-10)
        pose_rate = slope(moved)
        np.testing.assert_allclose(one.machine.twist(pose, pose_rate), twist, atol=1e-9)


def test_all_sliders_alike_lift_the_platform(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs:
        poses, alike = one.poses(rng, 20), np.ones(6)
        lift = np.broadcast_to([0.0, 0.0, 0.0, 0.0, 0.0, 1.0], poses.shape)
        np.testing.assert_allclose(one.machine.jacobian(poses) @ alike, lift, atol=1e-11)
        for convention in CONVENTIONS:
            H = one.machine.hessian(poses, convention)
            scale = np.abs(H).max(axis=(-1, -2))[..., None]
            np.testing.assert_allclose(H @ alike / scale, 0.0, atol=1e-14)
            np.testing.assert_allclose(alike @ H / scale, 0.0, atol=1e-14)


def test_sliders_do_the_work_of_the_wrench(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs:
        poses = one.poses(rng, 50)
        wrench, twist = rng.normal(size=(2, 50, 6))
        tau = one.machine.slider_forces(poses, wrench)
        rates = np.einsum("nij,nj->ni", one.model.inverse(poses), twist)
        work, scale = (tau * rates).sum(axis=1), np.abs(tau * rates).sum(axis=1)
        np.testing.assert_allclose(work / scale, (wrench * twist).sum(axis=1) / scale, atol=1e-13)
        back = np.einsum("nij,nj->ni", one.machine.force_matrix(poses), tau)
        np.testing.assert_allclose(back, wrench, rtol=0.0, atol=1e-10)


def test_the_weight_of_the_platform_is_shared_alike_at_home(printed: Pair) -> None:
    lifted = printed.machine.slider_forces(np.zeros(6), np.array([0.0, 0, 0, 0, 0, -9.81]))
    np.testing.assert_allclose(lifted, -9.81 / 6.0, rtol=1e-13)


# Second order -------------------------------------------------------------------------------------


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_second_order_is_that_of_rods_of_constant_length(
    pairs: list[Pair], rng: np.random.Generator, convention: str
) -> None:
    for one in pairs:
        poses = one.poses(rng, 50)
        expected = one.model.second(poses, convention)
        assert_near(one.machine.hessian(poses, convention), expected, 1e-11)


def test_screws_of_the_limbs_give_the_influence_convention(
    pairs: list[Pair], rng: np.random.Generator
) -> None:
    for one in pairs:
        pose = one.poses(rng, 1)[0]
        for _ in range(2):  # whatever the axes of the U and S joints are
            G, H = one.model.by_screws(pose, rng)
            assert_near(one.machine.jacobian(pose), G, 1e-11)
            assert_near(one.machine.hessian(pose), H, 1e-10)


def test_the_conventions_differ_by_a_part_that_does_no_work(
    pairs: list[Pair], rng: np.random.Generator
) -> None:
    for one in pairs:
        poses = one.poses(rng, 50)
        influence, symmetric = (one.machine.hessian(poses, name) for name in CONVENTIONS)
        transposed = np.swapaxes(influence, -1, -2)
        np.testing.assert_allclose(symmetric, np.swapaxes(symmetric, -1, -2), rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(0.5 * (influence + transposed), symmetric, rtol=1e-9, atol=1e-9)
        skew = influence - symmetric
        np.testing.assert_allclose(skew[:, 3:], 0.0, atol=1e-12)
        first, second = rng.normal(size=(2, 50, 6))  # two rates: half of omega_1 x omega_2
        G_w = one.model.first(poses)[:, :3]
        omegas = (np.einsum("nij,nj->ni", G_w, rates) for rates in (first, second))
        found = np.einsum("ni,nkij,nj->nk", first, skew[:, :3], second)
        np.testing.assert_allclose(found, 0.5 * np.cross(*omegas), rtol=1e-8, atol=1e-8)
        assert np.abs(skew[:, :3]).max() > 0.01 * np.abs(symmetric[:, :3]).max()


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_second_order_by_differences_along_motions(
    pairs: list[Pair], rng: np.random.Generator, convention: str
) -> None:
    for one in pairs[::3]:
        pose, rate, change = one.poses(rng, 1)[0], *rng.normal(size=(2, 6))

        def at(t: float, motion: tuple = (pose, rate, change)) -> np.ndarray:
            return motion[0] + t * motion[1] + 0.5 * t * t * motion[2]

        def twist(t: float, at: Callable = at) -> np.ndarray:
            frame = turned(at(t)[None])[0]
            spin = slope(lambda s: turned(at(t + s)[None])[0]) @ frame.T
            return np.concatenate(
                [[spin[2, 1], spin[0, 2], spin[1, 0]], slope(lambda s: at(t + s)[:3])]
            )

        def rates(t: float, one: Pair = one, at: Callable = at) -> np.ndarray:
            return slope(lambda s: one.machine.inverse_kinematics(at(t + s)))

        q, forced = rates(0.0), one.machine.jacobian(pose) @ slope(rates)
        found = forced + np.einsum("i,kij,j->k", q, one.machine.hessian(pose, convention), q)
        scale = np.abs(forced).max() + np.abs(found).max()
        np.testing.assert_allclose(found / scale, slope(twist) / scale, rtol=0.0, atol=1e-6)


def test_an_unknown_convention_is_refused(printed: Pair) -> None:
    with pytest.raises(ValueError, match="influence"):
        printed.machine.hessian(GOLDEN, "influenza")
