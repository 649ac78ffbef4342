"""How the tests type a command."""

from __future__ import annotations

import sys
import types
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from pkm_gym.__main__ import VERBS, app

Run = Callable[..., Result]


@pytest.fixture
def run(tmp_path, monkeypatch) -> Run:
    """Run ``pkm-gym`` with the given words, in a folder of its own, on a terminal 100 wide."""
    return _run_in(tmp_path, monkeypatch, 100)


@pytest.fixture
def narrow(tmp_path, monkeypatch) -> Run:
    """The same on a terminal 80 wide."""
    return _run_in(tmp_path, monkeypatch, 80)


def _run_in(folder: Path, monkeypatch: pytest.MonkeyPatch, columns: int) -> Run:
    monkeypatch.chdir(folder)
    runner = CliRunner(env={"COLUMNS": str(columns), "TERM": "dumb", "NO_COLOR": "1"})
    return lambda *words: runner.invoke(app, [str(word) for word in words], prog_name="pkm-gym")


@pytest.fixture
def refused(run) -> Callable[..., str]:
    """Run ``pkm-gym``, check that it refuses in one sentence and return the sentence."""

    def refuse(*words: object) -> str:
        result = run(*words)
        assert result.exit_code == 2, result.output
        assert isinstance(result.exception, SystemExit)
        assert result.stderr.startswith("pkm-gym: ")
        assert result.stderr.count("\n") == 1
        assert result.stdout == ""
        return result.stderr.removeprefix("pkm-gym: ").rstrip()

    return refuse


@pytest.fixture
def verb(monkeypatch) -> Callable[[Callable[..., None]], None]:
    """Add a verb ``probe`` that calls the given function."""

    def add(function: Callable[..., None]) -> None:
        module = types.ModuleType("probe_verb")
        module.command = function
        monkeypatch.setitem(sys.modules, "probe_verb", module)
        monkeypatch.setitem(VERBS, "probe", ("probe_verb:command", "Only a test."))

    return add
