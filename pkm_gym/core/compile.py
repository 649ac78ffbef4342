"""The one way to compile a kernel: flags, cache folder, threading layer.

numba's defaults are wrong for a library in three ways, all settled here:

* the cache of a caller survives a change of its callee in another file, so the cache folder is
  keyed by a hash of every kernel source;
* the ``workqueue`` threading layer aborts when two Python threads enter it and GNU OpenMP kills a
  forked child, so the layer is oneTBB from PyPI, which numba finds in a virtual environment only
  after the library has been loaded by hand; without it, parallel calls take turns;
* compiling is silent, so one line on stderr says that it happens.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import sys
import threading
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

import numba
import numpy as np
import platformdirs
from numba.core import event

F = TypeVar("F", bound=Callable[..., Any])

config: Any = numba.config
njit: Any = numba.njit

# No "nnan" and no "ninf": a kernel may meet NaN and infinity and must answer for them.
FLAGS = {"nsz", "contract", "reassoc", "arcp"}

# Below this much work, in microseconds, starting threads costs more than it saves.
SERIAL_WORK = 200.0


def _source_hash() -> str:
    package = Path(__file__).parent.parent
    digest = hashlib.sha256()
    for folder in ("core", "mechanisms"):
        for source in sorted((package / folder).rglob("*.py")):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> str | None:
    """Return a writable folder for compiled kernels, or None where there is none."""
    root = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("pkm_gym")
    folder = Path(root) / f"kernels-{_source_hash()}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".writable-{os.getpid()}"
        probe.touch()
        probe.unlink()
    except OSError:
        return None
    return str(folder)


def _load_tbb() -> bool:
    """Load oneTBB where pip puts it, so that numba's tbb layer can link to it."""
    for library in (Path(sys.prefix) / "lib" / "libtbb.so.12", "libtbb.so.12"):
        try:
            ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
        except OSError:
            continue
        return True
    return False


CACHE_FOLDER = _cache_folder()
if "NUMBA_THREADING_LAYER" not in os.environ:
    config.THREADING_LAYER = "tbb" if _load_tbb() else "workqueue"
_THREAD_SAFE = config.THREADING_LAYER in ("tbb", "safe", "threadsafe", "omp")
_turn = nullcontext() if _THREAD_SAFE else threading.Lock()


class _Announcer(event.Listener):
    """Says once per process, on stderr, that kernels are being compiled."""

    def __init__(self) -> None:
        self._said = False

    def on_start(self, event: Any) -> None:
        module = event.data["dispatcher"].py_func.__module__
        if not self._said and module.startswith("pkm_gym."):
            self._said = True
            kept = (
                "once per machine" if CACHE_FOLDER else "no writable cache folder: at every start"
            )
            print(f"pkm_gym: compiling kernels ({kept}) ...", file=sys.stderr, flush=True)

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]  # numba has no types


def _jit(function: F, **options: bool) -> F:
    before = config.CACHE_DIR
    config.CACHE_DIR = CACHE_FOLDER or before
    try:
        compiled: F = njit(
            cache=CACHE_FOLDER is not None,
            fastmath=FLAGS,
            error_model="numpy",
            nogil=True,
            **options,
        )(function)
    finally:
        config.CACHE_DIR = before
    return compiled


def kernel(function: F) -> F:
    """Compile a function of numbers and arrays; it may be called from other kernels."""
    return _jit(function)


def formula(function: F) -> F:
    """Compile a short function of numbers that becomes part of every loop that calls it.

    Left to itself the compiler keeps it as a call, and a loop over poses with a call in it isn't
    turned into vector instructions.
    """
    return _jit(function, forceinline=True)


@formula
def own_row(i: int, rows: int) -> int:
    """Return the row of design i, where there is one row a design or one for all."""
    return np.int64(i) if rows > 1 else np.int64(0)  # type: ignore[return-value]  # signed, compiled


class BatchKernel:
    """A compiled loop over designs, run serially or on all cores, whichever is faster.

    The decorated function loops with ``numba.prange`` over its leading axis and writes into arrays
    that it is given.
    """

    def __init__(self, function: FunctionType) -> None:
        # numba's cache tells two kernels apart by name, not by flags: the parallel one is a copy
        # of another name.
        copy = FunctionType(
            function.__code__, function.__globals__, function.__name__ + "_parallel"
        )
        copy.__qualname__ = function.__qualname__ + "_parallel"
        copy.__module__ = function.__module__
        self.serial = _jit(function)
        self.parallel = _jit(copy, parallel=True)

    def __call__(self, work: float, *arguments: Any) -> None:
        """Run on ``arguments``; ``work`` is the estimated serial time in microseconds."""
        if work < SERIAL_WORK:
            self.serial(*arguments)
        else:
            with _turn:
                self.parallel(*arguments)


def batch_kernel(function: Callable[..., None]) -> BatchKernel:
    """Compile a loop over designs twice: serial and parallel."""
    assert isinstance(function, FunctionType)
    return BatchKernel(function)
