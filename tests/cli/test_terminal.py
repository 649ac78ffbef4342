"""Tables on narrow terminals: no number and no word is cut."""

from __future__ import annotations

import io

import hypothesis
import pytest
from hypothesis import strategies as st
from rich.console import Console

from pkm_gym.mechanisms import make_problem, problems
from pkm_gym.studies.cli.terminal import table
from pkm_gym.studies.dashboard.pictures import Pictures

CUT = "\u2026"  # what rich ends a cut text with

TABLES = {
    "list": ("list",),
    "grid": ("grid", "diamond"),
    "a coarse grid": ("grid", "spr3", "--step", 0.1),
    "search": ("search", "stroke_leg", "--sampler", "qmc", "--trials", 2),
    "another task": ("search", "diamond", "--trials", 5, "--set", "task.payload=1kg"),
    "polish": ("polish", "diamond"),
    "compare": ("compare", "diamond", "--seeds", 2, "--evaluations", 8),
    "every variable": ("compare", "pus6_layout", "--seeds", 1, "--evaluations", 2),
    "solve-tasks": ("solve-tasks", "diamond", "-n", 3),
    "design": ("design", "spr3_cylinder", "--budget", 3),
    "zoo": ("zoo",),
    "motors": ("motors", "diamond"),
    "a load": ("evaluate", "pus6", "--load", "force=100N", "torque=5Nm"),
    "twin-check": ("twin-check", "diamond", "--designs", 0),
    "motion-eval": ("motion-eval", "PKM/DiamondMotion-v0"),
    "calibrate": ("calibrate", "spr3_cylinder", "-n", 1),
}


@pytest.fixture(autouse=True)
def undrawn(monkeypatch):
    """Draw nothing."""
    monkeypatch.setattr(Pictures, "draw", lambda *_: [])
    monkeypatch.setattr("pkm_gym.studies.verbs.evaluate.draw", lambda *_: None)


@pytest.mark.parametrize("words", TABLES.values(), ids=TABLES)
def test_no_table_of_a_verb_is_cut_at_80_columns(narrow, words):
    result = narrow(*words)
    assert result.exit_code == 0, result.stderr
    assert "\u2500" in result.stdout
    assert CUT not in result.stdout


@pytest.mark.parametrize("name", problems())
@pytest.mark.parametrize("verb", ["list", "evaluate"])
def test_no_table_of_a_problem_is_cut_at_80_columns(narrow, verb, name):
    result = narrow(verb, name)
    assert result.exit_code == 0, result.stderr
    assert CUT not in result.stdout


CELLS = st.text("abc ", max_size=30)
NUMBERS = st.integers(0, 10**14).map(str)


@hypothesis.given(
    rows=st.lists(st.tuples(CELLS, NUMBERS, NUMBERS, CELLS, NUMBERS), min_size=1, max_size=4),
    width=st.integers(36, 90),
)
def test_every_cell_stands_whole_within_the_line(rows, width):
    """Numbers in one line; of words every letter, in its order."""
    sheet = table("name", "first", "second", "words", "third", numbers=("first", "second", "third"))
    for row in rows:
        sheet.add_row(*row)
    written = io.StringIO()
    Console(file=written, width=width).print(sheet)
    lines = written.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    assert CUT not in written.getvalue()
    found = " ".join(lines).split()
    for name, first, second, _, third in rows:
        for number in (first, second, third):
            assert number in found
        for word in name.split():
            assert len(word) > width // 2 or word in found
    assert sheet.row_count == len(rows)


def test_columns_that_do_not_fit_stand_below_beside_the_first():
    sheet = table("way", "a", "b", numbers="ab")
    sheet.add_row("paper's grid", "1" * 10, "2" * 10)
    written = io.StringIO()
    Console(file=written, width=26).print(sheet)
    rows = [line.split("  ") for line in written.getvalue().splitlines() if "grid" in line]
    assert rows == [["paper's grid", "1" * 10], ["paper's grid", "2" * 10]]


@pytest.mark.parametrize("name", problems())
def test_a_design_is_whole_beside_a_task_that_is_all_of_the_user_s_own(narrow, name):
    fields = make_problem(name).task_variables
    words = [f"task.{field.name}={field.high!r}" for field in fields if field.drawn]
    result = narrow("evaluate", name, "--set", *words)
    assert result.exit_code == 0, result.stderr
    assert CUT not in result.stdout
