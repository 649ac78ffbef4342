"""``pkm-gym dashboard``: Optuna's dashboard on the studies under runs/, pictures included."""

from __future__ import annotations

import threading
import webbrowser
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from socketserver import ThreadingMixIn
from typing import Annotated, Any
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer, make_server

import typer
from optuna.artifacts import FileSystemArtifactStore
from optuna_dashboard import wsgi  # type: ignore[attr-defined]  # has no __all__

from pkm_gym.core.names import check_known
from pkm_gym.mechanisms import problems
from pkm_gym.studies.storage import (
    JOURNAL,
    RUNS,
    artifact_folder,
    default_storage,
    open_storage,
    quiet,
    redacted,
    study_names,
)
from pkm_gym.studies.terminal import console

HOST = "127.0.0.1"
PORT = 8080


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
    return wsgi(storage, artifact_store=FileSystemArtifactStore(folder))


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
        check_known("mechanism", [name], problems())
        if storage is not None:
            raise ValueError(f"{name} and --storage name two storages: leave one out")
        return [default_storage(name)]
    if storage is not None:
        return [storage]
    found = sorted(map(str, RUNS.glob(f"*/{JOURNAL}")))
    if not found:
        raise ValueError(
            f"there is no study under {str(RUNS.resolve())!r}: `pkm-gym search` makes one"
        )
    return found


def command(
    name: Annotated[
        str | None,
        typer.Argument(metavar="[NAME]", help="Show this mechanism's studies only."),
    ] = None,
    storage: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|URL", help="Another journal file or a database URL.", show_default=False
        ),
    ] = None,
    port: Annotated[
        int, typer.Option(min=0, max=65535, help="Where to listen, 0 for any free port.")
    ] = PORT,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open a browser.")] = True,
) -> None:
    """Open the studies in a browser: trials, graphs, notes and pictures.

    Without a name, every mechanism that has studies under runs/ is shown, each at a port of its
    own.
    """
    screen = console()
    with ExitStack() as stack, suppress(KeyboardInterrupt):
        for i, where in enumerate(storages(name, storage)):
            address = stack.enter_context(serving(where, port + i if port else 0))
            screen.print(f"{redacted(where)}: {address}", soft_wrap=True)
            if open_:
                webbrowser.open(address)
        screen.print("Ctrl-C ends it")
        threading.Event().wait()
