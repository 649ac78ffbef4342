"""What a mechanism tells the pictures: its links, its workspace, its local indices."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym


@pytest.fixture
def machine(problem, design):
    return problem.mechanism(design)


def in_reach(machine, rng, count=50):
    """Drawn poses of the workspace, all of them in reach."""
    poses = machine.workspace_grid(41, 11)
    poses = poses.reshape(-1, poses.shape[-1])
    reached = np.isfinite(machine.inverse_kinematics(poses)).all(axis=1)
    return rng.choice(poses[reached], count)


def test_links_are_finite_in_reach_and_the_base_never_moves(machine, rng):
    bases = []
    for pose in in_reach(machine, rng):
        links = machine.links(pose)
        assert {"base", "platform"} <= {link.role for link in links}
        for link in links:
            assert link.points.ndim == 2
            assert link.points.shape[1] in (2, 3)
            assert np.isfinite(link.points).all()
        bases.append(np.concatenate([link.points for link in links if link.role == "base"]))
    np.testing.assert_array_equal(bases, np.broadcast_to(bases[0], np.shape(bases)))


def test_links_hang_together(machine, rng):
    for pose in in_reach(machine, rng):
        links = machine.links(pose)
        ends = [end for link in links for end in (link.points[0], link.points[-1])]
        for link in links:
            for end in (link.points[0], link.points[-1]):
                others = [e for e in ends if e is not end]
                assert min(np.linalg.norm(end - other) for other in others) < 1e-15


def test_workspace_is_a_closed_polygon_that_holds_the_grid_and_the_poses(machine):
    outline = machine.workspace()
    np.testing.assert_array_equal(outline[0], outline[-1])
    low, high = outline.min(axis=0), outline.max(axis=0)
    grid = machine.workspace_grid(7, 5)
    assert grid.shape == (5, 7, len(machine.pose_names))
    places = machine.drawn(grid)
    np.testing.assert_allclose(places.min(axis=(0, 1)), low, atol=1e-15)
    np.testing.assert_allclose(places.max(axis=(0, 1)), high, atol=1e-15)
    poses = machine.sample_poses()
    assert 2 <= len(poses) <= 3
    places = machine.drawn(poses)
    assert ((places >= low - 1e-15) & (places <= high + 1e-15)).all()


def test_a_map_has_the_unit_of_its_index(problem, machine):
    for name, index in problem.drawn_maps(machine, machine.sample_poses()).items():
        assert index.unit == problem.unit(name)


def test_out_of_reach_the_hooks_answer_nan(machine, out_of_reach):
    pose = out_of_reach(machine)
    moving = [link.points for link in machine.links(pose) if link.role in ("arm", "rod")]
    assert any(np.isnan(points).any() for points in moving)
    assert all(np.isnan(index.values) for index in machine.index_maps(pose).values())


def test_diamond_links_have_the_lengths_of_the_dimensions(rng):
    problem = pkm_gym.make_problem("diamond")
    machine = problem.mechanism(problem.printed_design())
    for pose in in_reach(machine, rng):
        links = machine.links(pose)
        for link in links:
            length = np.hypot(*np.diff(link.points, axis=0).T).sum()
            expected = {"base": 2.0 * machine.e, "arm": machine.l1, "rod": machine.l2}
            assert length == pytest.approx(expected.get(link.role, 0.0), abs=1e-12)
        drives = {tuple(link.points[0]) for link in links if link.role == "arm"}
        assert drives == {(machine.e, 0.0), (-machine.e, 0.0)}
        elbows = sorted(link.points[-1][0] for link in links if link.role == "arm")
        assert elbows[0] < -machine.e + machine.l1
        platform = next(link.points[0] for link in links if link.role == "platform")
        np.testing.assert_array_equal(platform, pose)


def test_diamond_maps_agree_with_numpy(rng):
    problem = pkm_gym.make_problem("diamond")
    machine = problem.mechanism(problem.printed_design())
    poses = in_reach(machine, rng)
    maps = problem.drawn_maps(machine, poses)
    scaled = machine.l1 * machine.inverse_jacobian(poses)
    sigma = np.linalg.svd(scaled, compute_uv=False)
    np.testing.assert_allclose(maps["sigma_max"].values, sigma[:, 0], rtol=1e-12)
    np.testing.assert_allclose(maps["sigma_min"].values, sigma[:, 1], rtol=1e-12)
    np.testing.assert_allclose(maps["condition"].values, np.linalg.cond(scaled), rtol=1e-12)
    torque = machine.I_A * np.linalg.inv(machine.jacobian(poses))
    torque += machine.m * machine.jacobian(poses).swapaxes(-1, -2)
    largest = np.linalg.norm(torque, axis=-1).max(axis=-1)
    np.testing.assert_allclose(maps["tau_G"].values, largest, rtol=1e-12)


def test_diamond_angles_are_those_between_the_drawn_links(rng):
    problem = pkm_gym.make_problem("diamond")
    machine = problem.mechanism(problem.printed_design())
    poses = in_reach(machine, rng)
    maps = problem.drawn_maps(machine, poses)
    for k, pose in enumerate(poses):
        links = machine.links(pose)
        arms = [np.diff(link.points, axis=0)[0] for link in links if link.role == "arm"]
        rods = [np.diff(link.points, axis=0)[0] for link in links if link.role == "rod"]
        elbows = [acute(arm, rod) for arm, rod in zip(arms, rods, strict=True)]
        assert maps["beta_min"].values[k] == pytest.approx(min(elbows), abs=1e-9)
        assert maps["alpha_min"].values[k] == pytest.approx(acute(*rods), abs=1e-9)


def acute(one, other):
    """The acute angle between two vectors, rad."""
    cosine = abs(one @ other) / np.sqrt((one @ one) * (other @ other))
    return np.arccos(min(1.0, cosine))
