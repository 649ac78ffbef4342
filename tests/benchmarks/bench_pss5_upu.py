"""The 5-PSS/UPU: poses and designs a second, the nodes with all clearances, against batched NumPy.

NumPy computes the same four indices with stacks of 5x5 matrices: its inverse and its singular
values.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms.pss5_upu.clearances import fill_clearances
from pkm_gym.mechanisms.pss5_upu.conditioning import fill_rcond
from pkm_gym.mechanisms.pss5_upu.extremes import SKEW_EXTREMES, fill_quality, fill_ranges, nodes
from pkm_gym.mechanisms.pss5_upu.indices import MEANS, fill_sums, unit_poses
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

PLAIN = "pss5_upu: four indices, batched NumPy, 4096 poses"
POSES = 4096
OFFSETS = dict(zip(("a2", "a3", "b2", "b3"), np.radians([5.0, 26.0, 42.0, -10.0]), strict=True))


@pytest.fixture(scope="module")
def machine() -> Pss5Upu:
    return Pss5Upu(r=0.358, R=0.633, L=0.509, theta=np.radians(56.2), lam0=0.97, **OFFSETS)


def plain(machine: Pss5Upu, poses: np.ndarray) -> np.ndarray:
    """K_v, K_w, K_lambda, K_eta (4, n) at poses (n, 5), with the UPU limb's yaw."""
    x, y, z, beta, gamma = poses.T
    sb, cb, sg, cg = np.sin(beta), np.cos(beta), np.sin(gamma), np.cos(gamma)
    sa = -y / z * sb / cb
    ca = np.sqrt(1.0 - sa * sa)
    u = np.stack([ca * cb, sa * cb, -sb], axis=-1)
    w = np.stack([ca * sb * sg - sa * cg, sa * sb * sg + ca * cg, cb * sg], axis=-1)
    layout = machine.layout.reshape(5, 7)
    arms = layout[:, :1] * u[:, None] + layout[:, 1:2] * w[:, None]
    d = poses[:, None, :3] + arms - np.pad(layout[:, 2:4], ((0, 0), (0, 1)))
    along = np.einsum("nij,ij->ni", d, layout[:, 4:])
    root = np.sqrt(machine.L**2 - (d * d).sum(axis=-1) + along * along)
    f = (d - (along - root)[..., None] * layout[:, 4:]) / machine.L
    m = np.cross(arms, f)
    none = np.zeros_like(x)
    about = np.stack([-sa, ca, none], axis=-1)
    yaw = np.stack([
        u[:, 2], -u[:, 1], -(sa * (u[:, 1] * y + u[:, 2] * z) + ca * u[:, 0] * y)
    ]) / (u[:, 0] * z)  # fmt: skip
    rows = np.concatenate([f, np.einsum("nij,nj->ni", m, u)[..., None],
                           np.einsum("nij,nj->ni", m, about)[..., None]], axis=-1)  # fmt: skip
    rows[..., 1] += yaw[0, :, None] * m[..., 2]
    rows[..., 2] += yaw[1, :, None] * m[..., 2]
    rows[..., 4] += yaw[2, :, None] * m[..., 2]
    motions = np.linalg.inv(rows)
    J = motions * (root / machine.L)[:, None]
    v, t = (np.linalg.svd(part, compute_uv=False) for part in (J[:, :3], J[:, 3:]))
    omega = motions[:, 3, :, None] * u[:, None] + motions[:, 4, :, None] * about[:, None]
    omega[..., 2] += np.einsum("kn,nki->ni", yaw, motions[:, [1, 2, 4]])
    speeds = np.swapaxes(motions[:, :3], 1, 2) + np.cross(omega, arms)
    eta = 1.0 / np.linalg.norm(speeds, axis=-1)
    return np.stack([
        v[:, 2] / v[:, 0], t[:, 1] / t[:, 0], root.min(axis=1) / machine.L, eta.min(axis=1)
    ])  # fmt: skip


