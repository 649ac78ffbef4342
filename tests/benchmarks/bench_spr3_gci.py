"""The 3-SPR's mean conditioning index: poses a second of processor time, against JAX and C++.

All take the same nodes of the same designs, whose joint boxes hold no isotropic pose. JAX
(``spr3_gci.py``) and C++ (``spr3_gci.cpp``) check nothing.
"""

from __future__ import annotations

import ctypes
import functools
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.compile import kernel
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.sampling import symmetric_cube
from pkm_gym.mechanisms.spr3.box import box_means, isotropic_leg
from pkm_gym.mechanisms.spr3.lockstep import lanes_for

from .spr3_gci import gci

DESIGNS = 2048
JAX, NATIVE = "gci, JAX", "gci, C++ -O3 -ffast-math, eight designs in lockstep"
FLAGS = ["-O3", "-march=native", "-ffast-math", "-shared", "-fPIC"]

Gci = Callable[[np.ndarray, float, np.ndarray, np.ndarray], np.ndarray]

pytestmark = pytest.mark.benchmark(timer=time.process_time)


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return pkm_gym.make_problem("spr3")


@pytest.fixture(scope="module")
def designs(problem: Any) -> np.ndarray:
    """Designs without singularity or isotropic pose in their joint box."""
    rng = np.random.default_rng(0)
    drawn = problem.low + (problem.high - problem.low) * rng.random((8 * DESIGNS, 2))
    isotropic = np.array([isotropic_leg(a, 3.0 - a - q) / q for a, q in drawn])
    kept = (np.abs(isotropic - 1.0) > problem.task.lam) & (
        problem.evaluate(drawn).indices["lci_min"] > 0.2
    )
    assert kept.sum() >= DESIGNS
    return drawn[kept][:DESIGNS]


@pytest.fixture(scope="module")
def native(tmp_path_factory: pytest.TempPathFactory) -> Gci:
    """The program in C++."""
    if shutil.which("g++") is None:
        pytest.skip("there is no g++ to compile the program in C++")
    library = tmp_path_factory.mktemp("native") / "gci.so"
    source = Path(__file__).with_name("spr3_gci.cpp")
    subprocess.run(["g++", *FLAGS, str(source), "-o", str(library)], check=True)
    compiled = ctypes.CDLL(str(library)).gci

    def call(designs: np.ndarray, lam: float, nodes: np.ndarray, weights: np.ndarray) -> np.ndarray:
        found = np.empty(len(designs))
        at = [ctypes.c_void_p(x.ctypes.data) for x in (designs, nodes, weights, found)]
        count = ctypes.c_long(len(nodes))
        compiled(ctypes.c_long(len(designs)), at[0], ctypes.c_double(lam), count, *at[1:])
        return found

    return call


@pytest.fixture
def jitted() -> Iterator[Gci]:
    """The program in JAX, in double precision."""
    jax = pytest.importorskip("jax", reason="JAX isn't installed")
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    compiled = jax.jit(functools.partial(gci, jax.numpy))
    yield lambda *arguments: np.asarray(compiled(*arguments))
    jax.config.update("jax_enable_x64", before)


@kernel
def ours(
    designs: np.ndarray, lam: float, nodes: np.ndarray, weights: np.ndarray, found: np.ndarray
) -> None:
    """Fill ``found`` (n,) with the index of ``designs`` (n, 2)."""
    for i in range(len(designs)):
        a, q_c = designs[i]
        found[i] = box_means(
            a, 3.0 - a - q_c, q_c, lam, 0.0, 1.0, nodes, weights, lanes_for(len(nodes))
        )[3]


def measured(benchmark: Any, problem: Any, designs: np.ndarray, function: Gci, **said: Any) -> None:
    """Measure a function that finds the index that ``evaluate`` reports."""
    nodes, weights = symmetric_cube(problem.options.nodes)
    arguments = (designs, problem.task.lam, np.ascontiguousarray(nodes), weights)
    expected = problem.evaluate(designs).indices["gci"]
    np.testing.assert_allclose(function(*arguments), expected, rtol=1e-9)
    count = len(designs) * len(nodes)
    benchmark.extra_info.update({"unit": "poses", "count": count, **said})
    benchmark.pedantic(function, arguments, rounds=50, warmup_rounds=2)


def test_jax(benchmark: Any, problem: Any, designs: np.ndarray, jitted: Gci) -> None:
    measured(benchmark, problem, designs, jitted, row=JAX)


def test_native(benchmark: Any, problem: Any, designs: np.ndarray, native: Gci) -> None:
    measured(benchmark, problem, designs, native, row=NATIVE)


def test_ours(benchmark: Any, problem: Any, designs: np.ndarray) -> None:
    found = np.empty(len(designs))

    def function(*arguments: Any) -> np.ndarray:
        ours(*arguments, found)
        return found

    said = {
        "row": "spr3: gci, one core", "versus": {JAX: "JAX", NATIVE: "C++"},
        "target": ">= 12 million poses/s of a core",
    }  # fmt: skip
    measured(benchmark, problem, designs, function, **said)
