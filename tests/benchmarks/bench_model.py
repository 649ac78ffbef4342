"""Designs a second, and the latency of one design, against two NumPy versions.

These sample three indices over the workspace; ``evaluate`` finds the exact extremes, and reports
the other indices, constraints and merit besides.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms.diamond import problem as diamond
from pkm_gym.mechanisms.diamond.extremes import LAYERS, Workspace, workspace_indices

DESIGNS = 4096
SAMPLE = (32, 9)  # columns and rows of what NumPy samples, up to 1e-3 from the extremes
CHUNK = 64  # designs a chunk, the fastest of 4 to 512: its arrays stay in the cache
TRIG_FREE, PLAIN = "three indices, trig-free chunked NumPy", "three indices, plain NumPy"

Arrays = tuple[np.ndarray, ...]


# Two NumPy versions -------------------------------------------------------------------------------


def trig_free(dimensions: np.ndarray, x: np.ndarray, y: np.ndarray) -> Arrays:
    """tau_G, sigma_max, sigma_min (n,) of dimensions (n, 7), without angles, chunk by chunk."""
    parts = [
        _trig_free_chunk(dimensions[i : i + CHUNK], x, y) for i in range(0, len(dimensions), CHUNK)
    ]
    return tuple(np.concatenate(columns) for columns in zip(*parts, strict=True))


def _trig_free_chunk(dimensions: np.ndarray, x: np.ndarray, y: np.ndarray) -> Arrays:
    e, l1, l2, H, b, h, eta = dimensions.T[..., None]
    x, y = 0.5 * b * x, -H - h * y
    rods, sines2 = [], []
    for side in (1.0, -1.0):
        dx = x - side * e
        d2 = dx * dx + y * y
        p = 0.5 + 0.5 * (l1 * l1 - l2 * l2) / d2
        q = side * np.sqrt(l1 * l1 / d2 - p * p)
        rods.append(((dx - p * dx + q * y) / l2, (y - p * y - q * dx) / l2))
        sines2.append((q * d2 / (l1 * l2)) ** 2)
    (w1x, w1y), (w2x, w2y) = rods
    sine2 = (w1x * w2y - w1y * w2x) ** 2
    cosine2 = (w1x * w2x + w1y * w2y) ** 2
    row1, row2 = 1.0 / sines2[0], 1.0 / sines2[1]
    larger = 0.5 * (row1 + row2 + np.sqrt((row1 - row2) ** 2 + 4.0 * cosine2 * row1 * row2))
    smaller = sine2 * row1 * row2 / larger
    torque = np.maximum(eta * eta * sines2[0] / sine2 + row1, eta * eta * sines2[1] / sine2 + row2)
    tau = np.sqrt(torque.max(axis=-1) + 2.0 * eta[:, 0])
    return tau, np.sqrt(larger.max(axis=-1)), np.sqrt(smaller.min(axis=-1))


def plain(dimensions: np.ndarray, x: np.ndarray, y: np.ndarray) -> Arrays:
    """The same, written down from the paper: angles by eq. (2), then eqs (4), (12) and (18)."""
    e, l1, l2, H, b, h, eta = dimensions.T[..., None]
    x, y = 0.5 * b * x, -H - h * y
    w, s = [], []
    for side in (1.0, -1.0):
        distance = np.sqrt((x - side * e) ** 2 + y**2)
        gamma = np.arccos((distance**2 + l1**2 - l2**2) / (2.0 * distance * l1))
        theta = np.arctan2(y, x - side * e) + side * gamma
        u = np.stack([np.cos(theta), np.sin(theta)])
        rod = (np.stack([x - side * e, y]) - l1 * u) / l2
        w.append(rod)
        s.append(rod[1] * u[0] - rod[0] * u[1])
    alpha = np.arctan2(w[1][1], w[1][0]) - np.arctan2(w[0][1], w[0][0])
    beta = [np.arcsin(np.abs(s[0])), np.arcsin(np.abs(s[1]))]
    tau = [
        np.sqrt(
            eta**2 * np.sin(beta[i]) ** 2 / np.sin(alpha) ** 2 + 2 * eta + 1 / np.sin(beta[i]) ** 2
        )
        for i in range(2)
    ]
    row1, row2 = 1.0 / s[0] ** 2, 1.0 / s[1] ** 2
    root = np.sqrt((row1 - row2) ** 2 + 4.0 * np.cos(alpha) ** 2 * row1 * row2)
    sigma_max, sigma_min = np.sqrt((row1 + row2 + root) / 2), np.sqrt((row1 + row2 - root) / 2)
    return np.maximum(*tau).max(axis=-1), sigma_max.max(axis=-1), sigma_min.min(axis=-1)


# What is measured ---------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return pkm_gym.make_problem("diamond")


@pytest.fixture(scope="module")
def designs(problem: DesignProblem) -> np.ndarray:
    """Designs whose whole workspace is in reach."""
    rng = np.random.default_rng(0)
    drawn = problem.low + (problem.high - problem.low) * rng.random((4 * DESIGNS, 3))
    return drawn[np.isfinite(problem.evaluate(drawn).objectives[:, 0])][:DESIGNS]


@pytest.fixture(scope="module")
def dimensions(problem: DesignProblem, designs: np.ndarray) -> np.ndarray:
    machines: list[Any] = [problem.mechanism(design) for design in designs]
    return np.array([(m.e, m.l1, m.l2, m.H, m.b, m.h, m.m * m.l1**2 / m.I_A) for m in machines])


@pytest.fixture(scope="module")
def nodes() -> Arrays:
    """The poses that NumPy samples, as shares of half the width and of the height."""
    x, y = np.meshgrid(*(np.linspace(0.0, 1.0, count) for count in SAMPLE))
    return x.ravel(), y.ravel()


def count_designs(benchmark: Any, row: str, **info: Any) -> None:
    benchmark.extra_info.update({"row": row, "unit": "designs", "count": DESIGNS, **info})


@pytest.mark.parametrize(("row", "version"), [(PLAIN, plain), (TRIG_FREE, trig_free)])
def test_numpy(
    benchmark: Any,
    problem: DesignProblem,
    designs: np.ndarray,
    dimensions: np.ndarray,
    nodes: Arrays,
    row: str,
    version: Callable[..., Arrays],
) -> None:
    evaluation = problem.evaluate(designs)
    tau, sigma_max, sigma_min = version(dimensions, *nodes)
    inertia = [machine.I_A / machine.l1 for machine in map(problem.mechanism, designs)]  # type: ignore[attr-defined]  # the Diamond's
    regular = evaluation.quantity("sin_alpha") > 0.2
    for sampled, name, sign in [
        (tau * inertia, "tau_G", 1.0), (sigma_max, "sigma_max", 1.0), (sigma_min, "sigma_min", -1.0)
    ]:  # fmt: skip
        missed = sign * (1.0 - sampled / evaluation.quantity(name))[regular]
        assert missed.min() > -1e-6
        assert np.median(missed) < 1e-3
    count_designs(benchmark, row)
    benchmark.pedantic(version, (dimensions, *nodes), rounds=7, warmup_rounds=1)


def test_evaluate(benchmark: Any, problem: DesignProblem, designs: np.ndarray) -> None:
    versus, target = {TRIG_FREE: "trig-free", PLAIN: "plain"}, ">= 8x, >= 40x"
    count_designs(
        benchmark, f"evaluate, {DESIGNS} designs, all cores", versus=versus, target=target
    )
    benchmark.pedantic(problem.evaluate, (designs,), rounds=200, warmup_rounds=5)


# One design ---------------------------------------------------------------------------------------


def latency(
    benchmark: Any, row: str, target: str, function: Callable[..., Any], *args: Any
) -> None:
    benchmark.extra_info.update({"row": row, "target": target})
    benchmark.pedantic(function, args, rounds=3000, iterations=20, warmup_rounds=50)


def test_one_design_three_indices(benchmark: Any, problem: DesignProblem) -> None:
    machine: Any = problem.mechanism(problem.printed_design())
    eta = machine.m * machine.l1**2 / machine.I_A
    columns, rows = problem.options.sampling  # type: ignore[attr-defined]  # the Diamond's
    arguments = (
        Workspace(machine.e, machine.l1, machine.l2, machine.H, machine.b, machine.h, eta),
        np.linspace(0.0, 1.0, columns), np.linspace(0.0, 1.0, rows),
        np.empty((LAYERS, rows, columns)),
    )  # fmt: skip
    row = "one design: tau_G and sigmas, exact, serial kernel"
    latency(benchmark, row, "<= 10 µs", workspace_indices, *arguments)


def test_one_design_all_indices(benchmark: Any, problem: Any) -> None:
    said, design = problem.declared, problem.printed_design()[None]
    table, own = np.empty((1, len(said.index_table))), np.empty((1, len(said.own_limits)))
    arguments = (
        design, problem.pack(None)[None], problem._inertia, *problem._nodes, 0, 0, 1.0, table, own,
        np.empty(1), np.empty(1),
    )  # fmt: skip
    row = "one design: all indices, serial kernel"
    latency(benchmark, row, "<= 15 µs", diamond.measure.serial, *arguments)
    evaluation = problem.evaluate(design)
    for column, index in enumerate(said.index_table):
        np.testing.assert_array_equal(table[:, column], evaluation.quantity(index.name))


def test_one_design_evaluate(benchmark: Any, problem: DesignProblem) -> None:
    design = problem.printed_design()[None]
    latency(benchmark, "one design: evaluate", "<= 40 µs", problem.evaluate, design)
