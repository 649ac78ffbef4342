"""Positions, velocities and forces of the 5-PSS/UPU, against limb screws and finite differences."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

from .conftest import GOOD, PAPER, Pair, made

GOLDEN = np.array([0.060, 0.025, 0.560, 0.10, -0.05])  # of the page, with row 1 of Table 5


@pytest.mark.parametrize(
    ("upu", "sliders"),
    [
        (False, [60.9484, 78.8684, 162.3003, 194.6948, 136.9531]),
        (True, [60.8770, 79.0112, 162.4703, 194.6481, 136.7547]),
    ],
)
def test_the_golden_pose(upu: bool, sliders: list[float]) -> None:
    machine = made(PAPER, upu).machine
    np.testing.assert_allclose(1e3 * machine.inverse_kinematics(GOLDEN), sliders, atol=5e-5)
    assert machine.alpha(GOLDEN) == pytest.approx(-0.00448 if upu else 0.0, abs=5e-6)


def test_the_golden_indices() -> None:
    found = made(PAPER, False).machine.local_indices(GOLDEN)
    expected = {"K_v": 0.04988, "K_w": 0.91467, "K_lambda": 0.81154, "K_eta": 0.14457}
    assert found == pytest.approx(expected, abs=5e-6)


def test_positions_are_the_models(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 30):
        machine, model = both.machine, both.model
        np.testing.assert_allclose(machine.rotation(pose), model.rotation(pose), atol=1e-12)
        np.testing.assert_allclose(
            machine.inverse_kinematics(pose), model.sliders(pose), atol=1e-12
        )
        at = machine.points(pose)
        np.testing.assert_allclose(
            np.stack([at["b"], at["a"]], axis=1), model.lines(pose), atol=1e-12
        )
        on_rail = at["b"] - at["B"]
        np.testing.assert_allclose(on_rail, model.sliders(pose)[:, None] * model.rails, atol=1e-12)


def test_the_rods_push_along_the_rails(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 30):
        assert (both.model.cosines(pose) > 0.0).all()
        limbs = both.machine.limbs(pose)
        np.testing.assert_allclose(limbs[:, 6], both.model.cosines(pose), atol=1e-12)


def test_jacobians_are_the_models(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 30):
        J, rates = both.model.jacobian(pose), both.model.rates(pose)
        turned = np.concatenate([J[3:], J[:3]])
        scale = np.abs(J).max()
        np.testing.assert_allclose(both.machine.jacobian(pose) / scale, turned / scale, atol=1e-10)
        found = both.machine.rate_jacobian(pose)
        np.testing.assert_allclose(found / scale, rates / scale, atol=1e-10)


def test_the_twist_keeps_what_the_upu_limb_holds(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 30):
        twist = both.machine.twist(pose, rng.normal(size=5))
        held = both.model.constraint(pose) @ np.concatenate([twist[3:], twist[:3]])
        assert abs(held) < 1e-12


def test_the_rates_are_those_of_the_pose(both: Pair, rng: np.random.Generator) -> None:
    step = 1e-6
    for pose in both.poses(rng, 10):
        J = both.machine.rate_jacobian(pose)
        rate = rng.normal(size=5)
        ends = [both.machine.inverse_kinematics(pose + s * step * rate) for s in (-1, 1)]
        sliders = (ends[1] - ends[0]) / (2.0 * step)
        x, y, z, beta, gamma = rate
        np.testing.assert_allclose(J @ sliders, [x, y, z, gamma, beta], rtol=1e-5, atol=1e-6)


def test_forces_do_the_work_of_the_wrench(both: Pair, rng: np.random.Generator) -> None:
    for pose in both.poses(rng, 20):
        wrench = rng.normal(size=6)  # moment, force
        force = both.machine.slider_forces(pose, wrench)
        # the limb screws in balance: [G; c]^T t = (force, moment), t_i f_i . e_i the slider's
        borne = np.linalg.solve(both.model.screws(pose).T, np.concatenate([wrench[3:], wrench[:3]]))
        expected = borne[:5] * both.model.cosines(pose)
        np.testing.assert_allclose(force, expected, rtol=1e-8, atol=1e-10 * np.abs(borne).max())


def test_the_upu_limb_is_no_input(both: Pair, rng: np.random.Generator) -> None:
    step = 1e-6
    for pose in both.poses(rng, 5):
        rate = rng.normal(size=5)
        ends = [both.machine.upu_length(pose + s * step * rate) for s in (-1, 1)]
        found = both.machine.upu_rate(pose, rate[[0, 1, 2, 4, 3]])
        assert found == pytest.approx((ends[1] - ends[0]) / (2.0 * step), abs=1e-8)


def test_forward_kinematics_from_afar(both: Pair, rng: np.random.Generator) -> None:
    """60 poses, from 8 mm and 1.1 degrees aside, as the page has it."""
    for pose in both.poses(rng, 60):
        if both.machine.rcond(pose) < 1e-3:  # in the paper's layout: next to its singular home
            continue
        near = pose + np.array([0.008, -0.008, 0.008, 0.019, -0.019]) * rng.uniform(-1, 1, 5)
        found = both.machine.forward_kinematics(both.machine.inverse_kinematics(pose), near=near)
        np.testing.assert_allclose(found, pose, rtol=0.0, atol=1e-10)


def test_yaw_of_the_joint_chain(rng: np.random.Generator) -> None:
    """The UPU limb as a chain: hinges x and y at O, a slide, hinges y and x at the platform."""
    machine = made(GOOD, True).machine
    for pose in machine.in_box(rng.uniform(-1.0, 1.0, (20, 5))):
        R, p = machine.rotation(pose), pose[:3]
        swing = np.arctan2(-p[1], p[2])
        rest = Rotation.from_euler("X", -swing).as_matrix() @ R  # Ry(.) Rx(.): the middle axes
        assert abs(rest[1, 0]) < 1e-12
        np.testing.assert_allclose(np.sin(machine.alpha(pose)), -p[1] / p[2] * np.tan(pose[3]))


def test_euler0_holds_alpha_where_the_limb_does_not() -> None:
    """alpha = 0 needs y = 0 or beta = 0: at the standard box's corners the limb turns by 3 deg."""
    machine = made(PAPER, True).machine
    corners = machine.in_box(np.array(list(itertools.product((-1.0, 1.0), repeat=5))))
    assert np.degrees(np.abs(machine.alpha(corners)).max()) == pytest.approx(2.95, abs=0.01)
    assert machine.alpha(machine.in_box(np.array([1.0, 0.0, 1.0, 1.0, 1.0]))) == 0.0
    assert machine.alpha(machine.in_box(np.array([1.0, 1.0, 1.0, 0.0, 1.0]))) == 0.0


def test_poses_out_of_reach_are_nan() -> None:
    machine = made(PAPER, True).machine
    far = np.array([[0.0, 0.0, 2.0, 0.0, 0.0], [0.0, 0.5, 0.01, 0.5, 0.0]])  # and a yaw beyond 90
    for verb in ("inverse_kinematics", "jacobian", "inverse_jacobian", "clearances", "rcond"):
        assert np.isnan(getattr(machine, verb)(far)).all(), verb


@pytest.mark.parametrize(
    ("name", "value"), [("r", 0.0), ("L", np.inf), ("theta", 1.6), ("lam0", 1.0), ("a2", 4.0)]
)
def test_impossible_dimensions_are_refused(name: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"{name} is"):
        Pss5Upu(**{"r": 0.3, "R": 0.6, "L": 0.5} | {name: value})
