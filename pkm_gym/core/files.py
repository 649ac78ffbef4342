"""Files that appear whole or not at all, files that grow by whole lines, and TOML."""

from __future__ import annotations

import errno
import os
import re
import threading
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources.abc import Traversable
from io import FileIO
from pathlib import Path
from typing import Any

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # a disk, a quota, a limit
PROBE = bytes(2**16)


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary path to write to, beside ``path``, which appears whole or not at all.

    The folder is made. Processes and threads may write the same file: the last one stays.

    Raises:
        OSError: where it can't be written; it names ``path``. Where a library fails because
            nothing more can be written, it is raised in the place of what the library says.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    owner = f"{os.getpid()}-{threading.get_ident()}"
    part = path.with_name(f".{path.stem}.{owner}.part{path.suffix}")
    try:
        yield part
        part.replace(path)
    except Exception as error:
        known = isinstance(error, OSError) and error.errno is not None
        failure = error if known else _full(part) or error
        if isinstance(failure, OSError) and failure.errno is not None and _names(failure, part):
            failure.filename, failure.filename2 = str(path), None
        if failure is error:
            raise
        raise failure from error
    finally:
        part.unlink(missing_ok=True)


def _names(failure: OSError, part: Path) -> bool:
    """Return whether an error names the temporary file, by whatever path, or none."""
    return failure.filename is None or Path(os.fsdecode(failure.filename)).name == part.name


def _full(part: Path) -> OSError | None:
    """Return the error of writing more to a file, where no more can be written."""
    try:
        with part.open("ab") as file:
            file.write(PROBE)
    except OSError as error:
        return error if error.errno in FULL else None
    return None


def append_lines(path: Path, text: str, *, sync: bool = False) -> None:
    """Append whole lines to a file, made if it is missing.

    Half a line, as a full disk or a crash leaves it, is cut off before and after. A whole line
    stays: somebody may have read it.

    Args:
        path: of the file.
        text: the lines, each with its end.
        sync: whether to wait for the disk.

    Raises:
        OSError: where they can't be written; it names ``path``.
    """
    rest = memoryview(text.encode())
    try:
        with path.open("a+b", buffering=0) as file:
            _cut_half_line(file)
            try:
                while rest:
                    rest = rest[file.write(rest) :]
                if sync:
                    os.fsync(file.fileno())
            except BaseException:
                _cut_half_line(file)
                raise
    except OSError as error:
        error.filename = str(path)
        raise


def _cut_half_line(file: FileIO) -> None:
    size = file.seek(0, os.SEEK_END)
    if size == 0:
        return
    file.seek(size - 1)
    if file.read(1) != b"\n":
        file.seek(0)
        file.truncate(file.readall().rfind(b"\n") + 1)


def read_toml(path: Path | Traversable, what: str) -> dict[str, Any]:
    """Return what a TOML file holds; ``what`` it should be is for the errors.

    Raises:
        ValueError: in one sentence that names the file, for what is no TOML.
        OSError: where it can't be read.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise ValueError(f"{str(path)!r} is no {what}: it is no text") from None
    except tomllib.TOMLDecodeError as error:
        place = re.search(r"at (line \d+, column \d+|end of document)", str(error))
        where = f", see {place[1].replace('end of document', 'its end')}" if place else ""
        raise ValueError(f"{str(path)!r} is no {what}: it is no TOML{where}") from None
