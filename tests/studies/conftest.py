"""How the tests of the studies keep to a folder of their own and don't wait for pictures."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import psycopg
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.dashboard.pictures import Pictures
from pkm_gym.studies.search.search import SearchResult, search

# Where Debian keeps what is not on the path.
POSTGRESQL = shutil.which("initdb") or next(
    map(str, sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), reverse=True)), None
)


class Server:
    """A PostgreSQL server of our own, reached by a socket in its folder."""

    def __init__(self, folder: Path, programs: Path) -> None:
        # It refuses to run as root.
        self._user: dict[str, Any] = {"user": "postgres"} if os.getuid() == 0 else {}
        self._programs, self._folder, self._count = programs, folder, 0
        if self._user:
            shutil.chown(folder, **self._user)
        words = ["-D", folder / "data", "-U", "pkm", "-A", "trust", "--no-sync", "-E", "UTF8"]
        self._run("initdb", *words, "--locale=C").wait()

    def start(self) -> None:
        """Start it and wait until it answers."""
        options = ("-c", "listen_addresses=", "-c", "fsync=off")
        self._process = self._run(
            "postgres", "-D", self._folder / "data", "-k", self._folder, *options
        )
        while self._process.poll() is None:
            with suppress(psycopg.OperationalError), psycopg.connect(self._url("postgres")):
                return
            time.sleep(0.05)
        raise RuntimeError("PostgreSQL doesn't start")

    def stop(self, way: int = signal.SIGINT) -> None:
        """Stop it at once, open transactions are lost: in order, or with SIGQUIT as in a crash."""
        self._process.send_signal(way)
        self._process.wait()

    def new_database(self) -> str:
        """Return the URL of a new, empty database."""
        self._count += 1
        name = f"studies{self._count}"
        with psycopg.connect(self._url("postgres"), autocommit=True) as connection:
            connection.execute(f"create database {name}")  # type: ignore[call-overload]
        return self._url(name)

    def _url(self, database: str) -> str:
        return f"postgresql://pkm@/{database}?host={self._folder}"

    def _run(self, program: str, *words: Any) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [self._programs / program, *words], cwd=self._folder, stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, **self._user,
        )  # fmt: skip


@pytest.fixture
def server() -> Iterator[Server]:
    """A running PostgreSQL server with no studies."""
    if POSTGRESQL is None:
        pytest.skip("needs PostgreSQL: apt-get install postgresql")
    with tempfile.TemporaryDirectory(prefix="pkm-gym-") as folder:
        own = Server(Path(folder), Path(POSTGRESQL).parent)
        own.start()
        yield own
        own.stop()


@pytest.fixture
def diamond() -> DesignProblem:
    """The Diamond with the paper's task."""
    return pkm_gym.make_problem("diamond")


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    """Work in an empty folder; draw nothing."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Pictures, "draw", lambda *_: [])
    monkeypatch.setattr(Pictures, "promise", lambda *_: None)


@pytest.fixture
def searched(request: pytest.FixtureRequest, diamond: DesignProblem) -> Callable[..., SearchResult]:
    """Search the Diamond at random, unless told otherwise, without pictures."""
    request.getfixturevalue("undrawn")

    def run(problem: DesignProblem = diamond, **arguments: Any) -> SearchResult:
        return search(problem, **{"sampler": "random", "trials": 30, "name": "a", **arguments})

    return run
