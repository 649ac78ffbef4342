"""What is installed: every package of the tree, and every file beside the code."""

from __future__ import annotations

import subprocess
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SETUP = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]
ROOMS = ("pkm_gym", *SETUP["package-dir"].values())


def package(folder: Path) -> str:
    """The name under which a folder of the tree is installed."""
    first, *rest = folder.relative_to(ROOT).parts
    names = {path: name for name, path in SETUP["package-dir"].items()}
    return ".".join([names.get(first, first), *rest])


def test_every_package_is_installed():
    found = {package(path.parent) for room in ROOMS for path in (ROOT / room).rglob("*.py")}
    assert found == set(SETUP["packages"])
    assert all((ROOT / room).is_dir() for room in ROOMS)


def test_every_package_says_what_it_is():
    for room in ROOMS:
        for folder in {path.parent for path in (ROOT / room).rglob("*.py")}:
            assert (folder / "__init__.py").is_file(), folder


@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="asks git which files belong to the tree")
def test_every_file_beside_the_code_is_installed():
    kept = subprocess.run(
        ["git", "ls-files", *ROOMS], cwd=ROOT, capture_output=True, text=True, check=True
    )
    for line in kept.stdout.splitlines():
        path = ROOT / line
        if path.suffix == ".py":
            continue
        owner = next(p for p in path.parents if (p / "__init__.py").is_file())
        patterns = SETUP["package-data"].get(package(owner), [])
        inside = path.relative_to(owner)
        assert any(inside.match(pattern) for pattern in patterns), f"{line} is not installed"
