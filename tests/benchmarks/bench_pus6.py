"""The 6-PUS: poses and designs a second, the paper's atlas, the nodes, against batched NumPy.

NumPy computes the same six indices with stacks of 6x6 matrices: its inverse, its products and its
singular values.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms.pus6.indices import (
    BLOCK,
    LOCAL,
    POSE_WORK,
    STATE,
    states_of,
    tabulate,
    unit_poses,
)
from pkm_gym.mechanisms.pus6.lattice import averages, lattice_states
from pkm_gym.mechanisms.pus6.limits import PER_NODE, node_extremes, nodes
from pkm_gym.mechanisms.pus6.mechanism import NAMES, Pus6

PLAIN = "pus6: six indices, batched NumPy, 2048 poses"
HALF = np.array([0.05, 0.05, *np.radians([10.0, 10.0, 10.0])])
ACROSS = np.linalg.svd(np.ones((1, 6)))[2][1:].T  # five directions across (1, ..., 1)


# The same in NumPy --------------------------------------------------------------------------------


def plain(machine: Pus6, poses: np.ndarray) -> np.ndarray:
    """1/K of the six indices (6, n) at poses (n, 6)."""
    legs = legs_of(machine, poses)
    arms, rods = legs[..., :3], legs[..., 3:]
    drops = rods[..., 2:]
    inverse = np.concatenate([np.cross(arms, rods), rods], axis=-1) / drops
    G = np.linalg.inv(inverse)
    H = ACROSS.T @ second(arms, rods, G) @ ACROSS
    kappa = [condition(G[:, part]) for part in (slice(0, 3), slice(3, 6))]
    bent = condition(H)
    tilted = [np.sqrt((bent[:, part] ** 2).sum(axis=1)) for part in (slice(0, 3), slice(3, 6))]
    scaled = G * np.repeat([0.01, 1.0], 3)[:, None]
    norms = np.linalg.norm(H, axis=(2, 3)) * np.repeat([1e-4, 1e-2], 3)
    size = np.linalg.norm(scaled, axis=(1, 2))
    back = np.linalg.norm(inverse / np.repeat([0.01, 1.0], 3), axis=(1, 2))
    return np.stack([
        1.0 / kappa[0], 1.0 / kappa[1],
        *(1.0 / (0.02 * k + 0.0404 * h) for k, h in zip(kappa, tilted, strict=True)),
        1.0 / (size * back), 1.0 / (size + np.linalg.norm(norms, axis=1)),
    ])  # fmt: skip


def legs_of(machine: Pus6, poses: np.ndarray) -> np.ndarray:
    """Arms and rods (n, 6, 6)."""
    layout = machine.layout.reshape(6, 5)
    (ca, cb, cg), (sa, sb, sg) = np.cos(poses[:, 3:]).T, np.sin(poses[:, 3:]).T
    R = np.stack([
        cb * cg, -cb * sg, sb,
        ca * sg + sa * sb * cg, ca * cg - sa * sb * sg, -sa * cb,
        sa * sg - ca * sb * cg, sa * cg + ca * sb * sg, ca * cb,
    ], axis=-1).reshape(-1, 3, 3)  # fmt: skip
    arms = layout[:, :3] @ np.swapaxes(R, 1, 2)
    flat = poses[:, None, :2] + arms[..., :2] - layout[:, 3:]
    drops = np.sqrt(machine.L**2 - (flat**2).sum(axis=-1, keepdims=True))
    return np.concatenate([arms, flat, -drops], axis=-1)


def second(arms: np.ndarray, rods: np.ndarray, G: np.ndarray) -> np.ndarray:
    """H (n, 6, 6, 6) in the influence convention."""
    w = G[:, None, :3]
    moved = G[:, None, 3:] + np.cross(np.swapaxes(w, 2, 3), arms[:, :, None]).swapaxes(2, 3)
    moved[:, range(6), 2, range(6)] -= 1.0
    outer = rods[..., :, None] * arms[..., None, :]
    middle = np.einsum("nkii->nk", outer)[..., None, None] * np.eye(3)
    middle -= 0.5 * (outer + np.swapaxes(outer, 2, 3))
    Q = np.swapaxes(w, 2, 3) @ middle @ w - np.swapaxes(moved, 2, 3) @ moved
    H = np.einsum("nki,nipq->nkpq", G / rods[:, None, :, 2], Q, optimize=True)
    for k, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
        turned = G[:, a, :, None] * G[:, b, None, :]
        H[:, k] += 0.5 * (turned - np.swapaxes(turned, 1, 2))
    return H


def condition(matrices: np.ndarray) -> np.ndarray:
    sigma = np.linalg.svd(matrices, compute_uv=False)
    return np.sqrt((sigma**2).sum(axis=-1) * (sigma**-2.0).sum(axis=-1))


# Poses --------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def machine() -> Pus6:
    return Pus6(L=0.46, R=0.19)


def box(n: int) -> np.ndarray:
    """Poses (n, 6) of the default box."""
    return np.insert(HALF * unit_poses(n), 2, 0.0, axis=1)


def compiled(machine: Pus6, n: int) -> tuple[Any, ...]:
    """What ``tabulate`` takes for n poses."""
    states = states_of(HALF * unit_poses(n))[None]
    table = np.empty((1, states.shape[1], LOCAL * BLOCK))
    square, length = np.array([machine.L**2]), np.array([0.01])
    return states, machine.layout[None], square, length, 1.0, table


def timed(
    benchmark: Any, row: str, n: int, function: Callable, *arguments: Any, **info: Any
) -> None:
    benchmark.extra_info.update({"row": row, "unit": "poses", "count": n, **info})
    benchmark.pedantic(function, arguments, rounds=20, warmup_rounds=2)


def test_numpy(benchmark: Any, machine: Pus6) -> None:
    found, expected = plain(machine, box(2048)), machine.local_indices(box(2048))
    for values, name in zip(found, NAMES, strict=True):
        np.testing.assert_allclose(values, expected[name], rtol=1e-6, atol=1e-10)
    timed(benchmark, PLAIN, 2048, plain, machine, box(2048))


@pytest.mark.parametrize("n", [2048, 65536])
def test_one_core(benchmark: Any, machine: Pus6, n: int) -> None:
    row = f"pus6: six indices, {n} poses, one core"
    timed(benchmark, row, n, tabulate.serial, *compiled(machine, n), versus={PLAIN: "NumPy"},
          target=">= 2 million poses/s")  # fmt: skip


@pytest.mark.parametrize("n", [2048, 65536])
def test_all_cores(benchmark: Any, machine: Pus6, n: int) -> None:
    row = f"pus6: six indices, {n} poses, all cores"
    arguments = (POSE_WORK * n, *compiled(machine, n))
    timed(benchmark, row, n, tabulate, *arguments, versus={PLAIN: "NumPy"})


def test_nodes(benchmark: Any, machine: Pus6) -> None:
    state, out = np.empty(STATE * BLOCK), np.empty(PER_NODE * BLOCK)
    arguments = (
        nodes(), 0.05, HALF[2], HALF[4], machine.layout, machine.L**2, state, out,
    )  # fmt: skip
    benchmark.extra_info.update({"row": "pus6: limits at the 162 nodes", "target": "<= 50 µs"})
    benchmark.pedantic(node_extremes, arguments, rounds=500, iterations=10, warmup_rounds=5)


# Designs ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampling", ["coarse", "default", "fine"])
def test_one_design(benchmark: Any, sampling: str) -> None:
    problem = pkm_gym.make_problem("pus6", sampling=sampling)
    design = np.array([[0.46, 0.19]])
    targets = {"coarse": "<= 150 µs", "default": "<= 400 µs", "fine": "<= 12 ms"}
    benchmark.extra_info.update({
        "row": f"pus6: one design, evaluate, {sampling}", "target": targets[sampling],
    })  # fmt: skip
    benchmark.pedantic(problem.evaluate, (design,), rounds=200, warmup_rounds=5)


@pytest.mark.parametrize("name", ["pus6", "pus6_layout"])
def test_evaluate(benchmark: Any, name: str) -> None:
    problem: DesignProblem = pkm_gym.make_problem(name)
    rng = np.random.default_rng(0)
    designs = problem.low + (problem.high - problem.low) * rng.random((256, len(problem.low)))
    benchmark.extra_info.update({
        "row": f"{name}: evaluate, 256 designs, all cores", "unit": "designs", "count": 256,
    })  # fmt: skip
    benchmark.pedantic(problem.evaluate, (designs,), rounds=20, warmup_rounds=2)


def atlas(machines: list[Pus6]) -> list[Any]:
    return [averages(one.layout, one.L, 0.01, 1.0) for one in machines]


def test_the_papers_atlas(benchmark: Any) -> None:
    grid = itertools.product(range(45, 56), range(10, 21))
    machines = [Pus6(L=0.01 * L, R=0.01 * R) for L, R in grid]
    lattice_states()
    assert sum(found.poses for found in atlas(machines)) == 4_138_504
    benchmark.extra_info.update({
        "row": "pus6: the paper's atlas, 121 designs over its lattice", "target": "<= 3 s",
    })  # fmt: skip
    benchmark.pedantic(atlas, (machines,), rounds=5, warmup_rounds=1)
