"""A mechanism from outside: what ``pkm-gym new`` writes, in a folder of its own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import gymnasium as gym
import pytest
from typer.testing import CliRunner, Result

from pkm_gym import mechanisms
from pkm_gym.__main__ import app

NAME = "biglide"
WHERE = "biglide.problem:BiglideProblem"
TERMINAL = {"COLUMNS": "200", "TERM": "dumb", "NO_COLOR": "1"}

Run = Callable[..., Result]
Python = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Where ``pkm-gym new`` has written the mechanism."""
    folder = tmp_path_factory.mktemp("outside") / NAME
    done = CliRunner().invoke(app, ["new", NAME, "-o", str(folder)], prog_name="pkm-gym")
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture(scope="module", autouse=True)
def here(folder: Path) -> Iterator[None]:
    """Work in the mechanism's folder; what is registered meanwhile is forgotten again."""
    before = Path.cwd(), dict(gym.registry), dict(mechanisms._registered)
    os.chdir(folder)
    yield
    os.chdir(before[0])
    for known, kept in ((gym.registry, before[1]), (mechanisms._registered, before[2])):
        known.clear()
        known.update(kept)


@pytest.fixture(scope="session")
def invoke() -> Run:
    """Run ``pkm-gym`` with the given words, on a terminal wide enough for every sentence."""
    runner = CliRunner(env=TERMINAL)
    return lambda *words: runner.invoke(app, [str(word) for word in words], prog_name="pkm-gym")


@pytest.fixture(scope="session")
def run(invoke: Run) -> Callable[..., str]:
    """Run ``pkm-gym``, which must succeed, and return what it says."""

    def succeed(*words: object) -> str:
        done = invoke(*words)
        assert done.exit_code == 0, done.output
        return done.stdout

    return succeed


@pytest.fixture
def refused(invoke: Run) -> Callable[..., str]:
    """Run ``pkm-gym``, check that it refuses in one sentence and return the sentence."""

    def refuse(*words: object) -> str:
        done = invoke(*words)
        assert (done.exit_code, done.stdout) == (2, ""), done.output
        assert done.stderr.startswith("pkm-gym: ")
        assert done.stderr.count("\n") == 1
        return done.stderr.removeprefix("pkm-gym: ").rstrip()

    return refuse


@pytest.fixture
def python(folder: Path) -> Python:
    """Run Python in the mechanism's folder, in a process of its own."""

    def run_python(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, *words],
            cwd=folder,
            env={**os.environ, **TERMINAL, **environment},
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
        )

    return run_python
