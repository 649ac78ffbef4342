"""Dexterity and transmission, against numpy's inverses and singular values."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from .conftest import BEST, PAPER, Pair, made

NAMES = ("K_v", "K_w", "K_lambda", "K_eta")


def test_the_indices_are_the_models(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 40):
        found = both.machine.local_indices(pose)
        expected = both.model.local(pose)
        np.testing.assert_allclose([found[name] for name in NAMES], expected, rtol=1e-9, atol=1e-11)


def test_transmission_of_each_limb(both: Pair, rng: np.random.Generator) -> None:
    poses = both.poses(rng, 20)
    found, local = both.machine.transmission(poses), both.machine.local_indices(poses)
    np.testing.assert_allclose(found[..., 0].min(axis=-1), local["K_lambda"], atol=1e-15)
    np.testing.assert_allclose(found[..., 1].min(axis=-1), local["K_eta"], atol=1e-12)
    assert (found > 0.0).all()
    assert (found <= 1.0).all()


def test_ellipsoids(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 5):
        linear, angular = both.machine.ellipsoids(pose)
        found = both.machine.local_indices(pose)
        assert found["K_v"] == pytest.approx(linear[2] / linear[0], rel=1e-9)
        assert found["K_w"] == pytest.approx(angular[1] / angular[0], rel=1e-9)


def test_tilt_rates_are_as_good_as_omega_where_alpha_is_zero(rng: np.random.Generator) -> None:
    """K_w of (gamma', beta') is that of the 3-D omega; of its x and y alone it isn't."""
    one = made(PAPER, False)
    apart = []
    for pose in one.poses(rng, 40):
        J = one.machine.jacobian(pose)
        omega = np.linalg.svd(J[:3], compute_uv=False)
        assert one.machine.local_indices(pose)["K_w"] == pytest.approx(
            omega[1] / omega[0], rel=1e-9
        )
        flat = np.linalg.svd(J[:2], compute_uv=False)
        apart.append(abs(flat[1] / flat[0] - omega[1] / omega[0]))
    assert max(apart) > 0.01


def test_units_of_length_do_not_matter(rng: np.random.Generator) -> None:
    one = made(BEST, True)
    larger = made({**BEST, **{name: 10.0 * BEST[name] for name in ("r", "R", "L")}}, True)
    poses = one.poses(rng, 20)
    scaled = poses * np.array([10.0, 10.0, 10.0, 1.0, 1.0])
    for name in NAMES:
        np.testing.assert_allclose(
            larger.machine.local_indices(scaled)[name], one.machine.local_indices(poses)[name],
            rtol=1e-11,
        )  # fmt: skip


def test_indices_at_a_pose_next_to_rank_loss() -> None:
    """A closed form of the eigenvalues errs by 3e-5 there; the singular values don't."""
    one = made(PAPER, False)
    for away in (1e-2, 1e-3, 1e-4):
        pose = one.machine.home + away * np.array([0.3, 0.2, 0.0, 0.1, -0.2])
        found, expected = one.machine.local_indices(pose), one.model.local(pose)
        np.testing.assert_allclose([found[n] for n in NAMES], expected, rtol=1e-5, atol=1e-9)


def test_clearances_by_bounded_least_squares(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 4):
        rods, rails = both.model.lines(pose), both.machine.rails()
        upu = np.array([np.zeros(3), pose[:3]])
        pairs = [
            [(rods[i], rods[j]) for i in range(5) for j in range(i)],
            [(rods[i], rails[j]) for i in range(5) for j in range(5) if i != j],
            [(rods[i], upu) for i in range(5)],
        ]
        expected = [min(apart(a, b) for a, b in some) for some in pairs]
        np.testing.assert_allclose(both.machine.clearances(pose), expected, rtol=1e-6, atol=1e-8)


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """The distance of two segments (2, 3)."""
    u, v = a[1] - a[0], b[1] - b[0]
    found = lsq_linear(np.stack([u, -v], axis=-1), b[0] - a[0], (0.0, 1.0), tol=1e-14)
    return float(np.sqrt(2.0 * found.cost))


def test_swing_is_an_angle_of_the_joints(both: Pair, rng: np.random.Generator) -> None:
    centre = both.machine.in_box(np.zeros(5))
    for pose in both.poses(rng, 10):
        f, f0 = both.model.rods(pose), both.model.rods(centre)
        base = np.arccos(np.clip((f * f0).sum(axis=1), -1, 1))
        turned = np.arccos(np.clip(((f @ both.model.rotation(pose)) * f0).sum(axis=1), -1, 1))
        np.testing.assert_allclose(both.machine.swings(pose), np.maximum(base, turned), atol=1e-7)
