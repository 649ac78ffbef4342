"""The 3-SPR's design problem: designs a second and the latency of one, against plain NumPy.

Both measure the same poses of the same designs, whose joint boxes hold no isotropic pose;
``evaluate`` reports the R joints' angle, constraints and merit besides.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.sampling import symmetric_cube
from pkm_gym.mechanisms.spr3 import problem as spr3
from pkm_gym.mechanisms.spr3.box import isotropic_leg

DESIGNS = 2048
CHUNK = 64  # designs a chunk: its arrays stay in the cache
STEPS = 6  # of Newton
PLAIN = "gci and extremes, vectorised NumPy"

AZIMUTHS = np.radians([120.0, -120.0, 0.0])
COS, SIN = np.cos(AZIMUTHS), np.sin(AZIMUTHS)
CORNERS = np.array([[-1.0, -1.0, -1.0], [-1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0]])


def plain(designs: np.ndarray, lam: float, nodes: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """gci, volume, parasitic, s_angle, lci_min (n, 5) of designs (n, 2), in units of D."""
    parts = [
        _chunk(designs[i : i + CHUNK], lam, nodes, weights) for i in range(0, len(designs), CHUNK)
    ]
    return np.concatenate(parts)


def _chunk(designs: np.ndarray, lam: float, nodes: np.ndarray, weights: np.ndarray) -> np.ndarray:
    a, r3 = designs.T[..., None, None]
    b = 3.0 - a - r3
    joints = r3 * (1.0 + lam * np.concatenate([CORNERS, nodes]))
    pose = np.zeros_like(joints)
    pose[..., 2] = np.sqrt(r3[..., 0] ** 2 - (b - a)[..., 0] ** 2)
    for _ in range(STEPS):
        radial, normal = _anchors(pose, b)
        arm, (hx, hy, s) = radial - a, np.moveaxis(pose[..., None], -2, 0)
        scale = 1.0 / (1.0 + hx * hx + hy * hy)
        rise = normal + s
        gx = -arm * (4.0 * b * (hx * COS - hy * SIN) + 2.0 * hx * radial)
        gy = arm * (4.0 * b * (hy * COS + hx * SIN) - 2.0 * hy * radial)
        gx += 2.0 * normal * (b * COS - hx * rise)
        gy += 2.0 * normal * (b * SIN - hy * rise)
        slopes = np.stack([gx * scale, gy * scale, -normal], axis=-1)
        misses = 0.5 * (joints**2 - arm**2 - normal**2)
        pose = pose + np.linalg.solve(slopes, misses[..., None])[..., 0]
    radial, normal = _anchors(pose, b)
    length = np.hypot(radial - a, normal)
    along, up = (a - radial) / length, -normal / length
    held = np.stack([-normal * COS, -normal * SIN, radial], axis=-1)
    tangent = np.stack([np.broadcast_to(SIN, up.shape), np.broadcast_to(-COS, up.shape)], axis=-1)
    turn = np.linalg.solve(held, tangent)
    spin = SIN[:, None] * turn[..., None, 0, :] - COS[:, None] * turn[..., None, 1, :]
    in_plane = (
        along[..., None] * np.stack([COS, SIN], axis=-1) + a[..., None] * up[..., None] * spin
    )
    J = np.concatenate([in_plane, up[..., None]], axis=-1)
    sigma = np.linalg.svd(J, compute_uv=False)
    lci, det = sigma[..., 2] / sigma[..., 0], np.abs(np.linalg.det(J))
    h2 = pose[..., 0] ** 2 + pose[..., 1] ** 2
    offset = b[..., 0] * h2 / (1.0 + h2)
    lean = 2.0 * (pose[..., :1] * COS + pose[..., 1:2] * SIN)
    cosine = (up * (1.0 - h2)[..., None] - along * lean) / (1.0 + h2)[..., None]
    parts = weights / det[:, len(CORNERS) :]
    volume = parts.sum(axis=-1)
    mean = (parts * lci[:, len(CORNERS) :]).sum(axis=-1) / volume
    corner = slice(0, len(CORNERS))
    return np.stack([
        mean, volume * (2.0 * lam * r3[:, 0, 0]) ** 3, offset[:, corner].max(axis=-1),
        np.arccos(cosine[:, corner].min(axis=(1, 2))), lci[:, corner].min(axis=-1),
    ], axis=-1)  # fmt: skip


def _anchors(pose: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """B_i as the platform sees it, radially and along its normal, (n, nodes, 3) each."""
    hx, hy, s = np.moveaxis(pose[..., None], -2, 0)
    scale = b / (1.0 + hx * hx + hy * hy)
    radial = scale * (1.0 - 2.0 * ((hx * hx - hy * hy) * COS - 2.0 * hx * hy * SIN))
    return radial, 2.0 * scale * (hx * COS + hy * SIN) - s


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return pkm_gym.make_problem("spr3")


@pytest.fixture(scope="module")
def designs(problem: DesignProblem) -> np.ndarray:
    """Designs without singularity or isotropic pose in their joint box."""
    rng = np.random.default_rng(0)
    drawn = problem.low + (problem.high - problem.low) * rng.random((8 * DESIGNS, 2))
    r1, r3 = drawn.T
    isotropic = np.array([isotropic_leg(a, 3.0 - a - q) / q for a, q in drawn])
    lam = problem.task.lam  # type: ignore[attr-defined]  # the 3-SPR's
    kept = (np.abs(isotropic - 1.0) > lam) & (problem.evaluate(drawn).indices["lci_min"] > 0.2)
    return drawn[kept & (3.0 - r1 - r3 > 0.0)][:DESIGNS]


def test_numpy(benchmark: Any, problem: DesignProblem, designs: np.ndarray) -> None:
    arguments = (designs, problem.task.lam, *symmetric_cube(problem.options.nodes))  # type: ignore[attr-defined]  # the 3-SPR's
    indices, D = problem.evaluate(designs).indices, problem.task.D  # type: ignore[attr-defined]  # likewise
    found = plain(*arguments)
    for column, (name, scale) in enumerate(
        [("gci", 1.0), ("volume", D**3), ("parasitic", D), ("s_angle", 1.0), ("lci_min", 1.0)]
    ):
        np.testing.assert_allclose(found[:, column] * scale, indices[name], rtol=1e-6)
    benchmark.extra_info.update({"row": PLAIN, "unit": "designs", "count": len(designs)})
    benchmark.pedantic(plain, arguments, rounds=3, warmup_rounds=1)


def test_evaluate(benchmark: Any, problem: DesignProblem, designs: np.ndarray) -> None:
    row = f"spr3: evaluate, {len(designs)} designs, all cores"
    benchmark.extra_info.update({
        "row": row, "unit": "designs", "count": len(designs),
        "versus": {PLAIN: "NumPy"}, "target": ">= 100 thousand designs/s",
    })  # fmt: skip
    benchmark.pedantic(problem.evaluate, (designs,), rounds=50, warmup_rounds=2)


def latency(benchmark: Any, row: str, function: Callable[..., Any], *arguments: Any) -> None:
    benchmark.extra_info.update({"row": row, "target": "<= 15 µs"})
    benchmark.pedantic(function, arguments, rounds=2000, iterations=10, warmup_rounds=50)


def test_one_design(benchmark: Any, problem: Any) -> None:
    said = problem.declared
    table, own = np.empty((1, len(said.index_table))), np.empty((1, len(said.own_limits)))
    arguments = (
        problem.printed_design()[None], problem.pack(None)[None], 0, *problem._nodes, table, own,
        np.empty(1),
    )  # fmt: skip
    latency(benchmark, "spr3: one design, serial kernel", spr3.measure.serial, *arguments)


def test_one_design_evaluate(benchmark: Any, problem: DesignProblem) -> None:
    design = problem.printed_design()[None]
    latency(benchmark, "spr3: one design, evaluate", problem.evaluate, design)
