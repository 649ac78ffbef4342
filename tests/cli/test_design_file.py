"""What comes out can go in: commands and files that give a design again, to the bit."""

from __future__ import annotations

import json
import re
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms import family_problem
from pkm_gym.studies.cli.arguments import design_from, problem_from
from pkm_gym.studies.cli.design_file import write_design
from pkm_gym.studies.cli.tasks import INDEX, task_folder
from pkm_gym.studies.cli.words import evaluate_command


def asked(problem: DesignProblem, rng: np.random.Generator) -> DesignProblem:
    """A problem of another task, and of other options where there are any that aren't words."""
    own = {item.name: item for item in problem.options.table()}
    options = {
        name: not item.default for name, item in own.items() if item.default in (True, False)
    }
    return problem.with_task(problem.unpack(problem.draw_tasks(1, rng)[0]), **options)


@pytest.fixture
def found(problem: DesignProblem, rng: np.random.Generator):
    """A random design of another task, evaluated."""
    other = asked(problem, rng)
    return other.evaluate(rng.uniform(other.low, other.high)[None])


def settings(command: str) -> list[str]:
    words = shlex.split(command)
    return words[words.index("--set") + 1 :]


def test_a_printed_command_gives_the_design_again_to_the_bit(found):
    words = evaluate_command(found.problem, found.designs[0])
    assert words.startswith(f"pkm-gym evaluate {found.problem.name} --set ")
    options = found.problem.declared.reporting
    same = design_from(found.problem.name, settings(words), **options)
    again = same.problem.evaluate(same.design[None], same.task)
    np.testing.assert_array_equal(again.constraints, found.constraints)
    np.testing.assert_array_equal(again.objectives, found.objectives)


def test_a_file_gives_the_design_again_to_the_bit(found, tmp_path):
    problem = found.problem
    path = write_design(tmp_path / "a" / "design.toml", found, "a command")
    same = design_from(problem.name, file=path, **problem.declared.reporting)
    again = same.problem.evaluate(same.design[None], same.task)
    np.testing.assert_array_equal(again.constraints, found.constraints)
    for name, values in found.indices.items():
        np.testing.assert_array_equal(again.indices[name], values)
    assert same.file.differences(again) == ()
    content = tomllib.loads(path.read_text())
    assert settings(content["evaluate"])
    assert content["found_by"] == "a command"
    searched = problem_from(problem.name, file=path)
    assert searched.task == problem.task
    # the finer sampling of a report is no part of what is searched
    own = {
        k: v for k, v in problem.options.changed().items() if k not in problem.declared.reporting
    }
    assert searched.options.changed() == own


def test_a_design_that_is_not_searched_by_default_comes_back(tmp_path, rng):
    family = family_problem("stroke_leg")
    found = family.evaluate(rng.uniform(family.low, family.high)[None])
    path = write_design(tmp_path / "leg.toml", found, "")
    same = design_from("stroke_leg", file=path)
    assert same.problem.named(same.design) == family.named(found.designs[0])


def test_polish_prints_and_writes_what_evaluate_reads(run):
    polished = run("polish", "diamond", "--set", "task.payload=1kg", "inertia=uniform-arm")
    lines = polished.output.splitlines()
    command = next(line for line in lines if line.startswith("pkm-gym evaluate"))
    file = next(line for line in lines if line.startswith("design: ")).removeprefix("design: ")
    typed = json.loads(run(*shlex.split(command)[1:], "--json").stdout)
    read = json.loads(run("evaluate", "diamond", "--design", file, "--json").stdout)
    assert typed["indices"] == read["indices"]
    assert typed["feasible"]
    assert read["feasible"]
    assert typed["task"]["payload"] == read["task"]["payload"] == 1.0
    assert typed["options"]["inertia"] == read["options"]["inertia"] == "uniform-arm"
    assert tomllib.loads(Path(file).read_text())["indices"]["tau_G"] == read["indices"]["tau_G"]
    heavier = run("evaluate", "diamond", "--design", file, "--set", "task.payload=2kg", "--json")
    assert json.loads(heavier.stdout)["task"]["payload"] == 2.0
    assert json.loads(heavier.stdout)["design"] == read["design"]


