"""Files that appear whole or not at all, files that grow by whole lines, and none but files."""

from __future__ import annotations

import errno
import os
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)  # a disk, a quota, a limit
PROBE = bytes(2**16)

# What has a place among files and is none: reading it may wait for ever, or never end.
SPECIAL = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def check_regular(path: Path) -> None:
    """Refuse a pipe, a device, a socket or a folder where a file is read or written.

    Raises:
        OSError: naming it.
    """
    try:
        kind = stat.S_IFMT(path.stat().st_mode)
    except FileNotFoundError:
        return
    if kind == stat.S_IFDIR:
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if kind != stat.S_IFREG:
        said = f"it is {SPECIAL.get(kind, 'something else')}, not a file"
        raise OSError(errno.EINVAL, said, str(path))


def read_bytes(path: Path) -> bytes:
    """Return the content of a file.

    Raises:
        OSError: naming it, where it is missing, can't be read or is no regular file.
    """
    check_regular(path)
    return path.read_bytes()


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a temporary path to write to, beside ``path``, which appears whole or not at all.

    The folder is made. Processes and threads may write the same file: the last one stays.

    Raises:
        OSError: where it can't be written; it names ``path``. Where a library fails because
            nothing more can be written, it is raised in the place of what the library says.
    """
    check_regular(path)
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
    check_regular(path)
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
