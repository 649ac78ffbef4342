"""``pkm-gym motors``, and the loads of ``pkm-gym evaluate``."""

from __future__ import annotations

import json
import shlex
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.drives import cycle_drives, has_dynamics
from pkm_gym.core.motor_choice import fits, pick
from pkm_gym.core.motors import read_motors
from pkm_gym.core.statics import held, load_units
from pkm_gym.studies.cli.arguments import design_from
from pkm_gym.studies.cli.design_file import write_design

NAMES = pkm_gym.problems()
DYNAMIC = [
    name
    for name in NAMES
    if has_dynamics((made := pkm_gym.make_problem(name)).mechanism(made.printed_design()))
]
ONE = """
[[motor]]
name = "the only one"
torque = {torque}
torque_peak = "12 N m"
speed = "6000 rpm"
inertia = "1 kg cm^2"
mass = 2
"""


def shipped() -> Path:
    return Path(str(files("pkm_gym.core") / "motors.toml"))


@pytest.mark.parametrize("name", DYNAMIC)
def test_the_pick_is_that_of_the_functions(run, name):
    result = run("motors", name, "--json")
    assert result.exit_code == 0, result.output
    content = json.loads(result.stdout)
    problem = pkm_gym.make_problem(name)
    tried = fits(cycle_drives(problem, problem.printed_design()), read_motors())
    best = pick(tried)
    assert best is not None
    picked = content["picked"]
    assert (picked["motor"], picked["ratio"]) == (best.motor.name, best.gear.ratio)
    assert picked["inertia"] == best.inertia
    assert [one["carries"] for one in content["rows"]] == [one.carries for one in tried]
    for entry, one in zip(content["rows"], tried, strict=True):
        asked = {name: demand["asked"] for name, demand in entry["demands"].items()}
        assert asked == {demand.what: demand.asked for demand in one.demands}


@pytest.mark.parametrize("name", DYNAMIC)
def test_the_command_that_is_printed_has_the_motor_in_it(run, name):
    content = json.loads(run("motors", name, "--json").stdout)
    words = shlex.split(content["evaluate"])
    given = design_from(name, words[words.index("--set") + 1 :])
    machine = given.problem.mechanism(given.design, given.task)
    assert machine.drive_inertia == content["picked"]["inertia"]
    lines = run("motors", name).stdout
    assert content["evaluate"] in lines
    assert f"the smallest: {content['picked']['motor']}" in lines


@pytest.mark.parametrize("name", [name for name in NAMES if name not in DYNAMIC])
def test_without_dynamics_only_statics_is_offered(refused, name):
    said = refused("motors", name)
    assert said.startswith(f"{name} has no dynamics")
    assert "only statics: evaluate it with --load" in said


@pytest.mark.parametrize("name", DYNAMIC[:1])
def test_a_table_of_one_s_own_is_taken(run, refused, tmp_path, name):
    own = tmp_path / "own.toml"
    own.write_text(ONE.format(torque=9), encoding="utf-8")
    lines = run("motors", name, "--table", own)
    assert "the only one" in lines.stdout
    assert "750 W" not in lines.stdout
    assert lines.exit_code == 1  # no gear
    assert "no motor of the table carries the cycle" in lines.stdout
    assert "peak torque" in lines.stdout
    own.write_text(own.read_text("utf-8") + shipped().read_text("utf-8"), encoding="utf-8")
    assert run("motors", name, "--table", own).exit_code == 0
    own.write_text(ONE.format(torque=-9), encoding="utf-8")
    said = refused("motors", name, "--table", own)
    assert said == (
        f"{str(own)!r} is no motor table: torque of motor 'the only one' is -9: it must be greater "
        "than 0"
    )


@pytest.mark.parametrize("name", DYNAMIC[:1])
def test_a_design_file_is_taken_and_broken_limits_are_told(run, name):
    problem = pkm_gym.make_problem(name)
    design = problem.low + 0.9 * (problem.high - problem.low)
    evaluation = problem.evaluate(design[None])
    path = write_design(Path("design.toml"), evaluation, "a command")
    result = run("motors", name, "--design", path)
    if evaluation.unreached[0] > 0.0:
        assert result.exit_code == 2
    else:
        assert (evaluation.explain(0).split(":")[0] in result.stdout) != evaluation.feasible[0]


@pytest.mark.parametrize("name", DYNAMIC[:1])
def test_no_line_is_wider_than_the_terminal(narrow, name):
    lines = narrow("motors", name).stdout.splitlines()
    tables = [line for line in lines if not line.startswith("pkm-gym evaluate")]
    assert 60 < max(map(len, tables)) <= 80


# Loads --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_a_load_is_held_by_the_drives(run, name):
    result = run("evaluate", name, "--load", "force=20N", "--json")
    assert result.exit_code == 0, result.output
    content = json.loads(result.stdout)["holding"]
    problem = pkm_gym.make_problem(name)
    machine = problem.mechanism(problem.printed_design())
    expected = held(machine, {"force": 20.0})
    assert [one["joint"] for one in content] == list(machine.joint_names)
    for one, drive in zip(content, expected, strict=True):
        largest = np.inf if one["largest"] is None else one["largest"]
        assert largest == pytest.approx(drive.largest, rel=1e-9)
        assert one["place"] == drive.place


@pytest.mark.parametrize("name", NAMES[:1])
def test_a_load_is_shown_beside_the_indices(run, name):
    problem = pkm_gym.make_problem(name)
    machine = problem.mechanism(problem.printed_design())
    component = next(iter(load_units(machine)))
    text = run("evaluate", name, "--load", f"{component}=-1.5kN", "--picture", "a.png").stdout
    drives = held(machine, {component: -1500.0})
    assert "What the drives hold of the load, over the workspace" in text
    for drive in drives:
        assert any(
            line.startswith(drive.joint) and f"{drive.largest:.4g}" in line
            for line in text.splitlines()
        )


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["fq=1N"], "unknown load 'fq'; did you mean 'f"),
        (["force=1kg"], "force is '1kg': 'kg' is no unit of it, it is measured in N, kN"),
        (["force=-1N"], "the load's force is -1: of any direction, it has a size"),
        (["force"], "--load force says no value: write --load force=VALUE"),
    ],
)
def test_what_is_no_load_is_refused_in_one_sentence(refused, words, sentence):
    for name in NAMES[:1]:
        assert sentence in refused("evaluate", name, "--load", *words)
