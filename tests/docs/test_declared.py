"""What pages restate of declarations is made from them, and code that they show is an example's."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import pkm_gym
from pkm_gym.studies.report.page import framed

from .reader import blocks

ROOT = Path(__file__).parents[2]
PAGES = {page: page.read_text(encoding="utf-8") for page in sorted((ROOT / "docs").rglob("*.md"))}
GUIDE = ROOT / "docs" / "add_a_mechanism.md"
SOURCE = re.compile(r"`(five_bar/\w+\.py|pyproject\.toml)`")


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_a_page_holds_what_is_declared_of_a_problem(name: str) -> None:
    made = framed(name)
    holders = [page for page, text in PAGES.items() if made.partition("\n")[0] in text]
    assert len(holders) == 1, f"pkm-gym page {name} --into a page"
    again = f"pkm-gym page {name} --into {holders[0].relative_to(ROOT)}"
    assert made in PAGES[holders[0]], again


def test_the_code_of_the_guide_is_that_of_the_example() -> None:
    text = GUIDE.read_text(encoding="utf-8")
    shown = [block for block in blocks(GUIDE) if block.language in ("python", "toml")]
    assert len(shown) > 5
    for block in shown:
        before = "\n".join(text.splitlines()[: block.line])
        file = ROOT / "examples" / "five_bar" / SOURCE.findall(before)[-1]
        for part in block.text.split("...\n"):
            code = part.rstrip()
            assert code in file.read_text(encoding="utf-8"), f"line {block.line}: {file.name}"
