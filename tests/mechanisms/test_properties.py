"""Properties of every mechanism; a new one joins with an entry of CASES."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem

DESIGNS, POSES = 60, 40


@dataclass(frozen=True)
class Case:
    """What the properties must know of a mechanism that its interface doesn't say."""

    out_of_reach: Callable[[Any], np.ndarray]  # a pose that no limb reaches
    inside: Callable[[Any, np.random.Generator], np.ndarray] | None = None  # poses off any limit
    sliding: tuple[str, ...] = ()  # roles of links that are drawn longer or shorter
    mirrored_pose: Callable[[np.ndarray], np.ndarray] | None = None
    mirrored_joints: Callable[[np.ndarray], np.ndarray] | None = None


def _spr3_poses(machine: Any, rng: np.random.Generator) -> np.ndarray:
    share = rng.uniform(0.05, 0.95, (POSES, 3))
    return machine.forward_kinematics(machine.q_min + (machine.q_max - machine.q_min) * share)


def _cylinder_poses(machine: Any, rng: np.random.Generator) -> np.ndarray:
    poses = machine.pose_at(machine.cylinder_points() * [0.95, 0.95, 1.0])
    lengths = machine.leg_lengths(poses)
    inset = 0.02 * (machine.q_max - machine.q_min)
    inside = (lengths > machine.q_min + inset) & (lengths < machine.q_max - inset)
    return rng.permutation(poses[inside.all(axis=1)])[:POSES]


CASES = {
    "diamond": Case(
        out_of_reach=lambda machine: np.array([machine.e, -1.001 * (machine.l1 + machine.l2)]),
        mirrored_pose=lambda pose: pose * [-1.0, 1.0],
        mirrored_joints=lambda joints: np.pi - joints[..., ::-1],
    ),
    "spr3": Case(
        out_of_reach=lambda machine: np.array([0.1, 0.2, -machine.q_c]),
        inside=_spr3_poses,
        sliding=("rod",),
        mirrored_pose=lambda pose: pose * [1.0, -1.0, 1.0],
        mirrored_joints=lambda joints: joints[..., [1, 0, 2]],
    ),
    "spr3_cylinder": Case(
        out_of_reach=lambda machine: np.array([0.1, 0.2, -machine.q_c]),
        inside=_cylinder_poses,
        sliding=("rod",),
        mirrored_pose=lambda pose: pose * [1.0, -1.0, 1.0],
        mirrored_joints=lambda joints: joints[..., [1, 0, 2]],
    ),
}


@dataclass(frozen=True)
class Sample:
    case: Case
    machine: Mechanism
    poses: np.ndarray


@pytest.fixture(scope="module")
def samples(problem: DesignProblem) -> list[Sample]:
    """Random machines with a usable workspace, each with random poses in it."""
    rng = np.random.default_rng(7)
    case = CASES[problem.name]
    designs = problem.low + (problem.high - problem.low) * rng.random(
        (200 * DESIGNS, len(problem.low))
    )
    tasks = problem.draw_tasks(len(designs), rng)
    kept = np.flatnonzero(problem.evaluate(designs, tasks).feasible)[:DESIGNS]
    assert len(kept) == DESIGNS
    machines = [problem.mechanism(designs[i], problem.unpack(tasks[i])) for i in kept]
    inside = case.inside or drawn_poses
    return [Sample(case, machine, inside(machine, rng)) for machine in machines]


def drawn_poses(machine: Mechanism, rng: np.random.Generator) -> np.ndarray:
    grid = machine.workspace_grid(53, 31)
    return rng.permutation(grid.reshape(-1, grid.shape[-1]))[:POSES]


def turned(angles: np.ndarray) -> np.ndarray:
    """Angles brought into (-pi, pi]: what two joint vectors differ by."""
    return np.angle(np.exp(1j * angles))


