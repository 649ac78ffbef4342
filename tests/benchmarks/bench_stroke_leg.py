"""The leg's design problems: designs a second and the latency of one, against NumPy and C++.

NumPy and a trig-free loop in C++ measure the mean and the deviation of the condition number over
the same poses of the same designs, for which no crank crosses its dead line; ``evaluate`` reports
all other indices, constraints and merit besides.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms.stroke_leg import gait
from pkm_gym.mechanisms.stroke_leg import problem as leg
from pkm_gym.mechanisms.stroke_leg.indices import KINK, sample_rule

DESIGNS = 8192
CHUNK = 64  # designs a chunk: its arrays stay in the cache
PLAIN = "eta_P and sigma, vectorised NumPy"
NATIVE = "eta_P and sigma, C++ -O3 -ffast-math, one core"

SOURCE = r"""
#include <cmath>
extern "C" void moments(long n, const double *designs, long poses, const double *theta,
                        const double *varphi, const double *weights, double *found) {
    double sin_s[4096], cos_s[4096], sin_d[4096], cos_d[4096], sin_2t[4096], cos_2t[4096];
    for (long j = 0; j < poses; ++j) {
        double s = theta[j] + varphi[j], d = theta[j] - varphi[j] - 0.25 * M_PI;
        sin_s[j] = sin(s), cos_s[j] = cos(s), sin_d[j] = sin(d), cos_d[j] = cos(d);
        sin_2t[j] = sin(2.0 * theta[j]), cos_2t[j] = cos(2.0 * theta[j]);
    }
    for (long i = 0; i < n; ++i) {
        const double *x = designs + 5 * i;  // l1, l3, l6, phi, th3
        double bx = x[2] - x[1] * cos(x[4]), bz = x[1] * sin(x[4]);
        double ob = sqrt(bx * bx + bz * bz), turn = x[3] + atan2(bz, bx);
        double sin_t = sin(turn), cos_t = cos(turn), mean = 0.0, square = 0.0;
        double square2 = x[0] * x[0] + ob * ob, square4 = x[0] * x[0] + x[2] * x[2];
        for (long j = 0; j < poses; ++j) {
            double sine2 = sin_t * sin_s[j] - cos_t * cos_s[j];
            double cosine2 = -sin_t * cos_s[j] - cos_t * sin_s[j];
            double k2 = x[0] * ob * sine2, k4 = -x[0] * x[2] * cos_d[j];
            double p = k2 * k2 / (square2 - 2.0 * x[0] * ob * cosine2);
            double q = k4 * k4 / (square4 - 2.0 * x[0] * x[2] * sin_d[j]);
            double root = sqrt((p - q) * (p - q) + 4.0 * p * q * cos_2t[j] * cos_2t[j]);
            double eta = (p + q + root) / (2.0 * sqrt(p * q) * sin_2t[j]);
            mean += weights[j] * eta;
            square += weights[j] * eta * eta;
        }
        found[2 * i] = mean;
        found[2 * i + 1] = sqrt(square - mean * mean);
    }
}
"""


def poses(problem: Any) -> np.ndarray:
    """theta, varphi and weights (3, n) of the problem's sample."""
    task, (across, along) = problem.task, sample_rule("gauss", 8, 61)
    corners = np.array([task.theta_min, KINK, task.theta_max])
    theta, width = across[:, :3] @ corners, across[:, 3:] @ corners
    weights = np.outer(width, along[:, 1]) / (task.theta_max - task.theta_min)
    grid = np.meshgrid(theta, task.swing * along[:, 0], indexing="ij")
    return np.stack([*(x.ravel() for x in grid), weights.ravel()])


def plain(designs: np.ndarray, sample: np.ndarray) -> np.ndarray:
    """eta_P and sigma (n, 2) of designs (n, 5)."""
    parts = [_chunk(designs[i : i + CHUNK], *sample) for i in range(0, len(designs), CHUNK)]
    return np.concatenate(parts)


def _chunk(
    designs: np.ndarray, theta: np.ndarray, varphi: np.ndarray, weights: np.ndarray
) -> np.ndarray:
    l1, l3, l6, phi, th3 = designs.T[..., None]
    b = l6 - l3 * np.exp(-1j * th3)
    a = 1.5 * np.pi - theta - varphi - phi - np.angle(b)
    d = 1.25 * np.pi + theta - varphi
    p = (l1 * abs(b) * np.sin(a)) ** 2 / (l1**2 + abs(b) ** 2 - 2.0 * l1 * abs(b) * np.cos(a))
    q = (l1 * l6 * np.sin(d)) ** 2 / (l1**2 + l6**2 - 2.0 * l1 * l6 * np.cos(d))
    root = np.sqrt((p - q) ** 2 + 4.0 * p * q * np.cos(2.0 * theta) ** 2)
    eta = (p + q + root) / (2.0 * np.sqrt(p * q) * np.sin(2.0 * theta))
    mean = eta @ weights
    return np.stack([mean, np.sqrt(eta**2 @ weights - mean**2)], axis=-1)


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return pkm_gym.make_problem("stroke_leg")


