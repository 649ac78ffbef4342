"""The built wheel works in an environment that has never seen the checkout."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import venv
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = {"pkm_gym": "pkm_gym", "agents": "pkm_gym/agents", "studies": "pkm_gym/studies"}
PIP = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]

pytestmark = pytest.mark.slow  # a build, an installation and kernels compiled anew: a minute


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Return the wheel, built from a copy of the sources."""
    folder = tmp_path_factory.mktemp("wheel")
    sources = folder / "sources"
    for room in ROOMS:
        shutil.copytree(ROOT / room, sources / room, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, sources)
    subprocess.run([*PIP, "wheel", "--no-deps", "-w", folder, sources], check=True)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def environment(wheel, tmp_path_factory) -> Path:
    """Return a new environment with the wheel in it; the libraries are those of this one."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder)
    site = next(folder.glob("lib/python*/site-packages"))
    libraries = [path for path in sys.path if path.endswith("site-packages")]
    (site / "libraries.pth").write_text("\n".join(libraries))
    python = folder / "bin" / "python"
    subprocess.run([*PIP, "--python", python, "install", "--no-deps", wheel], check=True)
    return folder


@pytest.fixture
def run(environment, tmp_path) -> Callable[..., str]:
    """Run a program of the environment in an empty folder and return what it prints."""
    known = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def program(name: str, *words: str) -> str:
        done = subprocess.run(
            [environment / "bin" / name, *words],
            cwd=tmp_path,
            env=known,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return program


def test_wheel_has_every_file_of_the_rooms_and_no_other(wheel):
    wanted = {
        f"{place}/{file.relative_to(ROOT / room).as_posix()}"
        for room, place in ROOMS.items()
        for file in (ROOT / room).rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    inside = zipfile.ZipFile(wheel).namelist()
    assert {name for name in inside if ".dist-info/" not in name} == wanted


def test_package_is_the_installed_one(run, environment):
    where = run("python", "-c", "import pkm_gym.agents; print(*pkm_gym.agents.__path__)")
    assert Path(where.strip()).is_relative_to(environment)


def test_verbs_work(run, tmp_path):
    assert "spr3_cylinder" in run("pkm-gym", "list")
    assert json.loads(run("pkm-gym", "evaluate", "diamond", "--json"))["feasible"]
    assert "verified optimum" in run("pkm-gym", "study", "diamond", "--trials", "20")
    run("pkm-gym", "design", "diamond", "--set", "task.payload=1.5kg")
    run("pkm-gym", "picture", "diamond")
    for picture in ("design.png", "picture.png"):
        assert (tmp_path / "runs" / "diamond" / picture).read_bytes().startswith(b"\x89PNG")


def test_environments_and_splits_work(run):
    for line in (
        "import gymnasium; gymnasium.make('pkm_gym:PKM/SPR3Family-v0').reset(seed=0)",
        "from pkm_gym.benchmark import load_split; load_split('spr3', 'test')",
    ):
        run("python", "-c", line)
