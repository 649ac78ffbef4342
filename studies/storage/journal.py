"""Optuna's journal, kinder to disks and safe against processes that are killed."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock

if sys.platform != "win32":
    import fcntl


START = b'{"op_code":'


class KernelLock(JournalFileOpenLock):
    """A lock that the operating system releases when its holder dies.

    Optuna's own locks are files, which stay behind when a process is killed; its own are named
    otherwise, so that one left behind hinders nobody here.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(str(path))
        self._path = path.with_name(path.name + ".flock")

    def acquire(self) -> bool:
        """Wait for the lock."""
        file = self._path.open("ab")
        fcntl.flock(file, fcntl.LOCK_EX)
        self._file = file
        return True

    def release(self) -> None:
        """Give the lock back."""
        self._file.close()


class Journal(JournalFileBackend):
    """A journal file that is forced to the disk once a trial instead of once an entry.

    An entry that an earlier crash of the machine has left half-written is cut off.

    Raises:
        ValueError: for a file that is no journal.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._turn = KernelLock(path) if sys.platform != "win32" else JournalFileOpenLock(str(path))
        super().__init__(str(path), self._turn)
        self._check()
        if self._torn():
            self._turn.acquire()
            try:
                whole = self._path.read_bytes().rpartition(b"\n")
                os.truncate(self._path, len(whole[0]) + len(whole[1]))
            finally:
                self._turn.release()

    def append_logs(self, logs: list[dict[str, Any]]) -> None:
        """Append entries; wait for the disk if one of them changes the state of a trial."""
        lines = [json.dumps(log, separators=(",", ":")) + "\n" for log in logs]
        self._turn.acquire()
        try:
            with self._path.open("ab") as file:
                file.write("".join(lines).encode())
                file.flush()
                if any("state" in log for log in logs):
                    os.fsync(file.fileno())
        finally:
            self._turn.release()

    def _check(self) -> None:
        with self._path.open("rb") as file:
            start = file.read(len(START))
        if start and start != START:
            raise ValueError(f"{str(self._path)!r} is no journal")

    def _torn(self) -> bool:
        with self._path.open("rb") as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(max(0, size - 1))
            return size > 0 and file.read() != b"\n"
