"""The page's table of the Diamond's paper: nothing left out, nothing that isn't there."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import pytest
from markdown_it import MarkdownIt

from pkm_gym.core.reference import Claim, Reference, Value
from pkm_gym.mechanisms.diamond.figures import PICTURES

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "mechanisms" / "diamond.md").read_text()
REFERENCE = Reference.load("pkm_gym.mechanisms.diamond")
FOLDERS = ("mechanisms/diamond", "core")
SOURCE = "\n".join(
    file.read_text()
    for folder in FOLDERS
    for file in sorted((ROOT / "pkm_gym" / folder).iterdir())
    if file.suffix in (".py", ".toml")
)
HAS_FIGURE = {f"Fig. {n}" for n in range(1, 9)}
CODE = re.compile(r"`([^`]+)`")


class Row(NamedTuple):
    element: str
    where: str
    verdict: str
    shown: str

    @property
    def names(self) -> list[str]:
        return CODE.findall(self.where)


def rows() -> list[Row]:
    """The table below the heading Coverage."""
    table = MarkdownIt().enable("table").parse(PAGE[PAGE.index("\n## Coverage") :])
    cells = [token.content for token in table if token.type == "inline" and token.level > 3]
    found = [Row(*cells[k : k + 4]) for k in range(0, len(cells), 4)]
    assert found[0] == ("element", "where it is", "verdict", "shown by")
    return found[1:]


ROWS = rows()


def anchors() -> set[str]:
    heads = re.findall(r"^## (.+)$", PAGE, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", head.lower()).replace(" ", "-") for head in heads}


@pytest.mark.parametrize("number", range(1, 20))
def test_each_equation_has_a_row(number: int) -> None:
    assert any(row.element.startswith(f"({number})") for row in ROWS)


def test_each_figure_and_table_has_a_row() -> None:
    elements = " ".join(row.element for row in ROWS)
    for name in (*HAS_FIGURE, "table 1", "table 2", "conclusion 1", "conclusion 2"):
        assert name in elements, name


@pytest.mark.parametrize(
    "value",
    [value for value in REFERENCE.values.values() if value.verdict != "ours"],
    ids=lambda value: value.name,
)
def test_each_printed_number_has_a_row_with_its_verdict(value: Value) -> None:
    named = [row for row in ROWS if value.name in row.names]
    verdict = value.verdict.partition(" (inactive)")[0]
    assert any(row.verdict.startswith(verdict) for row in named), named


@pytest.mark.parametrize("claim", REFERENCE.claims, ids=lambda claim: claim.claim)
def test_each_statement_has_a_row_with_its_verdict(claim: Claim) -> None:
    assert [row.verdict for row in ROWS if row.element == claim.claim] == [claim.verdict]


def test_each_figure_of_the_package_shows_something() -> None:
    commands = " ".join(row.shown for row in ROWS)
    named = set(re.findall(r"pkm-gym figures diamond --only (\w+)", commands))
    assert named == set(PICTURES["diamond"])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.element)
def test_what_a_row_names_is_there(row: Row) -> None:
    assert row.verdict
    for name in row.names:
        assert re.search(rf"(?<!\w){re.escape(name)}(?!\w)", SOURCE), name
    for anchor in re.findall(r"\]\(#([^)]+)\)", row.shown):
        assert anchor in anchors(), anchor
