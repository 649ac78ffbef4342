"""The Diamond's geometry and indices against brute force and finite differences."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

import pkm_gym
from pkm_gym.core.merit import TOLERANCE
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms.diamond.mechanism import Diamond

EXTREMES = {
    "tau_G": ("tau", 1.0), "sigma_max": ("sigma_max", 1.0), "sigma_min": ("sigma_min", -1.0),
    "condition": ("condition", 1.0), "sin_alpha": ("sin_alpha", -1.0),
}  # fmt: skip


@pytest.fixture(scope="module")
def diamond() -> DesignProblem:
    return pkm_gym.make_problem("diamond")


@pytest.fixture(scope="module")
def drawn(diamond: DesignProblem, draw: Callable[[DesignProblem, int], Any]) -> Any:
    return draw(diamond, 300)


def poses_of(machine: Any, rng: np.random.Generator, n: int = 50) -> np.ndarray:
    """Random poses (n, 2) in the workspace."""
    corner = np.array([-0.5 * machine.b, -machine.H - machine.h])
    return corner + [machine.b, machine.h] * rng.random((n, 2))


def border(machine: Any, n: int) -> np.ndarray:
    """Poses (4 n, 2) along the edge of the workspace."""
    sides = itertools.pairwise(machine.workspace())
    return np.concatenate([np.linspace(start, end, n) for start, end in sides])


def elbows(machine: Any, poses: np.ndarray) -> np.ndarray:
    """Elbows (..., limb, 2) by eq. (2) as the paper writes it, with arccos and arctan2."""
    sides = np.array([1.0, -1.0])
    drives = np.stack([sides * machine.e, np.zeros(2)], axis=-1)
    x, y = np.moveaxis(poses[..., None, :] - drives, -1, 0)
    distance = np.hypot(x, y)
    cosine = (distance**2 + machine.l1**2 - machine.l2**2) / (2.0 * distance * machine.l1)
    angle = np.arctan2(y, x) + sides * np.arccos(cosine)
    return drives + machine.l1 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return one[..., 0] * other[..., 1] - one[..., 1] * other[..., 0]


# Geometry -----------------------------------------------------------------------------------------


def test_arms_and_rods_close_with_elbows_outwards(drawn: Any, rng: np.random.Generator) -> None:
    for machine in drawn.machines:
        poses = poses_of(machine, rng)
        angles = machine.inverse_kinematics(poses)
        tips = machine.l1 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        tips[..., 0] += [machine.e, -machine.e]
        np.testing.assert_allclose(tips, elbows(machine, poses), rtol=0.0, atol=1e-11)
        rods = np.linalg.norm(poses[:, None, :] - tips, axis=-1)
        np.testing.assert_allclose(rods, machine.l2, rtol=1e-12)


def test_the_platform_is_the_lower_intersection(drawn: Any, rng: np.random.Generator) -> None:
    for machine in drawn.machines:
        joints = np.array([0.0, np.pi]) + rng.uniform(-0.5, 0.5, (50, 2))
        poses = machine.forward_kinematics(joints)
        tips = machine.l1 * np.stack([np.cos(joints), np.sin(joints)], axis=-1)
        tips[..., 0] += [machine.e, -machine.e]
        met = np.isfinite(poses).all(axis=1)
        apart = np.linalg.norm(tips[:, 0] - tips[:, 1], axis=-1)
        np.testing.assert_array_equal(met, apart < 2.0 * machine.l2)
        rods = poses[met, None, :] - tips[met]
        np.testing.assert_allclose(np.linalg.norm(rods, axis=-1), machine.l2, rtol=1e-12)
        assert (cross(tips[met, 0] - tips[met, 1], rods[:, 1]) < 0.0).all()


def test_rods_that_cannot_meet_have_no_platform() -> None:
    wide = Diamond(e=1.0, l1=0.2, l2=0.5, H=0.3, b=0.1, h=0.1, I_A=0.03, m=1.0, mr_A=0.1)
    assert np.isnan(wide.forward_kinematics(np.array([0.0, np.pi]))).all()


def test_hessian_is_the_derivative_of_the_jacobian(drawn: Any, rng: np.random.Generator) -> None:
    for machine in drawn.machines:
        poses = poses_of(machine, rng)
        step = 2e-4 * machine.l1
        slopes = []
        for d in np.eye(2):
            one, two = (
                machine.inverse_jacobian(poses + k * step * d)
                - machine.inverse_jacobian(poses - k * step * d)
                for k in (1, 2)
            )
            slopes.append((8.0 * one - two) / (12.0 * step))
        hessian = machine.hessian(poses)
        expected = np.stack(slopes, axis=-1)
        scale = np.abs(hessian).max(axis=(-1, -2, -3), keepdims=True)
        assert (np.abs(hessian - expected) / scale).max() <= 1e-8
        np.testing.assert_array_equal(hessian, hessian.swapaxes(-1, -2))


# Indices at a pose --------------------------------------------------------------------------------


def test_singular_values_agree_with_svd(drawn: Any, rng: np.random.Generator) -> None:
    for machine in drawn.machines:
        poses = poses_of(machine, rng)
        expected = np.linalg.svd(machine.l1 * machine.inverse_jacobian(poses), compute_uv=False)
        local = machine.local_indices(poses)
        np.testing.assert_allclose(local["sigma_max"], expected[:, 0], rtol=1e-12)
        np.testing.assert_allclose(local["sigma_min"], expected[:, 1], rtol=1e-11)


def test_sines_are_those_of_the_angles_between_the_links(
    drawn: Any, rng: np.random.Generator
) -> None:
    for machine in drawn.machines:
        poses = poses_of(machine, rng)
        tips = elbows(machine, poses)
        rods = (poses[:, None, :] - tips) / machine.l2
        arms = (tips - [[machine.e, 0.0], [-machine.e, 0.0]]) / machine.l1
        local = machine.local_indices(poses)
        np.testing.assert_allclose(local["sin_alpha"], cross(rods[:, 0], rods[:, 1]), atol=1e-10)
        beta = np.abs(cross(arms, rods)).min(axis=-1)
        np.testing.assert_allclose(local["sin_beta"], beta, atol=1e-10)


def test_torque_index_is_the_worst_direction_of_acceleration(
    drawn: Any, rng: np.random.Generator
) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 4001)
    directions = np.stack([np.cos(turn), np.sin(turn)], axis=-1)
    still = np.zeros(2)
    for machine in drawn.machines[:100]:
        for pose in poses_of(machine, rng, 5):
            holding = machine.inverse_dynamics(pose, still, still)
            torques = machine.inverse_dynamics(pose, still, directions) - holding
            worst = np.abs(torques).max()
            assert machine.local_indices(pose)["tau"] == pytest.approx(worst, rel=1e-6)


# Indices over the workspace -----------------------------------------------------------------------


@pytest.fixture(scope="module")
def reachable(diamond: DesignProblem) -> Any:
    """Evaluation of random designs of all kinds, most of them infeasible, that reach everything."""
    rng = np.random.default_rng(3)
    designs = [0.2, 0.5, 0.05] + [0.8, 3.0, 0.7] * rng.random((3000, 3))
    tasks = diamond.draw_tasks(len(designs), rng)
    tasks[:, diamond.task_type.names().index("h_ratio")] = rng.uniform(0.1, 0.4, len(tasks))
    tasks[:, diamond.task_type.names().index("delta")] = rng.uniform(0.5, 2.0, len(tasks))
    # one whose largest arm angle lies inside the right edge, where the rod is horizontal
    designs[0], tasks[0] = [0.6, 0.6, 0.81], diamond.pack({"delta": 0.5, "h_ratio": 0.19})
    kept = np.isfinite(diamond.evaluate(designs, tasks).objectives[:, 0])
    assert kept[0]
    return diamond.evaluate(designs[kept][:400], tasks[kept][:400])


def test_beta_min_is_exact(diamond: DesignProblem, reachable: Any) -> None:
    for i, beta in enumerate(reachable.indices["beta_min"]):
        machine: Any = diamond.mechanism(reachable.designs[i], reachable.task(i))
        dense = machine.local_indices(border(machine, 4001))["sin_beta"].min()
        assert dense >= np.sin(beta) * (1.0 - 1e-9)
        assert dense == pytest.approx(np.sin(beta), rel=1e-5, abs=1e-5)


def test_arm_angle_range_is_exact(diamond: DesignProblem, reachable: Any) -> None:
    lows, highs = (reachable.indices[f"arm_angle_{end}"] for end in ("min", "max"))
    for i, (low, high) in enumerate(zip(lows, highs, strict=True)):
        machine: Any = diamond.mechanism(reachable.designs[i], reachable.task(i))
        inside = machine.inverse_kinematics(machine.workspace_grid(61, 31))[..., 0]
        assert low - 1e-9 <= inside.min() <= inside.max() <= high + 1e-9
        edge = machine.inverse_kinematics(border(machine, 4001))[:, 0]
        assert edge.min() == pytest.approx(low, abs=1e-5)
        assert edge.max() == pytest.approx(high, abs=1e-5)


def test_reach_margins_are_exact(diamond: DesignProblem, rng: np.random.Generator) -> None:
    designs = [0.2, 0.3, 0.71] + [1.0, 3.3, 0.2] * rng.random((500, 3))
    tasks = diamond.draw_tasks(len(designs), rng)
    tasks[:, diamond.task_type.names().index("delta")] = rng.uniform(0.5, 2.0, len(tasks))
    evaluation = diamond.evaluate(designs, tasks)
    inner, outer = evaluation.constraints[:, 1], evaluation.constraints[:, 2]
    assert diamond.constraint_names[1:3] == ("reach_inner", "reach_outer")
    for i, design in enumerate(designs):
        machine: Any = diamond.mechanism(design, evaluation.task(i))
        distances = np.linalg.norm(border(machine, 2001) - [machine.e, 0.0], axis=1)
        too_near = (abs(machine.l2 - machine.l1) - distances.min()) / machine.l1
        too_far = (distances.max() - machine.l1 - machine.l2) / machine.l1
        assert inner[i] + TOLERANCE == pytest.approx(too_near, abs=1e-5)
        assert outer[i] + TOLERANCE == pytest.approx(too_far, abs=1e-12)


def test_poses_are_reached_exactly_where_the_margins_say(
    diamond: DesignProblem, rng: np.random.Generator
) -> None:
    designs = diamond.low + (diamond.high - diamond.low) * rng.random((300, 3))
    reached = (diamond.evaluate(designs).constraints[:, 1:3] <= 0.0).all(axis=1)
    assert 0.1 < reached.mean() < 0.95
    for design, whole in zip(designs, reached, strict=True):
        machine: Any = diamond.mechanism(design)
        assert np.isfinite(machine.inverse_kinematics(border(machine, 801))).all() == whole


@pytest.fixture(scope="module")
def regular(diamond: DesignProblem) -> tuple[np.ndarray, np.ndarray]:
    """Regular designs and tasks of the Family: within reach, of one assembly mode."""
    rng = np.random.default_rng(43)
    designs = diamond.low + (diamond.high - diamond.low) * rng.random((1000, 3))
    tasks = diamond.draw_tasks(1000, rng)
    indices = diamond.evaluate(designs, tasks).indices
    kept = (indices["sigma_max"] <= 3.0) & (np.sin(indices["alpha_min"]) >= 0.1)
    return designs[kept], tasks[kept]


def local_index(machine: Any, name: str, poses: np.ndarray) -> np.ndarray:
    local = machine.local_indices(poses)
    return local["sigma_max"] / local["sigma_min"] if name == "condition" else local[name]


def refined(machine: Any, name: str, sign: float, columns: int, rows: int) -> float:
    """SciPy's bounded maximum of a local index from the best of a fine grid of poses."""
    grid = machine.workspace_grid(columns, rows).reshape(-1, 2)
    values = sign * local_index(machine, name, grid)
    low, span = np.array([-0.5 * machine.b, -machine.H - machine.h]), [machine.b, machine.h]
    best = values.max()
    for at in np.argsort(values)[-3:]:
        ascent = minimize(
            lambda unit: -sign * float(local_index(machine, name, low + span * unit)),
            (grid[at] - low) / span, bounds=[(0.0, 1.0)] * 2, options={"ftol": 1e-15, "gtol": 1e-9},
        )  # fmt: skip
        best = max(best, -ascent.fun)
    return sign * best


