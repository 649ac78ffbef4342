"""Where compiled kernels are kept: one file a kernel and signature, named by what it was made of.

numba's own cache looks at the kernel's file alone: it misses a helper, a constant or a row class
that changed in another one. Here the name holds a digest of the processor, the versions, the
arguments' types and ``key.ingredients``. So nothing stale is ever read, checkouts of different
sources don't take each other's place, and a file that is missing is only compiled again.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import platform
import shutil
import sys
import time
import uuid
import warnings
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite  # type: ignore[import-untyped]
import numba
import numpy as np
import platformdirs
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult
from numba.core.serialize import dumps

from pkm_gym.core.key import ingredients

# Files that nobody read for this long are removed, and the oldest ones of too large a folder.
SECONDS_KEPT = 30 * 86400.0
BYTES_KEPT = 512 * 2**20

DIGEST_SIZE = hashlib.sha256().digest_size

VERSIONS = (platform.python_version(), numba.__version__, llvmlite.__version__, np.__version__)


@cache
def say_once(line: str) -> None:
    """Write a line to stderr unless this process has written it before."""
    print(f"pkm_gym: {line}", file=sys.stderr, flush=True)


@cache
def folder() -> Path | None:
    """Return our own folder for compiled kernels, or None where there is none to write to.

    A file that is loaded is run, so a folder into which somebody else may write is not used.
    """
    root = os.environ.get("NUMBA_CACHE_DIR") or platformdirs.user_cache_dir("pkm_gym")
    kept = Path(root) / "kernels"
    try:
        kept.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = kept.stat()
    except OSError:
        return None
    if not _is_ours(status):
        say_once(f"{kept} is not used: others may write there (it must be yours, mode 0700)")
        return None
    return kept if os.access(kept, os.R_OK | os.W_OK | os.X_OK) else None


def _is_ours(status: os.stat_result) -> bool:
    """Whether nobody else may have written a file or a folder."""
    return not hasattr(os, "getuid") or (
        status.st_uid == os.getuid() and not status.st_mode & 0o022
    )


class KernelCache(_Cache):
    """The compiled versions of one kernel, a file each: its digest, then what numba pickles."""

    def __init__(self, dispatcher: Any) -> None:
        self._dispatcher = dispatcher

    @property
    def cache_path(self) -> str | None:
        """The folder, or None without one."""
        return str(folder()) if folder() else None

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled version for a signature, or None: then it is compiled."""
        target_context.refresh()
        path = self._path(sig, target_context.codegen())
        data = _read(path) if path else None
        rebuild: Any = CompileResult._rebuild
        return data and rebuild(target_context, *pickle.loads(data))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Write a compiled version; a process that reads at the same time sees all or nothing."""
        path = self._path(sig, data.codegen)
        if path is None:
            return
        if data.library.has_dynamic_globals or any(not part.can_cache for part in data.lifted):
            warnings.warn(
                f"{self._dispatcher.py_func.__qualname__} is compiled anew at every start: "
                "it reads a pointer or too large an array",
                stacklevel=2,
            )
            return
        content: bytes = dumps(data._reduce())  # type: ignore[no-untyped-call]  # numba has no types
        part = path.with_suffix(f".{uuid.uuid4().hex}")
        try:
            part.write_bytes(hashlib.sha256(content).digest() + content)
            part.replace(path)
            _clean(path.parent)
        except OSError as error:
            say_once(f"compiled kernels can't be kept in {path.parent}: {error.strerror}")
            with suppress(OSError):
                part.unlink()

    def enable(self) -> None:
        """Do nothing: there is no switch."""

    def disable(self) -> None:
        """Do nothing: there is no switch."""

    def flush(self) -> None:
        """Do nothing: what is stale is never read again."""

    def _path(self, sig: Any, codegen: Any) -> Path | None:
        kept, function = folder(), self._dispatcher.py_func
        if kept is None or " at 0x" in repr(sig):  # a function as an argument: no name outlasts it
            return None
        told = (VERSIONS, codegen.magic_tuple(), *_spelled(sig), *ingredients(self._dispatcher))
        digest = hashlib.sha256(repr(told).encode())
        name = f"{function.__module__}.{function.__qualname__}".replace("<locals>.", "")
        return kept / f"{name[-100:]}-{digest.hexdigest()[:32]}.kernel"


def _spelled(sig: Any) -> tuple[str, ...]:
    """Return the types of a signature in words that tell row classes of one name apart."""
    rows = [getattr(item, "instance_class", None) for item in sig]
    return repr(sig), *(f"{row.__module__}.{row.__qualname__}" for row in rows if row)


def _read(path: Path) -> bytes | None:
    try:
        with path.open("rb") as file:
            status, content = os.fstat(file.fileno()), file.read()
        if time.time() - status.st_mtime > 86400.0:
            os.utime(path)
    except OSError:
        return None
    whole = hashlib.sha256(content[DIGEST_SIZE:]).digest() == content[:DIGEST_SIZE]
    if not (whole and _is_ours(status)):
        say_once(f"damaged files in {path.parent} are made anew")
        return None
    return content[DIGEST_SIZE:]


@cache  # once a process
def _clean(kept: Path) -> None:
    """Remove what nobody uses any more; a process that misses a file compiles it again."""
    now, total = time.time(), 0
    with suppress(OSError):  # where another process is cleaning
        found = [(path.stat(), path) for path in kept.iterdir()]
        for status, path in sorted(found, key=lambda pair: -pair[0].st_mtime):
            total += status.st_size
            if now - status.st_mtime > SECONDS_KEPT or total > BYTES_KEPT:
                path.unlink()
        for old in kept.parent.glob("kernels-*"):  # as earlier versions named it
            if now - old.stat().st_mtime > SECONDS_KEPT:
                shutil.rmtree(old)