def derivative(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Derivative (..., out, in) by central differences of sixth order."""
    step = 4e-4
    columns = []
    for direction in np.eye(at.shape[-1]):
        rises = [
            turned(function(at + k * step * direction) - function(at - k * step * direction))
            for k in (1, 2, 3)
        ]
        columns.append((1.5 * rises[0] - 0.3 * rises[1] + rises[2] / 30.0) / (2.0 * step))
    return np.stack(columns, axis=-1)


def test_every_problem_has_a_case() -> None:
    assert set(CASES) == set(pkm_gym.problems())


def test_forward_kinematics_undoes_inverse_kinematics(samples: list[Sample]) -> None:
    for sample in samples:
        joints = sample.machine.inverse_kinematics(sample.poses)
        back = sample.machine.forward_kinematics(joints, near=sample.poses)
        np.testing.assert_allclose(back, sample.poses, rtol=0.0, atol=1e-12)


def test_joints_are_continuous_over_the_workspace(samples: list[Sample]) -> None:
    for sample in samples:
        path = np.linspace(sample.poses[:-1], sample.poses[1:], 200)
        joints = sample.machine.inverse_kinematics(path)
        assert np.nanmax(np.abs(np.diff(joints, axis=0))) < 0.2


def test_jacobian_and_inverse_jacobian_are_inverse(samples: list[Sample]) -> None:
    for sample in samples:
        product = sample.machine.jacobian(sample.poses) @ sample.machine.inverse_jacobian(
            sample.poses
        )
        identity = np.broadcast_to(np.eye(product.shape[-1]), product.shape)
        np.testing.assert_allclose(product, identity, rtol=0.0, atol=1e-12)


def test_inverse_jacobian_is_the_derivative_of_inverse_kinematics(samples: list[Sample]) -> None:
    for sample in samples:
        machine, poses = sample.machine, sample.poses
        rates = derivative(machine.inverse_kinematics, poses)
        # joint rates = Ji @ twist, and a twist is not always the rate of the pose
        units = np.eye(poses.shape[-1])
        twists = np.stack([machine.twist(poses, np.broadcast_to(u, poses.shape)) for u in units])
        expected = machine.inverse_jacobian(poses) @ np.moveaxis(twists, 0, -1)
        scale = np.abs(expected).max(axis=(-1, -2), keepdims=True)
        assert (np.abs(rates - expected) / scale).max() <= 1e-8


def test_jacobian_is_the_derivative_of_forward_kinematics(samples: list[Sample]) -> None:
    for sample in samples:
        machine, poses = sample.machine, sample.poses
        joints = machine.inverse_kinematics(poses)
        rates = derivative(lambda q, m=machine, p=poses: m.forward_kinematics(q, near=p), joints)
        twists = np.stack(
            [machine.twist(poses, rates[..., k]) for k in range(joints.shape[-1])], axis=-1
        )
        jacobian = machine.jacobian(poses)
        scale = np.abs(jacobian).max(axis=(-1, -2), keepdims=True)
        assert (np.abs(twists - jacobian) / scale).max() <= 1e-8


def test_mirrored_poses_have_mirrored_joints(samples: list[Sample]) -> None:
    if samples[0].case.mirrored_pose is None:
        pytest.skip("no mirror symmetry")
    for sample in samples:
        mirrored = sample.case.mirrored_pose(sample.poses)
        joints = sample.machine.inverse_kinematics(sample.poses)
        expected = sample.case.mirrored_joints(joints)
        found = sample.machine.inverse_kinematics(mirrored)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
        maps, mirrored_maps = map(sample.machine.index_maps, (sample.poses, mirrored))
        for name, index in maps.items():
            np.testing.assert_allclose(mirrored_maps[name].values, index.values, rtol=1e-9)


VERBS = ("inverse_kinematics", "jacobian", "inverse_jacobian")


@pytest.mark.parametrize("verb", VERBS)
def test_a_batch_of_poses_equals_single_poses(samples: list[Sample], verb: str) -> None:
    for sample in samples[:5]:
        method = getattr(sample.machine, verb)
        single = np.stack([method(pose) for pose in sample.poses])
        np.testing.assert_array_equal(method(sample.poses), single)


@pytest.mark.parametrize("verb", VERBS)
def test_verbs_broadcast_over_leading_axes(samples: list[Sample], verb: str) -> None:
    machine, poses = samples[0].machine, samples[0].poses
    method = getattr(machine, verb)
    flat = method(poses)
    for shape in ((), (0,), (1,), (2, 3), (4, 1, 5)):
        count = int(np.prod(shape))
        found = method(poses[:count].reshape(*shape, -1)) if count else method(poses[:0])
        assert found.shape == (shape if count else (0,)) + flat.shape[1:]
        np.testing.assert_array_equal(found.reshape(flat[:count].shape), flat[:count])


@pytest.mark.parametrize("verb", VERBS)
def test_verbs_refuse_a_wrong_last_axis(samples: list[Sample], verb: str) -> None:
    width = len(samples[0].machine.pose_names)
    with pytest.raises(ValueError, match=rf"\(\.\.\., {width}\)"):
        getattr(samples[0].machine, verb)(np.zeros((3, width + 1)))


@pytest.mark.parametrize("verb", VERBS)
def test_out_of_reach_is_nan_for_that_pose_alone(samples: list[Sample], verb: str) -> None:
    for sample in samples[:5]:
        poses = sample.poses[:3].copy()
        poses[1] = sample.case.out_of_reach(sample.machine)
        found = getattr(sample.machine, verb)(poses).reshape(3, -1)
        assert np.isnan(found[1]).any()
        assert np.isfinite(found[[0, 2]]).all()


@pytest.mark.parametrize("value", [0.0, -0.1, np.nan, np.inf, -np.inf, 1e7])
def test_impossible_dimensions_are_refused_by_name(samples: list[Sample], value: float) -> None:
    for item in fields(samples[0].machine):
        if item.metadata["low"] < value < item.metadata["high"]:
            continue
        with pytest.raises(ValueError, match=rf"^{item.name} is {value!r} .*must be.*greater than"):
            replace(samples[0].machine, **{item.name: value})


def test_every_dimension_has_a_unit_and_a_meaning(samples: list[Sample]) -> None:
    for item in fields(samples[0].machine):
        assert item.metadata["doc"]
        assert item.metadata["unit"]


def test_the_workspace_grid_fills_the_outline(samples: list[Sample]) -> None:
    for sample in samples:
        outline, poses = sample.machine.workspace(), sample.machine.workspace_grid(9, 5)
        assert poses.shape == (5, 9, len(sample.machine.pose_names))
        grid = sample.machine.drawn(poses)
        np.testing.assert_array_equal(outline[0], outline[-1])
        for axis in range(2):
            for end in (np.min, np.max):
                assert end(grid[..., axis]) == pytest.approx(end(outline[:, axis]), rel=1e-14)


def test_rigid_links_keep_their_length_and_the_base_its_place(samples: list[Sample]) -> None:
    for sample in samples[:10]:
        shapes = [
            [(link.role, link.points) for link in sample.machine.links(pose)]
            for pose in sample.poses[:8]
        ]
        for links in zip(*shapes, strict=True):
            (role, first), *others = links
            for other_role, points in others:
                assert other_role == role
                if role == "base":
                    np.testing.assert_array_equal(points, first)
                if role in sample.case.sliding:
                    continue
                np.testing.assert_allclose(
                    np.linalg.norm(np.diff(points, axis=0), axis=-1),
                    np.linalg.norm(np.diff(first, axis=0), axis=-1),
                    rtol=1e-12,
                )
