"""Optuna's dashboard on storages and their artifacts."""

from __future__ import annotations

import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from socketserver import ThreadingMixIn
from typing import Any
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer, make_server

from optuna_dashboard import wsgi  # type: ignore[attr-defined]  # has no __all__

from pkm_gym.mechanisms import problem_type
from pkm_gym.studies.cli.runs import RUNS, redacted
from pkm_gym.studies.dashboard.promises import KeepingStore
from pkm_gym.studies.storage.storages import (
    JOURNAL,
    artifact_folder,
    default_storage,
    open_storage,
    quiet,
    study_names,
)

HOST = "127.0.0.1"
PORT = 8080
OWN = {"127.0.0.1", "localhost", "[::1]"}  # how a browser here calls this machine


class Server(ThreadingMixIn, WSGIServer):
    """A server whose requests don't wait for each other, nor it for them at the end."""

    daemon_threads = True


class Quiet(WSGIRequestHandler):
    """Answers requests without a line for each."""

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002  # its name there
        """Say nothing."""


def app(where: str) -> Any:
    """Return the WSGI application of Optuna's dashboard on a storage and its artifacts.

    Raises:
        ValueError: in one sentence, if the storage is missing, no storage, or holds no study.
    """
    storage = open_storage(where, create=False)
    if not study_names(storage):
        raise ValueError(f"the storage {redacted(where)!r} is empty: `pkm-gym search` fills it")
    folder = artifact_folder(where)
    folder.mkdir(parents=True, exist_ok=True)
    return _own_only(wsgi(storage, artifact_store=KeepingStore(folder)))


def _own_only(application: Any) -> Any:
    """Refuse requests to another host's name, or sent by a page of one.

    A page may have its own name point to this machine, and could then do what the dashboard does:
    read, change and delete studies.
    """

    def guarded(environ: dict[str, Any], start_response: Any) -> Any:
        host = environ.get("HTTP_HOST", "")
        origin = environ.get("HTTP_ORIGIN", f"http://{host}").partition("://")[2]
        if {_name(host), _name(origin)} <= OWN:
            return application(environ, start_response)
        start_response("403 Forbidden", [("Content-Type", "text/plain")])
        return [b"Only pages of this machine may use the dashboard.\n"]

    return guarded


def _name(address: str) -> str:
    """Return an address without its port."""
    return re.sub(r":\d*$", "", address).lower()


@contextmanager
def serving(where: str, port: int = PORT) -> Iterator[str]:
    """Serve a storage's dashboard in a thread; give its address.

    Args:
        where: a journal file or a database URL.
        port: where to listen, 0 for any free port.

    Raises:
        ValueError: in one sentence, for what ``app`` refuses or a port that is taken.
    """
    with quiet():
        application = app(where)
    try:
        server = make_server(HOST, port, application, Server, Quiet)
    except OSError as error:
        raise ValueError(
            f"can't listen on port {port} ({error.strerror}): choose another --port"
        ) from None
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield f"http://{HOST}:{server.server_port}/dashboard"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def storages(name: str | None = None, storage: str | None = None) -> list[str]:
    """Return the storages to show: the one given, a mechanism's, or all under runs/.

    Raises:
        ValueError: in one sentence, for an unknown mechanism, two choices at once, or none found.
    """
    if name is not None:
        own = problem_type(name).name
        if storage is not None:
            raise ValueError(f"{name} and --storage name two storages: leave one out")
        return [default_storage(own)]
    if storage is not None:
        return [storage]
    journals = sorted(map(str, RUNS.glob(f"*/{JOURNAL}")))
    if not journals:
        raise ValueError(
            f"there is no study under {str(RUNS.resolve())!r}: `pkm-gym search` makes one"
        )
    return journals