@pytest.fixture(scope="module")
def designs(problem: DesignProblem) -> np.ndarray:
    """Designs whose cranks keep to their sides of their dead lines."""
    rng = np.random.default_rng(0)
    drawn = problem.low + (problem.high - problem.low) * rng.random((20 * DESIGNS, 5))
    return drawn[np.isfinite(problem.evaluate(drawn).objectives[:, 0])][:DESIGNS]


@pytest.fixture(scope="module")
def native(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., np.ndarray]:
    """The loop in C++."""
    if shutil.which("g++") is None:
        pytest.skip("there is no g++ to compile the loop in C++")
    folder: Path = tmp_path_factory.mktemp("native")
    (folder / "moments.cpp").write_text(SOURCE)
    flags = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]
    subprocess.run(["g++", *flags, "moments.cpp", "-o", "moments.so"], cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "moments.so"))

    def call(designs: np.ndarray, sample: np.ndarray) -> np.ndarray:
        found = np.empty((len(designs), 2))
        arrays = [np.ascontiguousarray(x) for x in (designs, *sample)]
        at = [ctypes.c_void_p(x.ctypes.data) for x in (*arrays, found)]
        sizes = ctypes.c_long(len(designs)), ctypes.c_long(len(sample[0]))
        library.moments(sizes[0], at[0], sizes[1], *at[1:])
        return found

    return call


def compared(benchmark: Any, row: str, function: Any, problem: Any, designs: np.ndarray) -> None:
    sample, found = poses(problem), problem.evaluate(designs).indices
    wanted = np.stack([found["eta_P"], found["sigma"]], axis=-1)
    np.testing.assert_allclose(function(designs, sample), wanted, rtol=1e-6)
    benchmark.extra_info.update({"row": row, "unit": "designs", "count": len(designs)})
    benchmark.pedantic(function, (designs, sample), rounds=5, warmup_rounds=1)


def test_numpy(benchmark: Any, problem: DesignProblem, designs: np.ndarray) -> None:
    compared(benchmark, PLAIN, plain, problem, designs)


def test_native(benchmark: Any, problem: DesignProblem, designs: np.ndarray, native: Any) -> None:
    compared(benchmark, NATIVE, native, problem, designs)


def test_evaluate(benchmark: Any, problem: DesignProblem, designs: np.ndarray) -> None:
    benchmark.extra_info.update({
        "row": f"stroke_leg: evaluate, {len(designs)} designs, all cores",
        "unit": "designs", "count": len(designs), "versus": {PLAIN: "NumPy", NATIVE: "C++"},
        "target": ">= 800 thousand designs/s",
    })  # fmt: skip
    benchmark.pedantic(problem.evaluate, (designs,), rounds=50, warmup_rounds=2)


def test_evaluate_for_a_gait(benchmark: Any) -> None:
    problem = pkm_gym.make_problem("stroke_leg_gait")
    rng = np.random.default_rng(0)
    drawn = problem.low + (problem.high - problem.low) * rng.random((2 * DESIGNS, 7))
    designs = drawn[problem.evaluate(drawn).unreached <= 0.0][:DESIGNS]
    benchmark.extra_info.update({
        "row": f"stroke_leg_gait: evaluate, {len(designs)} designs, all cores",
        "unit": "designs", "count": len(designs), "target": ">= 150 thousand designs/s",
    })  # fmt: skip
    benchmark.pedantic(problem.evaluate, (designs,), rounds=30, warmup_rounds=2)


def latency(benchmark: Any, row: str, function: Callable[..., Any], *arguments: Any) -> None:
    benchmark.extra_info.update({"row": row, "target": "<= 10 µs"})
    benchmark.pedantic(function, arguments, rounds=2000, iterations=10, warmup_rounds=50)


def optimum(problem: Any) -> np.ndarray:
    return problem.design(next(iter(problem.reference.optima.values())).design)[None]


def rows(problem: Any) -> tuple[np.ndarray, ...]:
    said = problem.declared
    return np.empty((1, len(said.index_table))), np.empty((1, len(said.own_limits))), np.empty(1)


def test_one_design(benchmark: Any, problem: Any) -> None:
    arguments = (
        problem.complete(optimum(problem)), problem.pack(None)[None], False, True, problem._mu,
        *problem._rule, *rows(problem),
    )  # fmt: skip
    latency(benchmark, "stroke_leg: one design, serial kernel", leg.measure.serial, *arguments)


def test_one_design_evaluate(benchmark: Any, problem: DesignProblem) -> None:
    row = "stroke_leg: one design, evaluate"
    latency(benchmark, row, problem.evaluate, optimum(problem))


def test_one_design_for_a_gait(benchmark: Any) -> None:
    problem: Any = pkm_gym.make_problem("stroke_leg_gait")
    task, design = problem.pack(None)[None], optimum(problem)
    arguments = design, task, *problem._nodes, problem._edge, *rows(problem)
    row = "stroke_leg_gait: one design, serial kernel"
    latency(benchmark, row, gait.measure.serial, *arguments)
