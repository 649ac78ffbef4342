"""Where studies live: journals, databases, and the folders of their artifacts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import optuna
from optuna.storages import BaseStorage, JournalStorage, RDBStorage

from pkm_gym.studies.cli.runs import RUNS, redacted, run_folder
from pkm_gym.studies.storage.journal import Journal

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
    """Whether a storage is there to be read; a database is taken to be."""
    return is_url(where) or Path(where).is_file()


def artifact_folder(where: str) -> Path:
    """Return the folder of a storage's artifacts: beside a journal, under runs/ for a database."""
    return RUNS / ARTIFACTS if is_url(where) else Path(where).parent / ARTIFACTS


def open_storage(where: str, *, create: bool = True) -> BaseStorage:
    """Open a journal file or a database URL.

    Args:
        where: the path of a journal, or a URL such as ``sqlite:///studies.db``.
        create: whether a missing journal is made.

    Raises:
        ValueError: in one sentence, if it can't be opened or is no storage.
    """
    if is_url(where):
        return _open_database(where)
    path = Path(where).absolute()
    if not create and not exists(where):
        raise ValueError(f"there is no storage {where!r}: `pkm-gym search` makes one")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return JournalStorage(Journal(path))
    except OSError as error:
        raise ValueError(f"can't open the storage {where!r}: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise ValueError(
            f"{where!r} is no journal of Optuna, or a damaged one: give another file, or a URL "
            "such as sqlite:///studies.db"
        ) from None


def _open_database(url: str) -> RDBStorage:
    try:
        return RDBStorage(url)
    except Exception as error:  # every database driver raises its own
        reason = str(error).strip().splitlines()[0]
        raise ValueError(f"can't open the storage {redacted(url)!r}: {reason}") from None


def study_names(storage: BaseStorage) -> list[str]:
    """Return the names of a storage's studies."""
    return optuna.get_all_study_names(storage)
