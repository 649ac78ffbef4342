"""A mechanism that is installed with an entry point: known by its name; a broken one is said."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest


@pytest.fixture
def install(tmp_path: Path, folder: Path) -> Callable[..., dict[str, str]]:
    """Install entry points beside the mechanism; return the environment that finds them."""

    def make(**points: str) -> dict[str, str]:
        info = tmp_path / "plugins-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: plugins\nVersion: 1.0\n")
        lines = [f"{name} = {where}" for name, where in points.items()]
        (info / "entry_points.txt").write_text("\n".join(["[pkm_gym.mechanisms]", *lines, ""]))
        (tmp_path / "broken_module.py").write_text("import math\n\nmath.nothing\n")
        return {"PYTHONPATH": f"{tmp_path}:{folder}"}

    return make


def test_its_name_is_enough(python, install):
    environment = install(biglide="biglide.problem:BiglideProblem")
    code = (
        "import sys, gymnasium, pkm_gym\n"
        "assert 'biglide' in pkm_gym.problems()\n"
        "assert not [name for name in sys.modules if name.startswith('biglide')]\n"
        "gymnasium.make('PKM/BiglideFamily-v0').reset(seed=0)\n"
        "print(pkm_gym.mechanisms.called(pkm_gym.make_problem('biglide')))\n"
    )
    done = python("-W", "error", "-c", code, **environment)
    assert (done.returncode, done.stdout) == (0, "biglide\n"), done.stderr
    done = python("-m", "pkm_gym", "list", **environment)
    assert "PKM/BiglideFamily-v0" in done.stdout
    assert done.stderr == ""


def test_a_broken_one_is_one_line_in_listings_and_a_sentence_by_its_name(python, install):
    environment = install(broken="broken_module:Problem")
    listed = python("-m", "pkm_gym", "list", **environment)
    assert listed.returncode == 0
    assert "diamond" in listed.stdout
    sentence = (
        "pkm-gym: the mechanism 'broken_module:Problem' can't be imported: AttributeError: module "
        "'math' has no attribute 'nothing' ("
    )
    assert listed.stderr.startswith(sentence)
    assert listed.stderr.count("\n") == 1
    asked = python("-m", "pkm_gym", "evaluate", "broken", **environment)
    assert (asked.returncode, asked.stdout) == (2, "")
    assert asked.stderr.startswith(sentence)
    assert asked.stderr.endswith("broken_module.py, line 3)\n")
