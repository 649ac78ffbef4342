"""``pkm-gym dashboard``: Optuna's dashboard on the studies under runs/, pictures included."""

from __future__ import annotations

import threading
import webbrowser
from contextlib import ExitStack, suppress
from typing import Annotated

import typer

from pkm_gym.studies.cli.runs import redacted
from pkm_gym.studies.cli.terminal import console
from pkm_gym.studies.dashboard.server import PORT, serving, storages


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
