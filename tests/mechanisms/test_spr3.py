"""The 3-SPR's geometry, velocities, workspace and path against a model of their own."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import pkm_gym
from pkm_gym.core.reference import Reference
from pkm_gym.mechanisms.spr3 import kinematics
from pkm_gym.mechanisms.spr3.assembly import all_assembly_modes
from pkm_gym.mechanisms.spr3.mechanism import Spr3
from pkm_gym.mechanisms.spr3.path import (
    GatePath,
    best_place,
    largest_cylinder,
    motion,
    needed_range,
)
from pkm_gym.mechanisms.spr3.workspace import (
    envelope,
    volume_by_quadrature,
    volume_by_surfaces,
    volume_by_voxels,
)

REFERENCE = Reference.load("pkm_gym.mechanisms.spr3")
AZIMUTHS = np.radians([120.0, -120.0, 0.0])
RADIAL = np.stack([np.cos(AZIMUTHS), np.sin(AZIMUTHS), np.zeros(3)], axis=-1)
TANGENTIAL = np.stack([-np.sin(AZIMUTHS), np.cos(AZIMUTHS), np.zeros(3)], axis=-1)


@pytest.fixture(scope="module")
def printed() -> Spr3:
    problem = pkm_gym.make_problem("spr3")
    machine = problem.mechanism(problem.printed_design())
    assert isinstance(machine, Spr3)
    return machine


@pytest.fixture(scope="module")
def machines() -> list[Spr3]:
    """Machines of every shape whose joint box holds no singularity."""
    problem = pkm_gym.make_problem("spr3")
    rng = np.random.default_rng(5)
    designs = problem.low + (problem.high - problem.low) * rng.random((200, 2))
    kept = designs[problem.evaluate(designs).indices["lci_min"] > 0.15][:40]
    assert len(kept) == 40
    return [problem.mechanism(design) for design in kept]  # type: ignore[misc]  # all are Spr3


def joints_of(machine: Spr3, rng: np.random.Generator, n: int = 40) -> np.ndarray:
    return machine.q_min + (machine.q_max - machine.q_min) * rng.random((n, 3))


def poses_of(machine: Spr3, rng: np.random.Generator, n: int = 40) -> np.ndarray:
    return machine.forward_kinematics(joints_of(machine, rng, n))


def points_of(
    machine: Spr3, position: np.ndarray, rotation: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """B_i (3, 3), A_i (..., 3, 3) and c_i (..., 3, 3), limb by limb, in the fixed frame."""
    moving = position[..., None, :] + machine.a * np.einsum("...ij,kj->...ki", rotation, RADIAL)
    axes = np.einsum("...ij,kj->...ki", rotation, TANGENTIAL)
    return machine.b * RADIAL, moving, axes


def limb_frames(machine: Spr3, pose: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3, 3) of the limbs: x along c_i, z from B_i to A_i."""
    fixed, moving, axes = points_of(machine, machine.position(pose), machine.rotation(pose))
    z = (moving - fixed) / np.linalg.norm(moving - fixed, axis=-1, keepdims=True)
    return np.stack([axes, np.cross(z, axes), z], axis=-1)


