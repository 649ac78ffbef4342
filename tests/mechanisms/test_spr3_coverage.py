"""The page's coverage of the 3-SPR's paper: nothing is left out, and it says what the code says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from markdown_it import MarkdownIt

import pkm_gym
from pkm_gym.core.reference import Reference
from pkm_gym.mechanisms.spr3.claims import claims, driven
from pkm_gym.mechanisms.spr3.figures import PICTURES

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "mechanisms" / "spr3.md"
REFERENCE = Reference.load("pkm_gym.mechanisms.spr3")
PRINTED = [value for value in REFERENCE.values.values() if value.printed is not None]
NAMED = re.compile(r"`([^`]+)`")


class Row(NamedTuple):
    """A row of the table of coverage."""

    element: str
    where: str
    verdict: str
    shown: str


def rows() -> list[Row]:
    text = PAGE.read_text().partition("## Coverage\n")[2]
    lines = [line for line in text.splitlines() if line.startswith("|")]
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    assert cells[0] == ["element", "where it is", "verdict", "shown by"]
    return [Row(*line) for line in cells[2:]]


ROWS = rows()


def test_every_equation_figure_and_table_has_a_row() -> None:
    text = "\n".join(row.element for row in ROWS)
    equations = {int(number) for number in re.findall(r"\((\d+)\)", text)}
    assert equations == set(range(1, 23))
    assert {int(number) for number in re.findall(r"Fig\. (\d)", text)} == set(range(1, 7))
    for section in ("abstract", "introduction", "1.1", "1.2", "2.3", "3", "4", "5", "table 1"):
        assert section in text


def test_every_row_has_a_verdict() -> None:
    assert all(row.verdict for row in ROWS)
    assert len({row.element for row in ROWS}) == len(ROWS)


@pytest.mark.parametrize("value", PRINTED, ids=lambda value: value.name)
def test_every_printed_number_has_a_row_with_its_verdict(value: Any) -> None:
    verdicts = [row.verdict for row in ROWS if value.name in NAMED.findall(row.element)]
    assert len(verdicts) == 1
    assert verdicts[0].startswith(value.verdict)


def test_no_row_names_a_number_that_is_not_printed() -> None:
    named = {name for row in ROWS for name in NAMED.findall(row.element)}
    assert named == {value.name for value in PRINTED}


def test_every_statement_has_a_row_with_its_verdict() -> None:
    problem = pkm_gym.make_problem("spr3")
    machine: Any = problem.mechanism(problem.printed_design())
    for claim in (*REFERENCE.claims, *claims(machine, driven(machine, 5.0))):
        place = claim.claim.partition(":")[0].lower()
        found = [row for row in ROWS if row.element.lower().startswith(place)]
        assert any(row.verdict.startswith(claim.verdict) for row in found), claim.claim


def test_every_figure_of_the_paper_is_drawn_and_named() -> None:
    shown = re.findall(r"figures spr3 --only (\w+)", " ".join(row.shown for row in ROWS))
    assert set(shown) <= set(PICTURES["spr3"])
    assert {name for name in PICTURES["spr3"] if name.startswith("fig")} <= set(shown)
    for name in (name for name in shown if name.startswith("fig")):
        number = name[3]
        (row,) = (r for r in ROWS if f"--only {name}`" in r.shown and f"Fig. {number}" in r.element)
        assert f"Fig. {number}" in PICTURES["spr3"][name].caption
        assert row.verdict.startswith("drawn")


def test_the_code_that_a_row_names_is_there() -> None:
    folders = (ROOT / "pkm_gym" / "mechanisms" / "spr3", ROOT / "pkm_gym" / "core")
    source = "\n".join(file.read_text() for folder in folders for file in folder.glob("*.py"))
    files = {file.name for folder in folders for file in folder.glob("*.py")}
    for row in ROWS:
        for name in NAMED.findall(row.where):
            last = re.sub(r"\(.*\)", "", name).split(".")[-1]
            assert name in files or re.search(rf"\b{last}\b", source), name


def test_sections_that_are_linked_are_there() -> None:
    heads = {
        "#" + re.sub(r"[^\w -]", "", token.content.lower()).replace(" ", "-")
        for token in MarkdownIt().parse(PAGE.read_text())
        if token.type == "inline" and token.level == 1 and "\n" not in token.content
    }
    for row in ROWS:
        for link in re.findall(r"\]\((#[^)]+)\)", "".join(row)):
            assert link in heads, link
