"""What is no file is refused by every verb at once, with one sentence."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from typer.testing import CliRunner

from pkm_gym.__main__ import app

VERBS = [
    ("evaluate", "diamond", "--design", "FILE"),
    ("figures", "diamond", "--design", "FILE"),
    ("motors", "diamond", "--table", "FILE"),
    ("export", "diamond", "-o", "FILE"),
    ("search", "diamond", "--trials", "1", "--storage", "FILE"),
    ("search", "diamond", "--trials", "1", "--storage", "sqlite:///FILE"),
    ("dashboard", "--no-open", "--storage", "FILE"),
    ("page", "diamond", "--into", "FILE"),
    ("score", "FILE"),
    ("benchmark", "diamond", "--tasks", "1", "--method", "random", "--evaluations", "1",
     "--leaderboard", "FILE"),
    ("restamp", "diamond", "FILE"),
    ("agent-eval", "FILE"),
    ("motion-eval", "PKM/DiamondMotion-v0", "FILE"),
    ("train", "PKM/Diamond-v0", "--params", "FILE"),
    ("train", "PKM/Diamond-v0", "--pool", "FILE"),
]  # fmt: skip


@pytest.mark.parametrize("kind", ["pipe", "device"])
@pytest.mark.parametrize("words", VERBS, ids=" ".join)
def test_what_is_no_file_is_refused_at_once(tmp_path, monkeypatch, kind, words):
    monkeypatch.chdir(tmp_path)
    name = {"agent-eval": "a.json", "motion-eval": "a.json", "export": "a.xml"}.get(words[0], "a")
    os.mkfifo(name) if kind == "pipe" else Path(name).symlink_to("/dev/zero")
    done = CliRunner().invoke(app, [word.replace("FILE", name) for word in words])
    assert done.exit_code in (1, 2), done.output
    assert isinstance(done.exception, SystemExit)
    assert name in done.stderr
    assert done.stderr.count("\n") == 1
