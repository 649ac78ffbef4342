"""What the README and the pages show runs as it stands and prints what is pasted."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

from pkm_gym.__main__ import VERBS, _load

from .reader import blocks, differences

ROOT = Path(__file__).parents[2]
SCRIPTS = Path(sys.executable).parent
READER = Path(__file__).with_name("reader.py")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
SLOW = pytest.mark.slow
LANGUAGES = {"python", "console", "text", "sh", "toml"}
RUN = {"python", "console"}
COMMAND = re.compile(r"\bpkm-gym ([a-z][^;&#>\n]*)")


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


def runs() -> Iterator[object]:
    """Each page with something to run, once without and once with its slow blocks."""
    for page in PAGES:
        shown = [block for block in blocks(page) if block.language in RUN]
        remarks = {block.remark.partition(":")[0] for block in shown}
        if remarks - {"slow", "not run"}:
            yield pytest.param(page, [], id=named(page))
        if "slow" in remarks:
            yield pytest.param(page, ["--all"], id=f"{named(page)}-all", marks=SLOW)


def commands() -> Iterator[str]:
    """Each ``pkm-gym VERB ...`` that a page names."""
    for page in PAGES:
        tokens = MarkdownIt().enable("table").parse(page.read_text())
        children = [child for token in tokens for child in token.children or ()]
        for token in (*tokens, *children):
            if token.type in ("fence", "code_inline"):
                text = token.content.replace("\\\n", " ")
                text = text.replace("\n", " ") if token.type == "code_inline" else text
                yield from (command.strip() for command in COMMAND.findall(text))


@pytest.mark.parametrize(("page", "flags"), [*runs()])
def test_page_runs_and_prints_what_is_pasted(page, flags, tmp_path):
    environment = {
        **os.environ, "COLUMNS": "80", "MPLBACKEND": "agg", "NO_COLOR": "1",
        "OMP_NUM_THREADS": "1",  # PyTorch's threads wait for each other where cores are busy
        "PATH": f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}",
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, READER, page, *flags],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr[-2000:]}"


@pytest.mark.parametrize("command", sorted(set(commands())))
def test_command_that_a_page_names_is_understood(command):
    verb, *words = shlex.split(command.replace("$s", "0"))  # a loop over seeds
    if words:  # a verb alone is a mention
        _load(verb).make_context(verb, words)
    assert verb in VERBS


METHOD = """
from pkm_gym.benchmark import method, proposing

@method(evaluations=3)
def {}(view, training):
    return proposing(lambda session: session.generator.uniform(view.low, view.high))
"""


def with_own_methods() -> set[str]:
    """Each command that a page shows with a method of the reader's."""
    shown = {block.text for page in PAGES for block in blocks(page) if block.language == "sh"}
    found = {f"pkm-gym {command.strip()}" for text in shown for command in COMMAND.findall(text)}
    return {command for command in found if re.search(r"--method \w+:", command)}


def installed(folder: Path, shell: str) -> subprocess.CompletedProcess[str]:
    """Run a shell's lines with the installed command, whose path lacks the current folder."""
    environment = {**os.environ, "PATH": f"{SCRIPTS}{os.pathsep}{os.environ['PATH']}"}
    return subprocess.run(
        ["bash", "-e", "-c", shell],
        cwd=folder, env=environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


@pytest.mark.parametrize("command", sorted(with_own_methods()))
def test_a_command_with_a_method_of_yours_runs_as_it_stands(command, tmp_path):
    module, name = re.search(r"--method (\w+):(\w+)", command).groups()
    (tmp_path / f"{module}.py").write_text(METHOD.format(name))
    done = installed(tmp_path, command)
    assert done.returncode == 0, done.stderr
    assert f"{module}:{name}" in done.stdout


@SLOW
def test_a_mechanism_of_yours_is_trained_on_as_the_page_says(tmp_path):
    page = ROOT / "docs" / "agents.md"
    (block,) = (block for block in blocks(page) if "pkm-gym new mine" in block.text)
    done = installed(tmp_path, block.text)
    assert done.returncode in {0, 1}, done.stderr  # 1: what the agent designs isn't feasible
    assert (tmp_path / "mine" / "runs" / "agents" / "MineFamily-v0-ppo-0" / "best.json").exists()
    assert (tmp_path / "mine" / "runs" / "mine" / "design.toml").exists()


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_blocks_are_of_kinds_that_are_checked(page):
    before = ""
    for block in blocks(page):
        place = f"{named(page)}, line {block.line}"
        assert block.language in LANGUAGES, place
        assert block.language != "text" or before == "python", f"{place}: who prints this?"
        assert not block.remark or re.match(r"(slow|not run): \w", block.remark), place
        before = block.language


def test_another_figure_is_seen():
    assert differences("regret 1.566 %", "regret 1.563 %\n")
    assert differences("two\nlines", "two\nlines\nand a third\n")
    assert not differences("in 14.7 s", "pkm_gym: compiling kernels ...\nin 9.3 s\n")
    assert not differences("first\n...\nlast", "first\nmore\nlast\n")
