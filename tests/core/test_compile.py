"""Compiled kernels: cache folder, threads, forks, one line on stderr."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core import compile as compiling

Run = Callable[..., subprocess.CompletedProcess[str]]

TBB = Path(sys.prefix, "lib", "libtbb.so.12")

MACHINE = """
import numpy as np
from pkm_gym.mechanisms.diamond.mechanism import Diamond
machine = Diamond(e=0.15, l1=0.25, l2=0.64, H=0.49, b=0.8, h=0.12, I_A=0.03, m=0.8, mr_A=0.1)
angles = machine.inverse_kinematics(np.array([0.1, -0.5]))
assert np.allclose(machine.forward_kinematics(angles), [0.1, -0.5])
"""

BATCH = """
import numpy as np, pkm_gym
problem = pkm_gym.make_problem("diamond")
rng = np.random.default_rng(0)
designs = problem.low + (problem.high - problem.low) * rng.random((4000, 3))
expected = problem.evaluate(designs).log_merit
"""

THREADS = """
from concurrent.futures import ThreadPoolExecutor
with ThreadPoolExecutor(2) as pool:
    for found in pool.map(lambda _: problem.evaluate(designs).log_merit, range(60)):
        assert (found == expected).all()
"""

FORK = """
import os, sys
child = os.fork()
if child == 0:
    found = problem.evaluate(designs).log_merit
    os._exit(0 if (found == expected).all() else 1)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
"""


# Bit by bit: what a problem says of 2,000 designs, however the kernels came into the process.
EVALUATE = """
import pickle, sys, numpy as np, pkm_gym
from numba.core.dispatcher import Dispatcher
from pkm_gym.core import compile as compiling
*problems, out, mode = sys.argv[1:]
made = [pkm_gym.make_problem(name) for name in problems]
kernels = {
    f"{module}.{name}": value
    for module in sorted(sys.modules) if module.startswith("pkm_gym.")
    for name, value in vars(sys.modules[module]).items() if isinstance(value, Dispatcher)
}
if mode == "helpers first":
    with open(out + ".signatures", "rb") as file:
        signatures = pickle.load(file)
    assert len(signatures) > 30
    for name, found in signatures.items():
        for signature in found:
            kernels[name].compile(signature)
results = {}
for name, problem in zip(problems, made):
    for objective in problem.all_objectives:
        problem = pkm_gym.make_problem(name, objective=objective.name)
        rng = np.random.default_rng(11)
        designs = problem.low + (problem.high - problem.low) * rng.random((2000, len(problem.low)))
        for way, limit in (("parallel", 0.0), ("serial", np.inf)):
            compiling.SERIAL_WORK = limit
            found = problem.evaluate(designs)
            columns = [*found.indices.values(), *found.constraints.T, found.log_merit]
            results[f"{name} {objective.name} {way}"] = np.array(columns)
if mode == "cold":
    with open(out + ".signatures", "wb") as file:
        pickle.dump({name: kernel.signatures for name, kernel in kernels.items()}, file)
np.savez(f"{out} {mode}.npz", **results)
"""


def test_kernels_are_compiled_once_and_then_read_from_the_cache(run: Run, tmp_path: Path) -> None:
    first = run(MACHINE, NUMBA_CACHE_DIR=str(tmp_path))
    assert first.stderr.count("\n") == 1
    assert "compiling kernels (once per machine)" in first.stderr
    assert run(MACHINE, NUMBA_CACHE_DIR=str(tmp_path)).stderr == ""


def test_without_a_writable_cache_folder_kernels_are_compiled_at_every_start(
    run: Run, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    for _ in range(2):
        done = run(MACHINE, NUMBA_CACHE_DIR=str(tmp_path / "file" / "folder"))
        assert done.stderr.count("\n") == 1
        assert "no writable cache folder: at every start" in done.stderr


LAYER = "import numba; print(numba.threading_layer())"
CHOSEN = "import numba; numba.config.THREADING_LAYER = 'workqueue'\n"
RUNNING = """
import os, numba, numpy as np
os.environ["NUMBA_THREADING_LAYER"] = "workqueue"
@numba.njit(parallel=True)
def count(x):
    for i in numba.prange(len(x)):
        x[i] = i
count(np.zeros(9))
del os.environ["NUMBA_THREADING_LAYER"]
"""


def layer(run: Run, code: str, **environment: str) -> str:
    return run(code + LAYER, **environment).stdout.strip()


def test_the_threading_layer_is_the_one_that_survives_threads_and_forks(run: Run) -> None:
    if not TBB.exists():
        pytest.skip("no oneTBB on this machine: calls take turns")
    assert layer(run, BATCH) == "tbb"


@pytest.mark.parametrize("asked", ["tbb", "TBB", "workqueue", "omp"])
def test_the_layer_that_the_user_asks_for_runs(run: Run, asked: str) -> None:
    if asked.lower() == "tbb" and not TBB.exists():
        pytest.skip("no oneTBB on this machine")
    assert layer(run, BATCH + THREADS, NUMBA_THREADING_LAYER=asked) == asked.lower()


def test_a_layer_that_numba_does_not_know_is_refused_in_one_sentence() -> None:
    code = "import pkm_gym; pkm_gym.make_problem('diamond')"
    environment = {**os.environ, "NUMBA_THREADING_LAYER": "omb"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.stderr.splitlines()[-1] == (
        "ValueError: unknown threading layer of numba 'omb'; did you mean 'omp'?"
    )


@pytest.mark.parametrize("before", [CHOSEN, RUNNING], ids=["chosen", "running"])
def test_the_layer_that_a_program_has_chosen_runs(run: Run, before: str) -> None:
    assert layer(run, before + BATCH + THREADS) == "workqueue"


def test_two_python_threads_may_call_the_parallel_kernel_at_once(run: Run) -> None:
    run(BATCH + THREADS)


def test_a_forked_child_can_evaluate(run: Run) -> None:
    run(BATCH + FORK)


def test_a_batch_kernel_goes_serial_below_the_threshold() -> None:
    calls: list[str] = []
    kernel = compiling.BatchKernel.__new__(compiling.BatchKernel)
    kernel.serial = lambda: calls.append("serial")  # type: ignore[method-assign]  # a plain attribute
    kernel.parallel = lambda: calls.append("parallel")  # type: ignore[method-assign]  # likewise
    kernel(0.9 * compiling.SERIAL_WORK)
    kernel(1.1 * compiling.SERIAL_WORK)
    assert calls == ["serial", "parallel"]


@pytest.mark.slow
def test_results_are_the_same_to_the_bit_whatever_was_loaded_before(
    run: Run, tmp_path: Path
) -> None:
    modes = ("cold", "warm", "helpers first")
    for mode in modes:
        arguments = (*pkm_gym.problems(), str(tmp_path / "found"), mode)
        done = run(EVALUATE, *arguments, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
        assert ("compiling kernels" in done.stderr) == (mode == "cold")
    cold, *others = (dict(np.load(tmp_path / f"found {mode}.npz")) for mode in modes)
    for way, expected in cold.items():
        assert np.isfinite(expected).any(axis=1).all(), f"nothing to compare: {way}"
        serial = cold[way.replace("parallel", "serial")]
        for found in (serial, *(other[way] for other in others)):
            assert found.tobytes() == expected.tobytes(), way