def test_what_the_model_does_not_give_is_said(run):
    run("polish", "spr3")
    file = Path("runs/spr3/polish.toml")
    gci = tomllib.loads(file.read_text())["indices"]["gci"]
    file.write_text(file.read_text().replace(f"gci = {gci!r}", "gci = 0.9"))
    said = run("evaluate", "spr3", "--design", file).output
    assert f"{file} says gci = 0.9, the model {gci:.9g}" in said


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('problem = "diamond"', 'problem = "spr3"', "holds a design of 'spr3', not of diamond"),
        ("[design]", "[desing]", r"lacks the table \[design\]"),
        ("lam_e = ", "lam_ee = ", "unknown variable 'lam_ee'; did you mean 'lam_e'"),
        ("payload = ", 'payload = "a" #', "task.payload is 'a': it must be a finite number"),
        ("payload = ", "payload = nan #", "task.payload is nan"),
        ("payload = ", "payload = 1e9 #", "payload"),
        ("payload = ", "pay = ", "'pay'"),
        ('inertia = "printed"', 'inertia = "print"', "unknown inertia 'print'"),
        ('inertia = "printed"', "inertia = [1]", "polish.toml'"),
        ("lam_e = 0", "# lam_e = 0", "its design lacks lam_e"),
        ('objectives = [\n    "tau_G",\n]', "objectives = []", "its objectives must be a list"),
        ("[design]", "[design", "is no design file"),
    ],
)
def test_a_damaged_file_is_refused_by_its_name(run, refused, old, new, sentence):
    assert run("polish", "diamond").exit_code == 0
    file = Path("runs/diamond/polish.toml")
    assert old in file.read_text()
    file.write_text(file.read_text().replace(old, new, 1))
    for verb in ("evaluate", "polish", "search", "picture"):
        said = refused(verb, "diamond", "--design", file)
        assert str(file) in said
        assert re.search(sentence, said), said


def test_a_missing_or_foreign_file_is_refused(refused, tmp_path):
    said = refused("evaluate", "diamond", "--design", "none.toml")
    assert said == "there is no design file 'none.toml': `pkm-gym polish` writes one"
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    assert "'bytes.toml' is no design file" in refused(
        "evaluate", "diamond", "--design", "bytes.toml"
    )
    assert "--design holds a design of one mechanism" in refused(
        "twin-check", "--design", "none.toml"
    )


def test_machines_of_a_file_are_drawn_exported_and_checked(run):
    run("polish", "spr3", "--set", "task.D=300mm")
    file = next(Path("runs/spr3").glob("*/polish.toml"))
    exported = run("export", "spr3", "--design", file, "-o", "a.xml")
    assert exported.exit_code == 0, exported.output
    given = design_from("spr3", file=file)
    assert given.task.D == 0.3
    checked = run("twin-check", "spr3", "--design", file, "--designs", "0", "--json")
    assert checked.exit_code == 0, checked.output


# Folders ------------------------------------------------------------------------------------------


def test_tasks_do_not_overwrite_each_other(run):
    run("polish", "diamond")
    run("polish", "diamond", "--set", "task.payload=1kg")
    run("polish", "diamond", "--fix", "lam_e=0.6", "--range", "gap=0.2:0.5")
    files = sorted(Path("runs/diamond").rglob("polish.toml"))
    assert len(files) == 3
    folders = [file.parent.name for file in files if file.parent.name != "diamond"]
    assert any(name.startswith("payload=1-") for name in folders)
    index = Path("runs/diamond", INDEX).read_text()
    assert all(f"| {name} | " in index for name in folders)
    assert "task.payload = 1.0" in index
    assert "fix.lam_e = 0.6, range.gap = 0.2:0.5" in index


@pytest.mark.usefixtures("run")
def test_what_is_asked_by_default_is_in_the_problem_s_own_folder(problem):
    assert task_folder(problem) == Path("runs", problem.name)
    reported = problem.with_task(problem.task, **problem.declared.reporting)
    assert task_folder(reported) == Path("runs", problem.name)
    assert not Path("runs").exists()


def test_a_damaged_file_of_another_task_stops_nothing(run):
    run("polish", "diamond", "--set", "task.payload=1kg")
    (other,) = Path("runs/diamond").glob("*/task.toml")
    other.write_bytes(b"\xff")
    assert run("polish", "diamond", "--set", "task.payload=2kg").exit_code == 0
    index = Path("runs/diamond", INDEX).read_text()
    assert f"| {other.parent.name} | task.toml is damaged |" in index
    assert "| task.payload = 2.0 |" in index


def test_digits_that_a_name_does_not_show_tell_folders_apart(run):
    del run
    one, other = (
        pkm_gym.make_problem("diamond", task={"payload": 1.0 + excess}) for excess in (0.0, 1e-9)
    )
    assert task_folder(one) != task_folder(other)
    assert task_folder(one) == task_folder(one)


# What is wrong is said ----------------------------------------------------------------------------


def test_a_value_that_no_search_would_try_is_refused(refused):
    said = refused("search", "diamond", "--fix", "lam_e=5")
    assert said == "--fix lam_e=5 lies outside its range, 0.2 to 0.75"


def test_a_wider_range_of_the_family_may_be_held():
    phi = float(np.radians(100.0))
    assert problem_from("stroke_leg", fix=[f"phi={phi!r}"], family=True).fixed["phi"] == phi


def test_an_optimum_on_the_edge_of_the_box_is_mentioned(run):
    held = run("polish", "diamond", "--range", "lam_e=0.2:0.5").output
    assert "on the edge of the search box: lam_e at 0.5; --range widens it" in held
    assert "on the edge" not in run("polish", "diamond").output


def test_a_design_that_is_broken_is_drawn_with_a_word(run):
    drawn = run("export", "diamond", "--set", "gap=0.69", "-o", "a.xml")
    assert drawn.exit_code == 0, drawn.output
    assert "1.246 too large" in drawn.output
    assert "too large" not in run("export", "diamond", "-o", "b.xml").output