def derivative(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Derivative by central differences of sixth order, the argument's entry as the last axis."""
    step, columns = 1e-3, []
    for direction in np.eye(at.shape[-1]):
        one, two, three = (
            function(at + k * step * direction) - function(at - k * step * direction)
            for k in (1, 2, 3)
        )
        columns.append((1.5 * one - 0.3 * two + three / 30.0) / (2.0 * step))
    return np.stack(columns, axis=-1)


def spin(turning: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Angular velocity (..., 3) of frames (..., 3, 3) that turn at a rate (..., 3, 3)."""
    skew = turning @ np.swapaxes(frame, -1, -2)
    return np.stack([skew[..., 2, 1], skew[..., 0, 2], skew[..., 1, 0]], axis=-1)


# Positions ----------------------------------------------------------------------------------------


def test_the_limbs_close_and_the_revolute_axes_stand_across_them(
    machines: list[Spr3], rng: np.random.Generator
) -> None:
    for machine in machines:
        poses = poses_of(machine, rng)
        rotations = machine.rotation(poses)
        fixed, moving, axes = points_of(machine, machine.position(poses), rotations)
        legs = moving - fixed
        lengths = np.linalg.norm(legs, axis=-1)
        np.testing.assert_allclose(machine.inverse_kinematics(poses), lengths, rtol=1e-14)
        np.testing.assert_allclose(np.einsum("nki,nki->nk", legs, axes), 0.0, atol=1e-15)
        identity = rotations @ np.swapaxes(rotations, -1, -2)
        np.testing.assert_allclose(identity, np.broadcast_to(np.eye(3), identity.shape), atol=1e-15)
        np.testing.assert_allclose(rotations[:, 0, 1], rotations[:, 1, 0], atol=1e-16)  # no torsion


@pytest.mark.parametrize(
    ("angles", "place", "lengths"),
    [
        ((0.3, 0.2, 0.55), (0.029183574, -0.103881368), (0.688950665, 0.554250198, 0.588533494)),
        ((-1.0, 0.35, 0.6), (-0.178662448, -0.130944990), (0.696602200, 0.545078635, 0.801429380)),
    ],
)
def test_orientations_with_known_position_and_legs(
    printed: Spr3, angles: tuple, place: tuple, lengths: tuple
) -> None:
    pose = printed.pose_from_angles(np.array(angles))
    np.testing.assert_allclose(printed.position(pose), [*place, angles[2]], atol=1e-9)
    np.testing.assert_allclose(printed.leg_lengths(pose), lengths, atol=1e-9)
    np.testing.assert_allclose(
        np.mod(printed.angles(pose)[0] - angles[0], 2 * np.pi), 0.0, atol=1e-12
    )
    np.testing.assert_allclose(printed.angles(pose)[1:], angles[1:], atol=1e-14)


def test_legs_with_known_pose_and_jacobians(printed: Spr3) -> None:
    pose = printed.forward_kinematics(np.array([0.60, 0.62, 0.65]))
    np.testing.assert_allclose(
        printed.position(pose), [-0.03649118, 0.01584506, 0.5719496], atol=1e-8
    )
    psi, theta, _ = printed.angles(pose)
    assert (psi, theta) == pytest.approx((4.31566593, 0.06979780), abs=1e-8)
    assert pose[2] == pytest.approx(0.57333124, abs=1e-8)
    J = printed.inverse_jacobian(pose)
    np.testing.assert_allclose(J[0], [0.31198221, -0.60800173, 0.95223575], atol=1e-8)
    along = limb_frames(printed, pose)[0, :, 2]
    np.testing.assert_allclose(
        along @ printed.limb_jacobians(pose)[0], [-0.61101751, -0.30282710, -0.03121887], atol=1e-8
    )
    local = printed.local_indices(pose)
    assert local["det"] == pytest.approx(1.27234213, abs=1e-8)
    assert local["lci"] == pytest.approx(0.55995968, abs=1e-8)


def test_corrected_equations_6_and_7(printed: Spr3, rng: np.random.Generator) -> None:
    a, b = printed.a, printed.b
    psi, theta, z = rng.uniform([-3.0, 0.01, 0.4], [3.0, 0.6, 0.8], (200, 3)).T
    pose = printed.pose_from_angles(np.stack([psi, theta, z], axis=-1))
    (ux, vx, wx), (uy, vy, wy), (_, _, wz) = np.moveaxis(printed.rotation(pose), 0, -1)
    x = (b * vy * (vy - ux) - 2 * b * uy * vx + 2 * z * wx) / (2 * wz)
    y = (b * vx * (3 * ux - vy) + 2 * z * wy) / (2 * wz)
    np.testing.assert_allclose(printed.position(pose), np.stack([x, y, z], axis=-1), atol=1e-14)
    k = a**2 + b**2 + x**2 + y**2 + z**2
    root = np.sqrt(3.0)
    squares = [
        k + b * x - root * b * y - 2 * a * b * vy + 2 * root * a * b * vx,
        k + b * x + root * b * y - 2 * a * b * vy - 2 * root * a * b * vx,
        k - 2 * b * x - 3 * a * b * ux + a * b * vy,
    ]
    np.testing.assert_allclose(printed.leg_lengths(pose) ** 2, np.stack(squares, -1), atol=1e-14)


def test_newton_from_home_reaches_the_whole_joint_box(printed: Spr3) -> None:
    rng = np.random.default_rng(12)
    joints = np.concatenate([
        joints_of(printed, rng, 500),
        list(itertools.product((printed.q_min, printed.q_max), repeat=3)),
    ])  # fmt: skip
    for q in joints:
        hx, hy, s, iterations = kinematics.pose_near(*printed.home, *q, printed.a, printed.b)
        assert 1 <= iterations <= 6
        np.testing.assert_allclose(
            printed.leg_lengths(np.array([hx, hy, s])), q, rtol=0.0, atol=1e-13
        )


def test_forward_kinematics_from_home_undoes_inverse_kinematics(
    machines: list[Spr3], rng: np.random.Generator
) -> None:
    for machine in machines:
        joints = joints_of(machine, rng)
        poses = machine.forward_kinematics(joints)
        np.testing.assert_allclose(machine.inverse_kinematics(poses), joints, rtol=0.0, atol=1e-13)
        near = machine.forward_kinematics(joints, near=poses[::-1])
        np.testing.assert_allclose(near, poses, rtol=0.0, atol=1e-11)


def test_a_position_has_its_pose(machines: list[Spr3], rng: np.random.Generator) -> None:
    for machine in machines:
        poses = poses_of(machine, rng)
        np.testing.assert_allclose(machine.pose_at(machine.position(poses)), poses, atol=1e-12)


def test_legs_too_short_to_meet_the_platforms_have_no_pose() -> None:
    flat = Spr3(a=0.1, b=0.7, q_min=0.4, q_max=0.55)
    assert np.isnan(flat.home).any()
    assert np.isnan(flat.forward_kinematics(np.full(3, 0.5))).all()


def test_a_leg_out_of_its_range_is_out_of_reach(printed: Spr3) -> None:
    tilted = printed.forward_kinematics(np.array([0.5, 0.5, 0.7501]))
    assert np.isfinite(tilted).all()
    assert np.isnan(printed.inverse_kinematics(tilted)).all()
    assert np.isfinite(printed.inverse_jacobian(tilted)).all()


def test_legs_in_the_wrong_order_are_refused() -> None:
    with pytest.raises(ValueError, match=r"q_max is 0.5 m: it must be finite and greater than q_m"):
        Spr3(a=0.2, b=0.4, q_min=0.5, q_max=0.5)


# Assembly modes -----------------------------------------------------------------------------------


def multistart(q: np.ndarray, a: float, b: float, starts: np.ndarray) -> int:
    """How many real poses Newton finds from starts (n, 3) of the three angles at the R joints."""
    pairs = ((0, 1), (1, 2), (2, 0))

    def gaps(angles: np.ndarray) -> np.ndarray:
        points = np.stack([
            (a + q * np.cos(angles)) * np.cos(AZIMUTHS),
            (a + q * np.cos(angles)) * np.sin(AZIMUTHS),
            q * np.sin(angles),
        ], axis=-1)  # fmt: skip
        sides = [((points[:, i] - points[:, j]) ** 2).sum(axis=-1) for i, j in pairs]
        return np.stack(sides, axis=-1) - 3.0 * b**2

    angles = starts
    for _ in range(40):
        step = 1e-30
        slopes = np.stack([gaps(angles + 1j * step * e).imag / step for e in np.eye(3)], axis=-1)
        moves = np.einsum("nij,nj->ni", np.linalg.pinv(slopes), gaps(angles).real)
        angles = angles - np.clip(moves, -0.5, 0.5)
    found = angles[np.abs(gaps(angles)).max(axis=1) < 1e-11]
    different: list[np.ndarray] = []
    for row in found:
        if all(np.abs(np.sin(0.5 * (row - other))).max() > 1e-6 for other in different):
            different.append(row)
    return len(different)


def test_known_legs_have_four_assembly_modes(printed: Spr3) -> None:
    q = np.array([0.60, 0.62, 0.65])
    modes = printed.all_assembly_modes(q)
    assert len(modes.positions) == 4
    tilts = np.degrees(np.arccos(modes.rotations[:, 2, 2]))
    np.testing.assert_allclose(np.sort(tilts), [4.0, 4.0, 109.82, 109.82], atol=0.005)
    home = printed.forward_kinematics(q)
    np.testing.assert_allclose(modes.positions[0], printed.position(home), atol=1e-12)
    np.testing.assert_allclose(modes.rotations[0], printed.rotation(home), atol=1e-12)


def test_assembly_modes_close_the_limbs_in_both_operation_modes() -> None:
    rng = np.random.default_rng(3)
    seen, counts = set(), set()
    for _ in range(60):
        a, b = rng.uniform(0.05, 0.8, 2)
        q = rng.uniform(0.3, 1.2, 3)
        machine = Spr3(a=a, b=b, q_min=0.3, q_max=1.2)
        modes = machine.all_assembly_modes(q)
        fixed, moving, axes = points_of(machine, modes.positions, modes.rotations)
        np.testing.assert_allclose(
            np.linalg.norm(moving - fixed, axis=-1),
            np.broadcast_to(q, moving.shape[:2]),
            atol=1e-10,
        )
        np.testing.assert_allclose(np.einsum("nki,nki->nk", moving - fixed, axes), 0.0, atol=1e-10)
        traces = modes.rotations[:, 0, 0] + modes.rotations[:, 1, 1]
        np.testing.assert_array_equal(modes.operation_mode == 1, traces >= 0.0)
        seen |= set(modes.operation_mode)
        counts.add(len(modes.positions))
    assert seen == {1, 2}
    assert {0, 4, 8} <= counts <= {0, 4, 8, 12, 16}


@pytest.mark.parametrize("kind", ["equal", "two equal", "different"])
def test_assembly_modes_are_complete(kind: str) -> None:
    rng = np.random.default_rng(8)
    for _ in range(6):
        a, b = rng.uniform(0.05, 0.8, 2)
        q = rng.uniform(0.3, 1.2, 3)
        if kind != "different":
            q[1:] = q[2]
        if kind == "equal":
            q[0] = q[2]
        expected = multistart(q, a, b, rng.uniform(-np.pi, np.pi, (500, 3)))
        assert len(all_assembly_modes(q, a, b).positions) == expected


# Velocities and forces ----------------------------------------------------------------------------


def test_velocity_of_the_platform(machines: list[Spr3], rng: np.random.Generator) -> None:
    for machine in machines:
        poses = poses_of(machine, rng)
        slopes = derivative(machine.position, poses)
        rates = rng.normal(size=poses.shape)
        expected = np.einsum("nij,nj->ni", slopes, rates)
        np.testing.assert_allclose(machine.twist(poses, rates), expected, rtol=0.0, atol=1e-8)


def test_angular_velocities_of_platform_and_limbs(
    machines: list[Spr3], rng: np.random.Generator
) -> None:
    for machine in machines:
        poses = poses_of(machine, rng)
        velocity = np.stack(
            [machine.twist(poses, np.broadcast_to(e, poses.shape)) for e in np.eye(3)], axis=-1
        )
        turning = derivative(machine.rotation, poses)
        rotation = machine.rotation(poses)
        omega = np.stack([spin(turning[..., k], rotation) for k in range(3)], axis=-1)
        found = machine.angular_jacobian(poses) @ velocity
        assert (np.abs(found - omega) / np.abs(omega).max()).max() <= 1e-8
        turning = derivative(lambda p, m=machine: limb_frames(m, p), poses)
        frames = limb_frames(machine, poses)
        omega = np.stack([spin(turning[..., k], frames) for k in range(3)], axis=-1)
        found = machine.limb_jacobians(poses) @ velocity[:, None]
        assert (np.abs(found - omega) / np.abs(omega).max()).max() <= 1e-8


def test_the_jacobian_is_that_of_the_six_by_six_system(
    machines: list[Spr3], rng: np.random.Generator
) -> None:
    for machine in machines:
        poses = poses_of(machine, rng)
        position, rotation = machine.position(poses), machine.rotation(poses)
        fixed, moving, axes = points_of(machine, position, rotation)
        legs = moving - fixed
        legs /= np.linalg.norm(legs, axis=-1, keepdims=True)
        arms = moving - position[:, None]
        drives = np.concatenate([legs, np.cross(arms, legs)], axis=-1)
        held = np.concatenate([axes, np.cross(fixed - position[:, None], axes)], axis=-1)
        inverse = np.linalg.inv(np.concatenate([drives, held], axis=-2))
        expected = inverse[:, :3, :3]
        np.testing.assert_allclose(machine.jacobian(poses), expected, rtol=0.0, atol=1e-11)
        omega = inverse[:, 3:, :3] @ machine.inverse_jacobian(poses)
        np.testing.assert_allclose(
            machine.angular_jacobian(poses), omega, rtol=0.0, atol=1e-11 / machine.b
        )


def test_two_rotations_and_one_translation(machines: list[Spr3], rng: np.random.Generator) -> None:
    for machine in machines:
        poses = poses_of(machine, rng)
        J_c, normal = machine.angular_jacobian(poses), machine.rotation(poses)[..., 2]
        np.testing.assert_allclose(np.einsum("nij,nj->ni", J_c, normal), 0.0, atol=1e-12)
        bisector = np.add(normal, [0.0, 0.0, 1.0])
        np.testing.assert_allclose(np.einsum("ni,nij->nj", bisector, J_c), 0.0, atol=1e-11)
        # the platform's normal through O_A passes the base's centre at p = (b/2)(1 - cos tilt)
        r = machine.position(poses)
        offset = np.linalg.norm(np.cross(r, normal), axis=-1)
        np.testing.assert_allclose(machine.local_indices(poses)["parasitic"], offset, atol=1e-14)


def test_level_poses_swing_about_the_base_and_are_isotropic_at_one_height(printed: Spr3) -> None:
    for z in (0.25, printed.b / np.sqrt(2.0), 0.575):
        J_c = printed.angular_jacobian(np.array([0.0, 0.0, z]))
        np.testing.assert_allclose(J_c, [[0, -1 / z, 0], [1 / z, 0, 0], [0, 0, 0]], atol=1e-12)
        lci = printed.local_indices(np.array([0.0, 0.0, z]))["lci"]
        ratio = printed.b / (np.sqrt(2.0) * z)
        assert lci == pytest.approx(min(ratio, 1.0 / ratio), rel=1e-7)


def test_leg_forces_do_the_work_of_the_load(machines: list[Spr3], rng: np.random.Generator) -> None:
    for machine in machines:
        poses = poses_of(machine, rng)
        force, moment = rng.normal(size=(2, *poses.shape))
        tau = machine.actuator_forces(poses, force, moment)
        velocity = machine.twist(poses, rng.normal(size=poses.shape))
        omega = np.einsum("nij,nj->ni", machine.angular_jacobian(poses), velocity)
        rates = np.einsum("nij,nj->ni", machine.inverse_jacobian(poses), velocity)
        power = (tau * rates).sum(-1) + (force * velocity).sum(-1) + (moment * omega).sum(-1)
        scale = np.abs(tau * rates).sum(-1) + 1.0
        np.testing.assert_allclose(power / scale, 0.0, atol=1e-12)


def test_a_hanging_weight_pulls_the_legs_alike(printed: Spr3) -> None:
    tau = printed.actuator_forces(printed.home, np.array([0.0, 0.0, 9.81]))
    np.testing.assert_allclose(tau, tau[0], rtol=1e-12)
    assert tau[0] == pytest.approx(-9.81 * printed.q_c / (3.0 * printed.home[2]), rel=1e-12)


# Singularities ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("azimuth", "tilt"), [(0.0, 60.5), (30.0, 76.7), (60.0, 136.0)])
def test_parallel_singularities_of_the_printed_machine(
    printed: Spr3, azimuth: float, tilt: float
) -> None:
    tilts = np.radians(np.arange(1.0, 160.0, 0.05))
    direction = np.radians(azimuth)
    h = np.tan(0.5 * tilts)
    poses = np.stack([h * np.cos(direction), h * np.sin(direction), 0.575 + 0 * h], axis=-1)
    steps = derivative(lambda p: printed.leg_lengths(p) ** 2, poses)
    first = tilts[np.flatnonzero(np.linalg.det(steps) < 0.0)[0]]
    assert np.degrees(first) == pytest.approx(tilt, abs=0.1 if azimuth < 50.0 else 0.5)


def test_the_fold_of_the_printed_machine(printed: Spr3) -> None:
    tilts = np.radians(np.arange(60.0, 100.0, 0.05))
    margins = []
    for azimuth in np.radians(np.arange(0.0, 61.0, 5.0)):
        h = np.tan(0.5 * tilts)
        poses = np.stack([h * np.cos(azimuth), h * np.sin(azimuth), 0.575 + 0 * h], axis=-1)
        margins.append(printed.local_indices(poses)["fold"])
        slopes = np.linalg.det(derivative(printed.position, poses))
        clear = np.abs(margins[-1]) > 1e-3
        np.testing.assert_array_equal((slopes > 0.0)[clear], (margins[-1] > 0.0)[clear])
    first = tilts[(np.array(margins) < 0.0).any(axis=0)][0]
    assert np.degrees(first) == pytest.approx(82.7, abs=0.1)


def test_a_singularity_bars_the_way(printed: Spr3) -> None:
    for lam, free in ((0.4914, True), (0.4919, False)):
        wide = replace(printed, q_min=printed.q_c * (1 - lam), q_max=printed.q_c * (1 + lam))
        corner = np.array([wide.q_min, wide.q_max, wide.q_max])
        assert np.isfinite(wide.forward_kinematics(corner)).all() == free


def test_big_steps_end_on_the_branch_of_small_ones() -> None:
    rng = np.random.default_rng(17)
    followed = 0
    for _ in range(1500):
        a, b = rng.uniform(0.05, 1.6, 2)
        q_c, lam = rng.uniform(0.3, 2.4), rng.uniform(0.02, 0.5)
        if q_c <= abs(b - a):
            continue
        q = q_c * (1.0 + lam * rng.uniform(-1.0, 1.0, 3))
        home = (0.0, 0.0, kinematics.level(q_c, a, b))
        *pose, done = kinematics.follow(*home, q_c, q_c, q_c, *q, a, b)
        here, at = home, np.full(3, q_c)
        for t in np.linspace(0.0, 1.0, 65)[1:]:
            there = q_c + t * (q - q_c)
            *here, share = kinematics.follow(*here, *at, *there, a, b)
            at = there
            if share < 1.0:
                break
        if done == 1.0 and share == 1.0:
            followed += 1
            np.testing.assert_allclose(pose, here, rtol=0.0, atol=1e-9)
    assert followed > 800


# The workspace ------------------------------------------------------------------------------------


def test_the_volume_three_ways(printed: Spr3) -> None:
    volume = volume_by_quadrature(printed)
    assert volume == pytest.approx(0.012436761434573, rel=1e-10)
    assert volume_by_quadrature(printed, 3) == pytest.approx(volume, rel=1e-6)
    assert volume_by_surfaces(printed) == pytest.approx(volume, rel=2e-5)
    assert volume_by_voxels(printed) == pytest.approx(volume, rel=1e-3)
    assert REFERENCE["volume"].ours == pytest.approx(volume, rel=REFERENCE["volume"].tolerance)


def test_the_extent_of_the_printed_workspace(printed: Spr3) -> None:
    surface = envelope(printed)
    assert surface.heights == pytest.approx((0.4359, 0.7089), abs=5e-5)
    assert surface.radius == pytest.approx(0.2435, abs=5e-5)
    assert np.degrees(surface.tilt.max()) == pytest.approx(25.370, abs=5e-4)


def test_the_envelope_is_a_closed_mesh_that_other_programs_read(
    printed: Spr3, tmp_path: Path
) -> None:
    surface = envelope(printed, 0.025)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.euler_number == 2
    assert mesh.volume == pytest.approx(surface.volume, rel=1e-12)
    assert set(surface.family) == {1, 2, 3, 4, 5, 6}
    corners = surface.vertices[surface.faces[surface.family == 4]].reshape(-1, 3)
    longest = printed.inverse_kinematics(printed.pose_at(corners))[:, 1]
    np.testing.assert_allclose(longest, printed.q_max, rtol=1e-12)
    again = trimesh.load(surface.write(tmp_path / "workspace.stl"))
    assert again.volume == pytest.approx(surface.volume, rel=1e-5)
    with pytest.raises(ValueError, match=r"name ends in stl"):
        surface.write(tmp_path / "workspace.doc")


def test_a_workspace_with_a_singularity_has_no_envelope(printed: Spr3) -> None:
    swapped = replace(printed, a=printed.b, b=printed.a)
    with pytest.raises(ValueError, match="parallel singularity"):
        envelope(swapped)
    assert np.isnan(volume_by_quadrature(swapped))


def test_the_section_is_what_the_envelope_has_in_its_plane(printed: Spr3) -> None:
    outline = printed.workspace()
    surface = envelope(printed)
    mesh = trimesh.Trimesh(surface.vertices, surface.faces)
    cut = mesh.section(plane_origin=[0.0, 0.0, 0.5], plane_normal=[0.0, 1.0, 0.0])
    assert len(cut.discrete) == 1
    flat = cut.discrete[0][:, [0, 2]]
    assert flat.min(axis=0) == pytest.approx(outline.min(axis=0), abs=1e-4)
    assert flat.max(axis=0) == pytest.approx(outline.max(axis=0), abs=1e-4)
    assert area(flat) == pytest.approx(area(outline), rel=1e-3)


def area(polygon: np.ndarray) -> float:
    (x, z), (next_x, next_z) = polygon[:-1].T, polygon[1:].T
    return 0.5 * abs((x * next_z - next_x * z).sum())


# The path of Fig. 2 -------------------------------------------------------------------------------


def test_the_printed_path_needs_longer_and_shorter_legs(printed: Spr3) -> None:
    R, h = REFERENCE["path_R"].printed, REFERENCE["path_h"].printed
    assert R is not None and h is not None  # noqa: PT018 (both are printed)
    for gamma, expected in ((0.0, (0.259, 0.991)), (30.0, (0.297, 0.954)), (90.0, (0.297, 0.954))):
        path = best_place(printed, R, h, np.radians(gamma))
        assert needed_range(printed, path) == pytest.approx(expected, abs=1e-3)
        assert path.z_across == pytest.approx(0.38, abs=0.005)


def test_the_largest_cylinder_touches_both_ends_of_the_legs(printed: Spr3) -> None:
    radius, height, z_c = largest_cylinder(printed)
    assert radius == pytest.approx(REFERENCE["path_R"].ours, rel=1e-6)
    assert height == pytest.approx(REFERENCE["path_h"].ours, rel=1e-6)
    assert (z_c - 0.5 * height, z_c + 0.5 * height) == pytest.approx((0.5334, 0.5990), abs=5e-5)
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    rims = [
        np.stack([radius * np.cos(turn), radius * np.sin(turn), z + 0 * turn], axis=-1)
        for z in (z_c - 0.5 * height, z_c + 0.5 * height)
    ]
    lengths = printed.leg_lengths(printed.pose_at(np.concatenate(rims)))
    assert (lengths.min(), lengths.max()) == pytest.approx((printed.q_min, printed.q_max), abs=1e-7)


@pytest.mark.parametrize(
    ("gamma", "peaks"), [(0.0, (12.17, 12.17, 13.00)), (150.0, (12.78, 11.34, 12.78))]
)
def test_leg_rates_along_the_largest_path(printed: Spr3, gamma: float, peaks: tuple) -> None:
    radius, height, z_c = largest_cylinder(printed)
    speed, acceleration = REFERENCE["speed"].printed, REFERENCE["acceleration"].printed
    path = GatePath(
        radius * (1.0 - 1e-7), z_c + 0.5 * height, z_c - 0.5 * height, np.radians(gamma)
    )
    moved = motion(printed, path, speed, acceleration, samples=6001)
    np.testing.assert_allclose(np.abs(1e3 * moved.rates).max(axis=0), peaks, atol=0.006)
    np.testing.assert_allclose(
        np.gradient(moved.lengths, moved.times, axis=0, edge_order=2), moved.rates, atol=2e-6
    )
    assert np.linalg.norm(moved.velocities, axis=1).max() == pytest.approx(speed, rel=1e-6)
    np.testing.assert_allclose(moved.positions[[0, -1]], path.corners[[0, -1]], atol=1e-15)


def test_revolute_axes_and_joints_at_the_printed_azimuths() -> None:
    for i in range(3):
        phi, theta = (REFERENCE[f"{name}_{i + 1}"].printed for name in ("phi", "theta"))
        assert phi is not None and theta is not None  # noqa: PT018 (both are printed)
        axis = np.array([np.cos(theta), np.sin(theta), 0.0])
        assert abs(axis @ TANGENTIAL[i]) == pytest.approx(1.0, rel=1e-12)
        assert np.linalg.norm(axis) == pytest.approx(REFERENCE["c_length"].printed, rel=1e-12)
        np.testing.assert_allclose(RADIAL[i], [np.cos(phi), np.sin(phi), 0.0], atol=1e-15)
        assert (kinematics.COS[i], kinematics.SIN[i]) == pytest.approx(tuple(RADIAL[i, :2]))


def test_a_machine_that_reaches_nothing_is_still_drawn() -> None:
    flat = Spr3(a=0.1, b=0.7, q_min=0.4, q_max=0.55)
    np.testing.assert_array_equal(flat.workspace(), [[0.0, flat.q_c], [0.0, flat.q_c]])
    assert np.isnan(flat.links(flat.sample_poses()[0])[-1].points).all()
    assert np.isfinite(flat.links(flat.sample_poses()[0])[0].points).all()


def test_links_are_the_limbs(printed: Spr3) -> None:
    pose = printed.forward_kinematics(np.array([0.60, 0.62, 0.65]))
    links = printed.links(pose)
    fixed, moving, _ = points_of(printed, printed.position(pose), printed.rotation(pose))
    rods = [link.points for link in links if link.role == "rod"]
    cylinders = [link.points for link in links if link.role == "arm"]
    for i in range(3):
        np.testing.assert_allclose(cylinders[i][0], fixed[i], atol=1e-15)
        np.testing.assert_allclose(rods[i][1], moving[i], atol=1e-15)
        lengths = [np.linalg.norm(np.diff(part[i], axis=0)) for part in (cylinders, rods)]
        assert sum(lengths) == pytest.approx((0.60, 0.62, 0.65)[i], rel=1e-12)
        assert lengths[0] < printed.q_min
