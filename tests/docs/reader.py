"""Read a page as its reader would: run its examples in order and compare what they print.

``python reader.py PAGE [--all]`` runs in the current folder. Of a page's fenced blocks

* ``python`` is run, all blocks of a page in one process; one that starts with ``# NAME.py`` is also
  saved under that name. A ``text`` block after it is what it prints.
* ``console`` holds commands after ``$`` and below each what it prints, on both streams.
* A comment ``<!-- slow: why -->`` above a block leaves it to ``--all``; one that says
  ``<!-- not run: why -->`` leaves it alone.

What is pasted must be what is printed, but for two things: a time at the end of a line
(``14.7 s``) stands for any time, and ``...`` for anything. The line that says that kernels are
being compiled is left out.
"""

from __future__ import annotations

import contextlib
import doctest
import io
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from markdown_it import MarkdownIt

# a command, which a backslash continues, and what is pasted below it
COMMAND = re.compile(r"^\$ (.*(?:\\\n.*)*)\n((?:(?!\$ ).*\n)*)", re.MULTILINE)
TIME = re.compile(r"\d+(\.\d+)? s *$", re.MULTILINE)
COMPILING = re.compile(r"^pkm_gym: compiling kernels.*\n", re.MULTILINE)


class Block(NamedTuple):
    """A fenced block: its language, its text, its first line in the page, what is said above it."""

    language: str
    text: str
    line: int
    remark: str


def blocks(page: Path) -> Iterator[Block]:
    """Yield the page's fenced blocks."""
    remark = ""
    for token in MarkdownIt().parse(page.read_text()):
        if token.type == "fence":
            assert token.map
            yield Block(token.info.strip(), token.content, token.map[0] + 1, remark)
        remark = ""
        if token.type == "html_block" and token.content.startswith("<!--"):
            remark = token.content.removeprefix("<!--").partition("-->")[0].strip()


def differences(wanted: str, printed: str) -> str:
    """Return how what was printed differs from what is pasted, "" where it does not."""
    printed = COMPILING.sub("", printed)
    wanted, printed = (
        "\n".join(line.rstrip() for line in TIME.sub("0 s", text).strip().splitlines()) + "\n"
        for text in (wanted, printed)
    )
    checker = doctest.OutputChecker()
    if checker.check_output(wanted, printed, doctest.ELLIPSIS):
        return ""
    example = doctest.Example("", wanted)
    return checker.output_difference(example, printed, doctest.ELLIPSIS | doctest.REPORT_NDIFF)


def run_python(page: Path, block: Block, names: dict[str, Any]) -> str:
    """Run the block with these names and return what it prints."""
    first, _, _ = block.text.partition("\n")
    if re.fullmatch(r"# \w+\.py", first):
        Path(first.removeprefix("# ")).write_text(block.text)
    printed = io.StringIO()
    in_page = "\n" * block.line + block.text  # a traceback tells the line of the page
    with contextlib.redirect_stdout(printed):
        exec(compile(in_page, page, "exec", dont_inherit=True), names)
    return printed.getvalue()


def run_console(text: str) -> Iterator[tuple[str, str]]:
    """Run the commands and yield for each what is pasted below it and what it prints."""
    for command, pasted in COMMAND.findall(text):
        both = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
        yield pasted, subprocess.run(command, shell=True, check=False, **both).stdout


def read(page: Path, *, everything: bool) -> int:
    """Run the page and return how many outputs differ."""
    wrong, names = 0, {"__name__": "__main__"}
    found = list(blocks(page))
    for block, after in zip(found, [*found[1:], Block("", "", 0, "")], strict=True):
        if block.remark.startswith("not run:"):
            continue
        if block.remark.startswith("slow:") and not everything:
            continue
        pairs: list[tuple[str, str]] = []
        if block.language == "python":
            printed = run_python(page, block, names)
            pairs = [(after.text, printed)] if after.language == "text" else []
        elif block.language == "console":
            pairs = list(run_console(block.text))
        for wanted, printed in pairs:
            if difference := differences(wanted, printed):
                print(f"{page.name}, line {block.line}:\n{difference}")
                wrong += 1
    return wrong


if __name__ == "__main__":
    sys.exit(bool(read(Path(sys.argv[1]), everything="--all" in sys.argv)))
