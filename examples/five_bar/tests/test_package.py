"""The example as its user has it: installed, it is an equal of the mechanisms that are shipped."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[1]

USE = """
import gymnasium as gym
for name in ("FiveBar", "FiveBarFamily", "FiveBarMotion"):
    env = gym.make(f"pkm_gym:PKM/{name}-v0")
    env.reset(seed=0)
    _, reward, *_ = env.step(env.action_space.sample())
    print(name, reward)
import pkm_gym, five_bar
assert "five_bar" in pkm_gym.problems()
assert pkm_gym.make_problem("five_bar").name == "five_bar"
print(five_bar.__file__)
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """A folder in which the built package is."""
    folder = tmp_path_factory.mktemp("site")
    source = tmp_path_factory.mktemp("source") / "five_bar"
    subprocess.run(["cp", "-r", str(EXAMPLE), str(source)], check=True)
    install = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    options = ["--no-deps", "--target", str(folder)]
    subprocess.run([*install, *options, str(source)], check=True, capture_output=True)
    return folder


def run(installed, *command):
    done = subprocess.run(
        [sys.executable, *command], env={**os.environ, "PYTHONPATH": str(installed)},
        cwd=installed, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_its_entry_point_brings_its_environments(installed):
    *rewards, where = run(installed, "-c", USE).splitlines()
    assert [line.split()[0] for line in rewards] == ["FiveBar", "FiveBarFamily", "FiveBarMotion"]
    assert Path(where).is_relative_to(installed)


def test_its_name_is_taken_by_the_command_line(installed):
    told = run(installed, "-m", "pkm_gym", "evaluate", "five_bar", "--set", "l1=280mm",
               "l2=430mm", "e=30mm")  # fmt: skip
    assert "gci" in told
    assert (installed / "five_bar" / "calibration.toml").is_file()
