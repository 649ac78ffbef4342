"""Compiled kernels: cache folder, threads, forks, one line on stderr."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pkm_gym.core import compile as compiling

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


def run(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done


def test_the_cache_folder_changes_with_any_kernel_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sources = [tmp_path / name for name in ("core/compile.py", "core/a.py", "mechanisms/b/c.py")]
    for source in sources:
        source.parent.mkdir(parents=True, exist_ok=True)
        source.write_text("x = 1\n", encoding="utf-8")
    monkeypatch.setattr(compiling, "__file__", str(sources[0]))
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    folders = {compiling._cache_folder()}
    assert compiling._cache_folder() in folders
    for source in sources[1:]:
        source.write_text("x = 2\n", encoding="utf-8")
        folders.add(compiling._cache_folder())
    assert len(folders) == 3
    assert all(Path(str(folder)).is_dir() for folder in folders)


def test_kernels_are_compiled_once_and_then_read_from_the_cache(tmp_path: Path) -> None:
    first = run(MACHINE, NUMBA_CACHE_DIR=str(tmp_path))
    assert first.stderr.count("\n") == 1
    assert "compiling kernels (once per machine)" in first.stderr
    assert run(MACHINE, NUMBA_CACHE_DIR=str(tmp_path)).stderr == ""


def test_without_a_writable_cache_folder_kernels_are_compiled_at_every_start(
    tmp_path: Path,
) -> None:
    (tmp_path / "file").touch()
    for _ in range(2):
        done = run(MACHINE, NUMBA_CACHE_DIR=str(tmp_path / "file" / "folder"))
        assert done.stderr.count("\n") == 1
        assert "no writable cache folder: at every start" in done.stderr


def test_the_threading_layer_is_the_one_that_survives_threads_and_forks() -> None:
    tbb = Path(sys.prefix, "lib", "libtbb.so.12")
    if not tbb.exists():
        pytest.skip("no oneTBB on this machine: calls take turns")
    layer = "import numba; print(numba.threading_layer())"
    assert run(BATCH + layer).stdout.strip() == "tbb"


@pytest.mark.parametrize("layer", ["default", "workqueue"])
def test_two_python_threads_may_call_the_parallel_kernel_at_once(layer: str) -> None:
    run(BATCH + THREADS, **({} if layer == "default" else {"NUMBA_THREADING_LAYER": layer}))


def test_a_forked_child_can_evaluate() -> None:
    run(BATCH + FORK)


def test_a_batch_kernel_goes_serial_below_the_threshold() -> None:
    calls: list[str] = []
    kernel = compiling.BatchKernel.__new__(compiling.BatchKernel)
    kernel.serial = lambda: calls.append("serial")  # type: ignore[method-assign]  # a plain attribute
    kernel.parallel = lambda: calls.append("parallel")  # type: ignore[method-assign]  # likewise
    kernel(0.9 * compiling.SERIAL_WORK)
    kernel(1.1 * compiling.SERIAL_WORK)
    assert calls == ["serial", "parallel"]
