"""Optuna's journal, safe against full disks and against processes that are killed."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any

from optuna import __version__ as optuna_version
from optuna.storages.journal import JournalFileBackend, JournalFileOpenLock
from optuna.storages.journal._storage import JournalOperation

from pkm_gym.core.cache import say_once
from pkm_gym.core.files import append_lines, check_regular

if sys.platform != "win32":
    import fcntl

START = b'{"op_code":'
CODE = re.compile(START + rb"(\d+)[,}]")

# What may be left out: no number of a study or a trial depends on it.
SETTINGS = [operation for operation in JournalOperation if operation.name.startswith("SET_")]

# Stands in for it, since entries are counted: it concerns a trial that there never is.
NOTHING = {
    "op_code": JournalOperation.SET_TRIAL_USER_ATTR,
    "worker_id": "",
    "trial_id": -1,
    "user_attr": {},
}


class DamagedJournal(ValueError):  # noqa: N818 (it names the file, not the failure)
    """A file that is no journal, or one with a line that can't be read."""


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

    Half a line, as a full disk or a crash leaves it, is no entry: readers wait for its end, and it
    is cut off before anything is appended. Whole lines are never cut off, for readers hold no lock
    and have counted them. Where an entry was appended to half a line nevertheless, that entry is
    read.

    Attributes:
        line: number of the last line that was read.

    Raises:
        DamagedJournal: in one sentence, for a file that is no journal.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._turn = KernelLock(path) if sys.platform != "win32" else JournalFileOpenLock(str(path))
        check_regular(path)
        super().__init__(str(path), self._turn)
        self.line, self._offset = 0, 0
        with path.open("rb") as file:
            start = file.read(len(START))
        if not START.startswith(start):
            raise DamagedJournal(f"{str(path)!r} is no journal of Optuna: give another file")

    def append_logs(self, logs: list[dict[str, Any]]) -> None:
        """Append entries; wait for the disk if one of them changes the state of a trial.

        Raises:
            OSError: where they can't be written; it names the file.
        """
        text = "".join(json.dumps(log, separators=(",", ":")) + "\n" for log in logs)
        self._turn.acquire()
        try:
            append_lines(self._path, text, sync=any("state" in log for log in logs))
        finally:
            self._turn.release()

    def read_logs(self, log_number_from: int) -> Generator[dict[str, Any], None, None]:
        """Yield the entries from one on; a line that has no end yet is left for later.

        Raises:
            DamagedJournal: in one sentence naming the line, for one that can't be left out.
        """
        line, offset = (self.line, self._offset) if self.line == log_number_from else (0, 0)
        with self._path.open("rb", buffering=0) as file:
            size = file.seek(0, os.SEEK_END)
            file.seek(offset)
            *texts, _ = file.read(max(size - offset, 0)).split(b"\n")
        for text in texts:
            line += 1
            offset += len(text) + 1
            if line > log_number_from:
                entry = self._entry(text, f"{str(self._path)!r}, line {line},")
                self.line, self._offset = line, offset
                yield entry

    def _entry(self, text: bytes, place: str) -> dict[str, Any]:
        """Return the entry in a line: of two that were glued together, the last one."""
        last = max(text.rfind(START), 0)
        entry = _decoded(text)
        if entry is None and (entry := _decoded(text[last:])):
            say_once(f"{place} begins with half an entry, which is left out")
        code = CODE.match(text, last)
        if entry is None and code and int(code[1]) in SETTINGS:
            say_once(f"{place} is damaged and left out")
            return NOTHING
        if entry is None:
            raise DamagedJournal(f"{place} is damaged: restore the file, or give another --storage")
        if type(entry["op_code"]) is not int or entry["op_code"] not in list(JournalOperation):
            raise DamagedJournal(
                f"{place} has the unknown op_code {entry['op_code']!r}: it is damaged, or of a "
                f"newer Optuna than {optuna_version}"
            )
        return entry


def _decoded(text: bytes) -> dict[str, Any] | None:
    """Return the entry that a text is, or None."""
    try:
        entry = json.loads(text)
    except (ValueError, RecursionError):
        return None
    whole = isinstance(entry, dict) and {"op_code", "worker_id"} <= entry.keys()
    return entry if whole else None
