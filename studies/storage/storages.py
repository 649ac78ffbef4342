"""Where studies live: journals, databases, and the folders of their artifacts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import optuna
from optuna.storages import BaseStorage, JournalStorage

from pkm_gym.studies.cli.runs import RUNS, redacted, run_folder
from pkm_gym.studies.storage.journal import DamagedJournal, Journal

JOURNAL = "studies.journal"
ARTIFACTS = "artifacts"


@contextmanager
def quiet() -> Iterator[None]:
    """Keep Optuna from logging what is said elsewhere."""
    before = optuna.logging.get_verbosity()
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    try:
        yield
    finally:
        optuna.logging.set_verbosity(before)


def is_url(where: str) -> bool:
    """Whether a storage is a database, not a journal file."""
    return "://" in where


def default_storage(name: str) -> str:
    """Return the journal in which a problem's studies are kept."""
    return str(run_folder(name) / JOURNAL)


def exists(where: str) -> bool:
    """Whether a storage is there to be read; a database of a server is taken to be."""
    if not is_url(where):
        return Path(where).is_file()
    from pkm_gym.studies.storage.database import is_there

    return is_there(where)


def artifact_folder(where: str) -> Path:
    """Return the folder of a storage's artifacts: beside a journal, under runs/ for a database."""
    return RUNS / ARTIFACTS if is_url(where) else Path(where).parent / ARTIFACTS


def open_storage(where: str, *, create: bool = True) -> BaseStorage:
    """Open a journal file or a database URL.

    Args:
        where: the path of a journal, or a URL such as ``sqlite:///studies.db``.
        create: whether what is missing is made.

    Raises:
        ValueError: in one sentence, if it can't be opened or is no storage.
    """
    if not create and not exists(where):
        raise ValueError(f"there is no storage {redacted(where)!r}: `pkm-gym search` makes one")
    if not is_url(where):
        return _open_journal(where)
    from pkm_gym.studies.storage.database import Database

    return Database(where, create=create)


def _open_journal(where: str) -> JournalStorage:
    path = Path(where).absolute()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        journal = Journal(path)
    except OSError as error:
        raise ValueError(f"can't open the storage {where!r}: {error.strerror or error}") from None
    try:
        return JournalStorage(journal)
    except DamagedJournal:
        raise
    except (ValueError, KeyError, TypeError, AttributeError, AssertionError):
        raise ValueError(
            f"{where!r}, line {journal.line}, is damaged: restore the file, or give another "
            "--storage"
        ) from None


def study_names(storage: BaseStorage) -> list[str]:
    """Return the names of a storage's studies."""
    return optuna.get_all_study_names(storage)
