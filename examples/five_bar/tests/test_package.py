"""The example as its user has it: installed, it is an equal of the mechanisms that are shipped."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pkm_gym.envs import baselines
from pkm_gym.envs.motion import MotionEnv

FIVE_BAR = "five_bar.problem:FiveBarProblem"

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


def test_a_run_begins_where_the_machine_stands() -> None:
    env = MotionEnv(FIVE_BAR, start="anywhere", start_offset=0.1)
    barely_reaching = [0.4094, 0.1595, 0.1177]
    for seed in range(10):  # the joints of seed 4 would lead out of reach
        env.reset(seed=seed, options={"design": barely_reaching})
        assert env.rig.assembled


def test_a_design_whose_twin_stands_in_another_mode_is_not_driven() -> None:
    env = MotionEnv(FIVE_BAR)
    with pytest.raises(ValueError, match=r"can't be driven: its twin can't stand in its assembly"):
        env.reset(options={"design": [0.4939, 0.2438, 0.1648]})


def test_servos_keep_to_the_path() -> None:
    drive = baselines.run(MotionEnv(FIVE_BAR), baselines.servo, seed=0)
    assert drive.reason == "finished"
    assert drive.errors.max() < 1e-3