def test_extremes_over_the_workspace_are_those_that_scipy_finds(
    diamond: DesignProblem, regular: tuple[np.ndarray, np.ndarray]
) -> None:
    evaluation = diamond.evaluate(*regular)
    for i, design in enumerate(regular[0][:60]):
        machine = diamond.mechanism(design, evaluation.task(i))
        for index, (name, sign) in EXTREMES.items():
            found = evaluation.quantity(index)[i]
            assert found == pytest.approx(refined(machine, name, sign, 129, 65), rel=1e-10), index


def test_no_finer_sample_of_the_workspace_shows_more(
    diamond: DesignProblem, regular: tuple[np.ndarray, np.ndarray]
) -> None:
    evaluation = diamond.evaluate(*regular)
    for i, design in enumerate(regular[0]):
        machine = diamond.mechanism(design, evaluation.task(i))
        poses = machine.workspace_grid(301, 61).reshape(-1, 2)
        for index, (name, sign) in EXTREMES.items():
            seen = (sign * local_index(machine, name, poses)).max()
            assert seen <= sign * evaluation.quantity(index)[i] * (1.0 + sign * 1e-9), index


def test_extremes_depend_on_no_sampling(
    diamond: DesignProblem, regular: tuple[np.ndarray, np.ndarray]
) -> None:
    coarse = diamond.evaluate(*regular)
    fine = pkm_gym.make_problem("diamond", sampling=(61, 25)).evaluate(*regular)
    for name in coarse.indices:
        np.testing.assert_allclose(coarse.quantity(name), fine.quantity(name), rtol=1e-9)


