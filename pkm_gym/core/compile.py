"""The one way to compile a kernel: flags, cache, threading layer.

numba's defaults are wrong for a library in three ways, all settled here:

* the cache of a caller survives a change of its callee in another file: see ``cache``;
* the ``workqueue`` threading layer aborts when two Python threads enter it and GNU OpenMP kills a
  forked child, so the layer is oneTBB from PyPI, which numba finds in a virtual environment only
  after the library has been loaded by hand; without it, parallel calls take turns;
* compiling is silent, so one line on stderr says that it happens.
"""

from __future__ import annotations

import ctypes
import sys
import threading
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from types import FunctionType
from typing import Any, TypeVar

import numba
import numpy as np
from numba.core import event

from pkm_gym.core import cache
from pkm_gym.core.names import check_known

F = TypeVar("F", bound=Callable[..., Any])

config: Any = numba.config
njit: Any = numba.njit
threading_layer: Any = numba.threading_layer  # type: ignore[attr-defined]  # numba exports it all the same

# No "nnan" and no "ninf": a kernel may meet NaN and infinity and must answer for them. No "reassoc"
# and no "contract": of two kernels that hold the same helper, compiled with each, the process uses
# the copy that it loaded first, so that the last bits would depend on what was called before.
FLAGS = {"nsz", "arcp"}

# What numba knows, by kind or by name.
LAYERS = ("default", "safe", "threadsafe", "forksafe", "tbb", "omp", "workqueue")

# Below this much work, in microseconds, starting threads costs more than it saves.
SERIAL_WORK = 200.0


def _load_tbb() -> bool:
    """Load oneTBB where pip puts it, so that numba's tbb layer can link to it."""
    for library in (Path(sys.prefix) / "lib" / "libtbb.so.12", "libtbb.so.12"):
        try:
            ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
        except OSError:
            continue
        return True
    return False


def _layer() -> str:
    """Return the threading layer of parallel kernels: the user's, or else the one that is safe.

    The user's is the one that runs already, or that NUMBA_THREADING_LAYER, numba's file of settings
    or ``numba.config`` names.
    """
    try:
        return str(threading_layer())
    except ValueError:  # none runs
        asked = str(config.THREADING_LAYER).lower()
        check_known("threading layer of numba", [asked], LAYERS)
    loaded = asked not in ("workqueue", "omp") and _load_tbb()
    if asked == "default":
        asked = config.THREADING_LAYER = "tbb" if loaded else "workqueue"
    return asked


_THREAD_SAFE = _layer() in ("tbb", "safe", "threadsafe", "omp")
_turn = nullcontext() if _THREAD_SAFE else threading.Lock()


class _Announcer(event.Listener):
    """Says once per process, on stderr, that kernels are being compiled."""

    def on_start(self, event: Any) -> None:
        if isinstance(getattr(event.data["dispatcher"], "_cache", None), cache.KernelCache):
            kept = (
                "once per machine" if cache.folder() else "no writable cache folder: at every start"
            )
            cache.say_once(f"compiling kernels ({kept}) ...")

    def on_end(self, event: Any) -> None:
        pass


event.register("numba:compile", _Announcer())  # type: ignore[no-untyped-call]  # numba has no types


def _jit(function: F, **options: bool) -> F:
    compiled: Any = njit(fastmath=FLAGS, error_model="numpy", nogil=True, **options)(function)
    compiled._cache = cache.KernelCache(compiled)  # what numba's ``cache=True`` sets, but ours
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
        self.serial = _jit(function)
        self.parallel = _jit(function, parallel=True)

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
