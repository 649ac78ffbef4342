"""The verbs of the studies as they are typed."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from pkm_gym.mechanisms import make_problem, problems
from pkm_gym.studies.comparison import compare, study
from pkm_gym.studies.dashboard.pictures import Pictures
from pkm_gym.studies.grid import designs


@pytest.fixture(autouse=True)
def undrawn(monkeypatch):
    """Draw nothing."""
    monkeypatch.setattr(Pictures, "draw", lambda *_: [])


def test_search_prints_the_best_design_beside_the_papers_and_goes_on(run):
    first = run("search", "diamond", "--sampler", "random", "--trials", 40)
    assert first.exit_code == 0, first.output
    for word in ("paper, printed", "best, trial", "verified optimum"):
        assert word in first.output
    assert "study: diamond-random in runs/diamond/studies.journal, 40 trials" in first.output
    again = run("search", "diamond", "--sampler", "random", "--trials", 45, "--batch", 3)
    assert "45 trials" in again.output


def test_search_takes_a_task_a_fixed_variable_a_range_and_an_objective(run):
    result = run(
        "search", "diamond", "--set", "task.payload=1kg", "--fix", "lam_e=0.6", "--range",
        "lam_l=2:3", "--objective", "condition", "--name", "mine", "--trials", 5, "--warm-start",
        "grid", "--storage", "mine.journal", "--sampler", "qmc", "--jobs", 2,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "study: mine in mine.journal, 5 trials" in result.output
    assert Path("artifacts").is_dir()


def test_search_says_that_nothing_is_feasible(run):
    result = run(
        "search", "diamond", "--trials", 5, "--set", "task.sigma_low=1.2", "task.sigma_high=1.2"
    )
    assert "no feasible design was found; the one of lowest merit breaks:" in result.output


def test_search_counts_the_pareto_front_of_several_objectives(run):
    result = run(
        "search", "diamond", "--trials", 30, "--objective", "tau_G", "--objective", "condition",
        "--warm-start", "grid",
    )  # fmt: skip
    assert "designs on the Pareto front" in result.output


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--sampler", "tp"), "unknown sampler 'tp'; did you mean 'tpe'?"),
        (("--warm-start", "nothing"), "there is no storage"),
        (("--set", "task.payload=1"), "stands for another problem (task: "),
        (("--storage", "."), "can't open the storage '.'"),
        (("--objective", "tau"), "unknown objective 'tau'"),
        (("--range", "lam_l=3:2"), "the low one must be the smaller"),
        (("--trials", "0"), "--trials is '0': it must be at least 1"),
    ],
)
def test_search_refuses_in_one_sentence(run, refused, words, said):
    if "task.payload=1" in words:
        run("search", "diamond", "--trials", 2)
    assert said in refused("search", "diamond", *words)


BOTH = ("--objective", "tau_G", "--objective", "condition")


def test_pareto_prints_draws_and_writes_the_front_and_what_is_preferred(narrow):
    searched = narrow("search", "diamond", *BOTH, "--trials", 12, "--warm-start", "grid")
    assert (
        "shown by pkm-gym pareto diamond --objective tau_G --objective condition\n"
        in searched.output
    )
    ways = ("--weights", "tau_G=2", "condition=1", "--tolerances", "tau_G=0.01", "condition=0.1")
    result = narrow("pareto", "diamond", *ways, "--pca", "--rows", 3)
    assert result.exit_code == 0, result.output
    assert max(map(len, result.stdout.splitlines()[:15])) <= 80
    for word in ("paper, our model", "optimum of condition", "weighted", "tolerance", "\npca "):
        assert word in result.output
    assert "3 of them shown, far from each other" in " ".join(result.output.split())
    assert "is a coin toss, and so are the weights" in result.output
    lines = dict(line.split(": ") for line in result.output.splitlines() if "/pareto" in line)
    again = narrow("evaluate", "diamond", "--design", lines["design, weighted"], "--json")
    told = json.loads(again.stdout)
    with Path(lines["table"]).open() as file:
        (row,) = [row for row in csv.DictReader(file) if row["what"] == "weighted"]
    assert told["indices"]["condition"] == float(row["indices.condition"])
    assert (
        Path(lines["table"])
        .read_text()
        .startswith("what,study,trial,feasible,objectives.tau_G [N m/")
    )
    assert Path(lines["picture"]).read_bytes().startswith(b"\x89PNG")


def test_pareto_prints_json_and_keeps_a_reference_point(run):
    run("search", "diamond", *BOTH, "--trials", 5, "--warm-start", "paper")
    words = ("pareto", "diamond", *BOTH, "--json")
    told = json.loads(run(*words, "--reference", "tau_G=0.5", "condition=3").stdout)
    assert told["reference_point"] == {"tau_G": 0.5, "condition": 3.0}
    assert json.loads(run(*words).stdout) == told
    assert not list(Path().rglob("pareto.*"))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (BOTH, "there is no storage"),
        (BOTH[:2], "a front needs two objectives or more"),
        ((*BOTH, "--weights", "tau=1"), "unknown objective of a weight 'tau'; did you mean"),
        ((*BOTH, "--weights", "tau_G=-1"), "none may be negative"),
        ((*BOTH, "--weights", "tau_G=1mm"), "it is a plain number without unit"),
        ((*BOTH, "--tolerances", "tau_G=1"), "the tolerances lack condition"),
        ((*BOTH, "--reference", "tau_G"), "--reference tau_G says no value"),
    ],
)
def test_pareto_refuses_in_one_sentence(run, refused, words, said):
    if "no storage" not in said:
        run("search", "diamond", *BOTH, "--trials", 2, "--warm-start", "paper")
    assert said in refused("pareto", "diamond", *words)


def test_grid_writes_the_atlas_and_names_it(run):
    result = run("grid", "diamond", "-o", "atlas.nc")
    assert result.exit_code == 0, result.output
    assert "designs of our grid" in result.output
    assert "atlas: atlas.nc" in result.output
    assert Path("atlas.nc").exists()


def test_grid_says_that_nothing_is_feasible(run):
    result = run("grid", "diamond", "--set", "task.sigma_low=1.2", "task.sigma_high=1.2")
    assert "0 feasible" in result.output
    assert "none is logged" in result.output


def test_polish_starts_from_the_paper_a_given_design_or_a_study(run):
    assert "start: the printed design" in run("polish", "diamond").output
    given = run("polish", "diamond", "--set", "lam_e=0.58", "lam_l=2.3", "gap=0.4")
    assert "start: the given design" in given.output
    assert "polished: agrees with the verified optimum (recorded)" in given.output
    optimum = make_problem("diamond").reference.optima["tau_G"].design["lam_e"]
    assert f"pkm-gym evaluate diamond --set lam_e={optimum:.6f}"[:-3] in given.output
    run("grid", "diamond")
    assert "start: the best of the study diamond-grid" in run("polish", "diamond").output
    assert "start: the best of grid" in run("polish", "diamond", "--from", "grid").output


@pytest.mark.parametrize("name", problems())
def test_no_number_of_a_design_is_cut_however_many_it_has(run, name):
    result = run("polish", name)
    assert result.exit_code == 0, result.output
    assert "…" not in result.stdout
    table = result.stdout.partition(" in mm")[0].split()
    assert {v.name for v in make_problem(name).variables} <= set(table)


def test_polish_takes_lengths_with_the_task_that_they_settle(run):
    result = run("polish", "diamond", "--set", "e=150mm", "l1=260mm", "l2=640mm", "H=493mm")
    assert result.exit_code == 0, result.output
    assert "solved optimum" in result.output
    assert "paper, printed" not in result.output


def test_polish_refuses_two_starts(refused):
    said = refused("polish", "diamond", "--from", "paper", "--set", "lam_e=0.5")
    assert "leave one out" in said


def test_compare_prints_and_writes_its_table(run):
    result = run("compare", "diamond", "--evaluations", 10, "--seeds", 1)
    assert result.exit_code == 0, result.output
    assert "\ncmaes, seed 0 " in result.output
    assert json.loads(Path("runs/diamond/compare.json").read_text())["problem"] == "diamond"
    assert "| tpe, seed 0 |" in Path("runs/diamond/compare.md").read_text()


def test_study_does_all_and_ends_with_what_was_found_and_how_to_see_it(run, monkeypatch):
    whole = compare.compare
    monkeypatch.setattr(study, "compare", lambda *a, **k: whole(*a, **k, evaluations=5, seeds=1))
    result = run("study", "diamond", "--trials", 20)
    assert result.exit_code == 0, result.output
    lines = result.output.rstrip().splitlines()[-6:]
    starts = ("found: tau_G = ", "checked: agrees with the verified optimum", "paper: ")
    assert all(line.startswith(start) for line, start in zip(lines, starts, strict=False))
    assert lines[-3].startswith("files: ")
    assert lines[-2].startswith("all digits: pkm-gym evaluate diamond --set lam_e=")
    assert lines[-1] == "look at it: pkm-gym dashboard diamond"
    files = ("grid.nc", "compare.md", "compare.json", "design.png", "study.toml", "studies.journal")
    for name in files:
        assert name in lines[-3]
        assert Path("runs/diamond", name).stat().st_size > 0


def coarse(problem, _step=None):
    return np.full(len(problem.low), 0.05)


@pytest.mark.parametrize("name", ["spr3", "spr3_cylinder"])
def test_study_without_a_papers_grid_or_index_says_so(run, monkeypatch, name):
    whole = compare.compare
    monkeypatch.setattr(study, "compare", lambda *a, **k: whole(*a, **k, evaluations=5, seeds=1))
    monkeypatch.setattr(designs, "steps_of", coarse)
    result = run("study", name, "--trials", 10)
    assert result.exit_code == 0, result.output
    assert "1/4 our grid" in result.output
    assert all(f"\n{what}: none printed" in result.output for what in ("paper", "grid"))
    lines = result.output.rstrip().splitlines()[-6:]
    problem = make_problem(name)
    theirs, best = problem.reference["gci"].ours, problem.reference.optima["gci"].value
    assert lines[0].startswith(f"found: gci = {best:.4g} at ")
    assert lines[1] == "checked: agrees with the verified optimum (recorded)"
    assert lines[2] == (
        f"paper: its design has {theirs:.4g} with our model, so ours is "
        f"{100 * (best / theirs - 1):.2f} % better; it prints no gci"
    )
    for file in ("grid.nc", "compare.md", "compare.json", "design.png", "studies.journal"):
        assert Path("runs", name, file).stat().st_size > 0


def test_grid_takes_a_step_and_calls_the_grid_ours(run):
    result = run("grid", "spr3", "--step", 0.05)
    assert result.exit_code == 0, result.output
    assert "210 designs of our grid (a step of 0.05 over the bounds)" in result.output
    assert "best of our grid" in result.output
    assert "study: spr3-grid-0.05 in runs/spr3/studies.journal" in result.output


@pytest.mark.parametrize("step", ["0", "0.00001"])
def test_grid_refuses_a_step_that_makes_no_grid(refused, step):
    assert "step" in refused("grid", "spr3", "--step", step)


def test_search_starts_from_our_grid_and_polish_from_the_search(run, monkeypatch):
    monkeypatch.setattr(designs, "steps_of", coarse)
    result = run("search", "spr3", "--trials", 12, "--warm-start", "grid", "--sampler", "random")
    assert result.exit_code == 0, result.output
    assert "none printed" in result.output
    polished = run("polish", "spr3").output
    assert "start: the best of the study spr3-random" in polished
    assert "polished: agrees with the verified optimum (recorded)" in polished


def test_study_of_another_task_needs_another_name(run, monkeypatch):
    whole = compare.compare
    monkeypatch.setattr(study, "compare", lambda *a, **k: whole(*a, **k, evaluations=2, seeds=1))
    run("grid", "diamond")
    words = ("study", "diamond", "--trials", 3, "--set", "task.payload=1")
    first = run(*words)
    assert first.exit_code == 2
    assert "choose another --name" in first.stderr
    result = run(*words, "--name", "heavy")
    assert result.exit_code == 0, result.output
    assert "3 trials in the study heavy-tpe" in result.output


def test_study_refuses_several_objectives_at_once(refused):
    said = refused("study", "diamond", "--objective", "tau_G", "--objective", "condition")
    assert "give a single --objective" in said


def test_dashboard_refuses_what_it_cannot_show(refused):
    assert "there is no study under" in refused("dashboard", "--no-open")
    assert "there is no storage" in refused("dashboard", "--no-open", "--storage", "x.journal")