def test_sigma_max_is_smooth_where_its_place_moves_along_an_edge(diamond: DesignProblem) -> None:
    """The largest of samples is scalloped: it has a kink wherever the largest one changes."""
    designs = np.linspace([0.4, 2.25, 0.3], [0.6, 2.25, 0.3], 401)
    values = diamond.evaluate(designs).indices["sigma_max"]
    places, sampled = [], []
    for design in designs[::40]:
        machine: Any = diamond.mechanism(design)
        edge = machine.workspace_grid(2001, 2)[1]
        places.append(abs(edge[np.argmax(machine.local_indices(edge)["sigma_max"]), 0]))
    for design in designs:
        machine = diamond.mechanism(design)
        sampled.append(machine.local_indices(machine.workspace_grid(63, 2)[1])["sigma_max"].max())
    assert np.ptp(places) > 1.5 * 0.4 / 31  # from one sample of the edge to others
    unit = np.linspace(-1.0, 1.0, 401)

    def rest(curve: np.ndarray) -> float:
        return float(abs(curve - np.polynomial.Polynomial.fit(unit, curve, 14)(unit)).max())

    assert rest(values) < 1e-10
    assert rest(np.array(sampled)) > 1e-6


def test_a_workspace_with_collinear_rods_keeps_finite_indices(diamond: DesignProblem) -> None:
    rng = np.random.default_rng(1)
    designs = diamond.low + (diamond.high - diamond.low) * rng.random((4000, 3))
    tasks = np.repeat(diamond.pack({"h_ratio": 0.4})[None], 4000, axis=0)
    evaluation = diamond.evaluate(designs, tasks)
    folded = evaluation.quantity("sin_alpha") <= 0.0
    assert folded.any()
    for name in ("tau_G", "sigma_max", "sigma_min", "condition"):
        assert np.isfinite(evaluation.quantity(name)[folded]).all()
    assert not evaluation.feasible[folded].any()


def test_the_torque_index_scales_with_length_and_inertia(drawn: Any) -> None:
    for machine in drawn.machines[:50]:
        lengths = {name: 2.0 * getattr(machine, name) for name in ("e", "l1", "l2", "H", "b", "h")}
        # eta = m l1^2 / I_A is kept, so tau l1 / I_A is; four times the inertia over twice the arm
        large = Diamond(**lengths, I_A=4.0 * machine.I_A, m=machine.m, mr_A=machine.mr_A)
        poses = machine.workspace_grid(9, 5)
        one, other = machine.local_indices(poses), large.local_indices(2.0 * poses)
        np.testing.assert_allclose(other["tau"], 2.0 * one["tau"], rtol=1e-12)
        np.testing.assert_allclose(other["sigma_max"], one["sigma_max"], rtol=1e-12)
