"""Counts that would take more memory than there is are refused at once, and leave nothing."""

from __future__ import annotations

import re

import pytest

HUGE = 10**12


@pytest.mark.parametrize(
    ("words", "what"),
    [
        (("solve-tasks", "diamond", "-n", HUGE), "-n"),
        (("calibrate", "diamond", "-n", HUGE), "-n"),
        (("search", "diamond", "--trials", HUGE), "--trials"),
        (("search", "diamond", "--batch", HUGE), "--batch"),
        (("study", "diamond", "--trials", HUGE), "--trials"),
        (("compare", "diamond", "--evaluations", HUGE), "--evaluations"),
        (("benchmark", "diamond", "--evaluations", HUGE), "--evaluations"),
    ],
)
def test_what_would_take_too_much_memory_is_refused(refused, tmp_path, words, what):
    said = refused(*words)
    assert re.fullmatch(
        rf"{what} {HUGE} would take [\d,]+ GB of memory: choose at most [\d,]+", said
    )
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ("dashboard", "--storage", "sqlite:///nope.db", "--no-open"),
        ("dashboard", "--storage", "nope.journal", "--no-open"),
        ("search", "diamond", "--storage", "x.journal", "--sampler", "designer", "--objective",
         "tau_rms"),
        ("search", "diamond", "--storage", "sqlite:///x.db", "--warm-start", "nope"),
        ("train", "PKM/Diamond-v0", "--pool", "none.npz", "-o", "r"),
        ("train", "PKM/Diamond-v0", "--set", "environment.budget=0", "-o", "r"),
        ("tune", "PKM/Diamond-v0", "--pool", "none.npz", "-o", "r"),
        ("grid", "diamond", "--step", "1e-9", "-o", "x.nc"),
    ],
)  # fmt: skip
def test_what_is_refused_leaves_nothing_behind(refused, tmp_path, words):
    refused(*words)
    assert list(tmp_path.iterdir()) == []
