"""Properties of every mechanism."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
import pytest

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem

POSES = 40
SINGULAR = 500.0  # a condition number, at which digits are lost and derivatives run away
STEP = 4e-4  # of a numerical derivative, m or rad


@dataclass(frozen=True)
class Sample:
    machine: Mechanism
    poses: np.ndarray


@pytest.fixture(scope="session")
def samples(family_problem: DesignProblem, usable: Evaluation) -> list[Sample]:
    """Machines with a usable workspace, each with random poses in it."""
    rng = np.random.default_rng(7)
    machines = [family_problem.mechanism(d, usable.task(i)) for i, d in enumerate(usable.designs)]
    return [Sample(machine, inside(machine, rng)) for machine in machines]


def inside(machine: Mechanism, rng: np.random.Generator) -> np.ndarray:
    """Poses between those of the workspace, with a derivative's steps about them within reach."""
    known = machine.search_poses()
    known = known[np.isfinite(known).all(axis=1)]
    ends = known[rng.integers(len(known), size=(2, 20 * POSES))]
    drawn = ends[0] + rng.uniform(0.05, 0.95, (20 * POSES, 1)) * (ends[1] - ends[0])
    steps = 3.0 * STEP * np.concatenate([np.eye(drawn.shape[1]), -np.eye(drawn.shape[1])])
    about = np.concatenate([drawn[:, None], drawn[:, None] + steps], axis=1)
    kept = np.isfinite(machine.inverse_kinematics(about)).all(axis=(1, 2))
    kept[kept] = regular(machine.jacobian(drawn[kept]))
    assert kept.sum() >= POSES
    return drawn[kept][:POSES]


def regular(jacobians: np.ndarray) -> np.ndarray:
    """Whether Jacobians (n, m, k) are regular enough for a test that differs and inverts."""
    exist = np.isfinite(jacobians).all(axis=(1, 2))
    exist[exist] = np.linalg.cond(jacobians[exist]) < SINGULAR
    return exist


def turned(angles: np.ndarray) -> np.ndarray:
    """Angles brought into (-pi, pi]: what two joint vectors differ by."""
    return np.angle(np.exp(1j * angles))


def derivative(
    function: Callable[[np.ndarray], np.ndarray], at: np.ndarray, step: float = STEP
) -> np.ndarray:
    """Derivative (..., out, in) by central differences of sixth order."""
    columns = []
    for direction in np.eye(at.shape[-1]):
        rises = [
            turned(function(at + k * step * direction) - function(at - k * step * direction))
            for k in (1, 2, 3)
        ]
        columns.append((1.5 * rises[0] - 0.3 * rises[1] + rises[2] / 30.0) / (2.0 * step))
    return np.stack(columns, axis=-1)


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
        # a twist may have more entries than the platform has freedoms
        product = sample.machine.inverse_jacobian(sample.poses) @ sample.machine.jacobian(
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
        jacobian = machine.jacobian(poses)
        step = STEP / max(1.0, np.abs(jacobian).max())  # of the joints: the pose moves by as much
        rates = derivative(
            lambda q, m=machine, p=poses: m.forward_kinematics(q, near=p), joints, step
        )
        twists = np.stack(
            [machine.twist(poses, rates[..., k]) for k in range(joints.shape[-1])], axis=-1
        )
        scale = np.abs(jacobian).max(axis=(-1, -2), keepdims=True)
        assert (np.abs(twists - jacobian) / scale).max() <= 1e-8


def test_a_symmetry_maps_poses_joints_and_indices(samples: list[Sample]) -> None:
    for sample in samples:
        for _, pose, joints in sample.machine.symmetries():
            image = pose(sample.poses)
            expected = joints(sample.machine.inverse_kinematics(sample.poses))
            found = sample.machine.inverse_kinematics(image)
            np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
            maps, images = map(sample.machine.index_maps, (sample.poses, image))
            for name, index in maps.items():
                least = 1e-12 * np.abs(index.values).max()  # next to 0 digits are lost
                np.testing.assert_allclose(images[name].values, index.values, rtol=1e-9, atol=least)


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
def test_out_of_reach_is_nan_for_that_pose_alone(
    samples: list[Sample], anywhere: Callable, rng: np.random.Generator, verb: str
) -> None:
    for sample in samples[:5]:
        far = anywhere(sample.machine, rng, 200)
        poses = np.concatenate([sample.poses, far])[rng.permutation(len(sample.poses) + len(far))]
        reached = np.isfinite(sample.machine.inverse_kinematics(poses)).all(axis=1)
        found = getattr(sample.machine, verb)(poses).reshape(len(poses), -1)
        assert np.isfinite(found[reached]).all()
        assert np.isnan(found[~reached]).any()
        assert reached.sum() >= len(sample.poses)


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
        # a pure number is a cosine or a switch
        assert item.metadata["unit"] or item.metadata["high"] <= 1.0 + 1e-9


def test_the_workspace_grid_fills_the_outline(samples: list[Sample]) -> None:
    for sample in samples:
        outline, poses = sample.machine.workspace(), sample.machine.workspace_grid(9, 5)
        assert poses.shape == (5, 9, len(sample.machine.pose_names))
        grid = sample.machine.drawn(poses)
        np.testing.assert_array_equal(outline[0], outline[-1])
        for axis in range(2):
            for end in (np.min, np.max):
                assert end(grid[..., axis]) == pytest.approx(end(outline[:, axis]), rel=1e-14)


def test_links_keep_their_length_or_slide_as_one_joint_does(samples: list[Sample]) -> None:
    for sample in samples[:10]:
        machine, poses = sample.machine, sample.poses[:8]
        joints = machine.inverse_kinematics(poses)
        slides = np.concatenate([joints, machine.passive_lengths(poses)], axis=-1)
        slides = np.abs(slides - slides[0])
        for links in zip(*(machine.links(pose) for pose in poses), strict=True):
            assert len({link.role for link in links}) == 1
            points = np.array([link.points for link in links])
            if links[0].role == "base":
                np.testing.assert_array_equal(points, np.broadcast_to(points[0], points.shape))
            lengths = np.linalg.norm(np.diff(points, axis=1), axis=-1)
            changes = np.abs(lengths - lengths[0])
            rigid = changes.max(initial=0.0) <= 1e-12 * lengths.max(initial=0.0)
            like = np.abs(changes.max(axis=1, initial=0.0)[:, None] - slides).max(axis=0)
            assert rigid or like.min() <= 1e-12
