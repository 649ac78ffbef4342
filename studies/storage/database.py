"""Databases: their tables made by one process while others wait, waited for when they are away."""

from __future__ import annotations

import random
import time
import weakref
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from optuna.exceptions import StorageInternalError
from optuna.storages import RDBStorage
from optuna.storages._cached_storage import _CachedStorage
from sqlalchemy import Connection, event
from sqlalchemy.engine import make_url
from sqlalchemy.exc import (
    IntegrityError,
    InterfaceError,
    OperationalError,
    PendingRollbackError,
    ProgrammingError,
    SQLAlchemyError,
)

from pkm_gym.studies.cli.runs import redacted

PATIENCE = 60.0  # seconds that a database may be away, or busy with others
ATTEMPTS = 20  # to find the tables made, while other processes make them too

FAILURES = (SQLAlchemyError, StorageInternalError)
AWAY = (OperationalError, InterfaceError, PendingRollbackError)  # the last one in its wake
BUSY = "SQLITE_BUSY"


class Database(_CachedStorage):
    """A database; an operation that fails because it is away or busy is tried again for a minute.

    Args:
        url: of the database.
        create: whether its tables are made, and written to.

    Raises:
        ValueError: in one sentence, if it can't be opened. An operation raises TimeoutError where
            it is away for longer, OSError where it fails otherwise.
    """

    def __init__(self, url: str, *, create: bool) -> None:
        self._name = repr(redacted(url))
        self._away_since: float | None = None
        try:
            super().__init__(_connected(url, create=create))
        except Exception as error:  # every driver raises its own
            raise ValueError(f"can't open the storage {self._name}: {_reason(error)}") from None
        weakref.finalize(self, self._backend.engine.dispose)

    def _endure(self, failure: Exception) -> None:
        """Wait a moment after a failure that may pass, unless that has been done for long."""
        if not _may_pass(failure):
            raise OSError(
                f"the storage {self._name} failed: {_reason(failure)}; what it was told is kept"
            ) from failure
        now = time.monotonic()
        self._away_since = self._away_since or now
        if now - self._away_since > PATIENCE:
            raise TimeoutError(
                f"the storage {self._name} has not answered for {PATIENCE:.0f} s ("
                f"{_reason(failure)}): what it was told is kept there, and the same command goes on"
            ) from failure
        time.sleep(random.uniform(0.05, 0.5))


def _patient(operation: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(operation)
    def patient(self: Database, *arguments: Any, **named: Any) -> Any:
        while True:
            try:
                answer = operation(self, *arguments, **named)
            except FAILURES as failure:
                self._endure(failure)
            else:
                self._away_since = None
                return answer

    return patient


for _name, _operation in vars(_CachedStorage).items():
    if not _name.startswith("_"):
        setattr(Database, _name, _patient(_operation))


def is_there(url: str) -> bool:
    """Whether a database is there to be read; that of a server is taken to be."""
    try:
        parts = make_url(url)
    except (SQLAlchemyError, ValueError):
        return True  # and opening it says what is wrong
    file = (parts.database or "").removeprefix("file:")
    return parts.get_backend_name() != "sqlite" or Path(file).is_file()


def _connected(url: str, *, create: bool) -> RDBStorage:
    """Return Optuna's storage once its tables are made, be it by another process meanwhile."""
    sqlite = make_url(url).get_backend_name() == "sqlite"
    own = {"isolation_level": None} if sqlite and create else {}
    kept = {"pool_pre_ping": True, "connect_args": own}
    for left in reversed(range(ATTEMPTS)):
        try:
            storage = RDBStorage(url, kept, skip_table_creation=not create)
            break
        except FAILURES as failure:
            if not (left and create and _is_new(failure)):
                raise
            time.sleep(random.uniform(0.05, 0.3))
    if own:
        event.listen(storage.engine, "begin", _begin)
    return storage


def _begin(connection: Connection) -> None:
    """Let no other process write between what a transaction reads and what it writes."""
    connection.exec_driver_sql("BEGIN IMMEDIATE")


def _may_pass(failure: Exception) -> bool:
    """Whether it is likely to work later: the server is away, or the file is being written to."""
    cause = _cause(failure)
    return isinstance(cause, AWAY) and _of_sqlite(cause, BUSY).startswith(BUSY)


def _is_new(failure: Exception) -> bool:
    """Whether a failure may be that of two processes that make the same tables."""
    cause = _cause(failure)
    made = isinstance(cause, (IntegrityError, ProgrammingError))
    return made or _of_sqlite(cause, "").startswith((BUSY, "SQLITE_ERROR"))


def _of_sqlite(cause: BaseException, otherwise: str) -> str:
    """Return SQLite's name of an error, or what to take for one of another database."""
    return str(getattr(getattr(cause, "orig", None), "sqlite_errorname", otherwise))


def _cause(failure: BaseException) -> BaseException:
    """Return what Optuna wraps."""
    wrapped = isinstance(failure, StorageInternalError) and failure.__cause__
    return wrapped or failure


def _reason(failure: BaseException) -> str:
    """Return what a driver says, in one line, or which one is missing."""
    cause = _cause(failure)
    if isinstance(cause, ImportError) and isinstance(cause.__cause__, ModuleNotFoundError):
        return f"the Python module {cause.__cause__.name} is not installed"
    return str(getattr(cause, "orig", None) or cause).strip().splitlines()[0]
