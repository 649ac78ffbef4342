"""The paper's layout is singular at home, whatever its dimensions; a skew one is not."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

from .conftest import BEST, FIVE, GOOD, PAPER, Pair, made
from .model import Model


def test_home_has_rank_four(rng: np.random.Generator) -> None:
    for _ in range(40):
        r, R = np.sort(rng.uniform(0.1, 0.9, 2))
        machine = Pss5Upu(r=r, R=R, L=rng.uniform(0.3, 1.2), theta=rng.uniform(0.1, 1.2),
                          lam0=rng.uniform(0.4, 0.95), upu=float(rng.integers(2)))  # fmt: skip
        assert machine.rank(machine.home) == 4.0
        found = machine.local_indices(machine.home)
        assert (found["K_v"], found["K_w"], found["K_eta"]) == (0.0, 0.0, 0.0)
        assert found["K_lambda"] == pytest.approx(machine.lam0, abs=1e-12)


@pytest.mark.parametrize("upu", [False, True])
def test_at_home_there_is_no_jacobian(upu: bool, rng: np.random.Generator) -> None:
    machine = made(PAPER, upu).machine
    poses = np.stack([machine.home, machine.in_box(rng.uniform(0.2, 1.0, 5))])
    assert np.isinf(machine.jacobian(poses)).all(axis=(1, 2)).tolist() == [True, False]
    assert np.isinf(machine.rate_jacobian(poses)).all(axis=(1, 2)).tolist() == [True, False]
    assert np.isinf(machine.vertical_force(poses)).tolist() == [True, False]
    assert np.isfinite(machine.jacobian(poses[1])).all()
    lam, eta = np.moveaxis(machine.transmission(poses), -1, 0)
    np.testing.assert_allclose(lam[0], machine.lam0, atol=1e-12)
    assert (eta[0] == 0.0).all()
    assert (eta[1] > 0.0).all()
    pushed = machine.slider_forces(poses, np.ones(6))
    assert np.isnan(pushed).all(axis=1).tolist() == [True, False]
    assert all(np.isnan(axes[0]).all() for axes in machine.ellipsoids(poses))


def test_out_of_reach_they_are_not_numbers() -> None:
    machine = made(PAPER, True).machine
    far = machine.home + np.array([0.0, 0.0, 5.0, 0.0, 0.0])
    for found in (machine.jacobian(far), machine.transmission(far), machine.vertical_force(far)):
        assert np.isnan(found).all()


def test_five_equal_limbs_in_five_fold_symmetry_never_span_more_than_rank_four(
    rng: np.random.Generator,
) -> None:
    """The theorem: any wrench turned by fifths has rank three; the UPU limb adds one."""
    for _ in range(500):
        force, arm = rng.normal(size=(2, 3))  # rails twisted, rods anywhere
        wrench = np.concatenate([force, np.cross(arm, force)])
        rows = []
        for turn in np.radians(FIVE):
            c, s = np.cos(turn), np.sin(turn)
            R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
            rows.append(np.concatenate([R @ wrench[:3], R @ wrench[3:]]))
        values = np.linalg.svd(np.array(rows), compute_uv=False)
        assert values[3] < 1e-14 * values[0]
        held = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
        values = np.linalg.svd(np.array([*rows, held]), compute_uv=False)
        assert values[4] < 1e-14 * values[0]


@pytest.mark.parametrize("of", [BEST, GOOD])
@pytest.mark.parametrize("upu", [False, True])
def test_a_skew_layout_has_full_rank(of: dict, upu: bool) -> None:
    machine = made(of, upu).machine
    assert machine.rank(machine.home) == 6.0
    assert machine.rcond(machine.home) > 0.1


def test_the_rods_meet_in_a_point_of_the_axis() -> None:
    one = made(PAPER, False)
    ends = one.model.lines(one.machine.home)
    along = ends[:, 1] - ends[:, 0]
    at = -ends[:, 0, 0] / along[:, 0]
    points = ends[:, 0] + at[:, None] * along
    np.testing.assert_allclose(points, points[:1] * np.ones((5, 1)), atol=1e-12)
    np.testing.assert_allclose(points[:, :2], 0.0, atol=1e-12)


def test_singular_values_of_the_rods_at_home() -> None:
    """The page's: 2.056, 1.581, 1.581, 0, 0."""
    system = made(PAPER, False).machine
    values = np.linalg.svd(system.system(system.home)[:5], compute_uv=False)
    np.testing.assert_allclose(values, [2.056, 1.581, 1.581, 0.0, 0.0], atol=5e-4)


def test_the_determinant_keeps_its_sign_around_home(rng: np.random.Generator) -> None:
    """det is flat in two directions and never negative: no check of signs finds the singularity."""
    machine = made(PAPER, False).machine
    poses = machine.in_box(0.02 * rng.uniform(-1.0, 1.0, (400, 5)))
    det = np.linalg.det(machine.system(poses))
    assert (det > 0.0).all() or (det < 0.0).all()


def test_rank_and_condition_are_the_models(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 30):
        values = both.model.singular_values(pose)
        assert both.machine.rcond(pose) == pytest.approx(values[5] / values[0], rel=1e-9)


def test_every_evaluation_says_so() -> None:
    problem = pkm_gym.make_problem("pss5_upu")
    evaluation = problem.evaluate(np.array([[1.4, 1.0]]))
    assert evaluation.notes == ("singular at the home pose: rank 4 of 6",)
    assert pkm_gym.make_problem("pss5_upu_skew").evaluate(np.ones((1, 8))).notes == ()


def test_a_model_without_the_theorem_is_not_fooled() -> None:
    """The second model's own inverse fails at home, as it must."""
    lengths = {name: PAPER[name] for name in ("r", "R", "L")}
    model = Model(**lengths, theta=30.0, q=FIVE, b=FIVE, upu=True)
    home = made(PAPER, True).machine.home
    assert model.singular_values(home)[4] < 1e-14