def timed(
    benchmark: Any, row: str, n: int, function: Callable, *arguments: Any, **info: Any
) -> None:
    benchmark.extra_info.update({"row": row, "unit": "poses", "count": n, **info})
    benchmark.pedantic(function, arguments, rounds=20, warmup_rounds=2)


def box(machine: Pss5Upu) -> np.ndarray:
    half = (machine.x, machine.y, machine.z, machine.beta, machine.gamma)
    return np.array([[0.0, machine.z0, *half]])


def test_numpy(benchmark: Any, machine: Pss5Upu) -> None:
    poses = machine.in_box(unit_poses(POSES))
    found = plain(machine, poses)
    for values, expected in zip(found, machine.local_indices(poses).values(), strict=True):
        np.testing.assert_allclose(values, expected, rtol=1e-9)
    timed(benchmark, PLAIN, POSES, plain, machine, poses)


def test_one_core(benchmark: Any, machine: Pss5Upu) -> None:
    arguments = (
        unit_poses(POSES), box(machine), machine.layout[None], np.array([machine.L]), 1.0, 1,
        np.empty((1, 1, MEANS)),
    )  # fmt: skip
    row = f"pss5_upu: four indices, {POSES} poses, one core"
    timed(benchmark, row, POSES, fill_sums.serial, *arguments, versus={PLAIN: "NumPy"},
          target=">= 2 million poses/s")  # fmt: skip


def test_nodes(benchmark: Any, machine: Pss5Upu) -> None:
    """Ranges, transmission, determinant, forces, swing and all clearances at 135 poses."""
    at = nodes(), box(machine), machine.layout[None], np.array([machine.L])
    found, clearances = np.empty((1, SKEW_EXTREMES)), np.empty((1, 3))

    def limits() -> None:
        fill_ranges.serial(*at, 1.0, found)
        fill_quality.serial(*at, 1.0, found)
        fill_clearances.serial(*at, np.array([0.55]), 1.0, found, clearances)

    row = "pss5_upu_skew: limits with all clearances at the 135 nodes, one core"
    timed(benchmark, row, 135, limits, target=">= 0.67 million poses/s")


def test_rcond(benchmark: Any, machine: Pss5Upu) -> None:
    at = nodes(), box(machine), machine.layout[None], np.array([machine.L])
    arguments = *at, np.array([machine.r]), 1.0, np.inf, np.ones((1, SKEW_EXTREMES)), np.empty(1)
    row = "pss5_upu_skew: least rcond of the 135 nodes, one core"
    timed(benchmark, row, 135, fill_rcond.serial, *arguments)


@pytest.mark.parametrize("sampling", ["coarse", "default"])
@pytest.mark.parametrize("name", ["pss5_upu", "pss5_upu_skew"])
def test_designs(benchmark: Any, name: str, sampling: str) -> None:
    """1,500 designs near the optimum, so that no pose is out of reach."""
    problem: DesignProblem = pkm_gym.make_problem(name, sampling=sampling)
    best = problem.design(problem.reference.optima["gti"].design)
    spread = 0.02 * (problem.high - problem.low)
    designs = best + spread * np.random.default_rng(0).uniform(-1.0, 1.0, (1500, len(best)))
    targets = {"default": ">= 1 thousand designs/s", "coarse": ">= 4 thousand designs/s"}
    benchmark.extra_info.update({
        "row": f"{name}: evaluate, 1500 designs, {sampling}, all cores", "unit": "designs",
        "count": 1500, "target": targets[sampling],
    })  # fmt: skip
    benchmark.pedantic(problem.evaluate, (designs,), rounds=5, warmup_rounds=1)


@pytest.mark.parametrize("name", ["pss5_upu", "pss5_upu_skew"])
def test_one_design(benchmark: Any, name: str) -> None:
    problem = pkm_gym.make_problem(name)
    design = problem.design(problem.reference.optima["gti"].design)[None]
    benchmark.extra_info.update({"row": f"{name}: one design, evaluate, default"})
    benchmark.pedantic(problem.evaluate, (design,), rounds=200, warmup_rounds=5)
