"""Every verb takes a mechanism from outside; what it doesn't have is said in a sentence."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pkm_gym
from pkm_gym.benchmark import EvaluationLog, load_split, regrets
from pkm_gym.benchmark.standings import standings
from pkm_gym.studies.dashboard.server import serving, storages
from pkm_gym.studies.search.calibrating import calibrate

WHERE = "biglide.problem:BiglideProblem"
RUNS = Path("runs") / "biglide"
LOG = RUNS / "benchmark" / "val" / "neighbours-4-seed0.npz"
QUICK = ("--split", "val", "--tasks", "8", "--evaluations", "4")
METHODS = ("--method", "cobyqa", "--method", "neighbours")
AGENT = Path("runs") / "agents" / "BiglideFamily-v0-ppo-0"
ROLLOUT = ("algorithm.n_steps=16", "algorithm.batch_size=32")
FEW = ("--steps", "400", "--set", "envs=8", "checkpoints=1", *ROLLOUT)


@pytest.fixture(scope="module")
def splits(run) -> str:
    """What ``pkm-gym splits`` says; its files lie under runs/."""
    return run("splits", WHERE)


@pytest.fixture(scope="module")
def measured(run, splits) -> str:
    """What ``pkm-gym benchmark`` says of two methods; its logs lie under runs/."""
    assert splits
    return run("benchmark", WHERE, *QUICK, "--jobs", "1", *METHODS)


@pytest.fixture(scope="module")
def trained(run, splits) -> str:
    """What ``pkm-gym train`` says after a few steps."""
    assert splits
    return run("train", WHERE, *FEW)


@pytest.fixture(scope="module")
def searched(run) -> str:
    """What a search says; its study lies under runs/."""
    return run("search", WHERE, "--trials", "6")


def test_list_shows_all_of_it(run):
    text = run("list", WHERE)
    assert "environments: PKM/Biglide-v0, PKM/BiglideFamily-v0" in text
    assert "Variables and the default design" in text
    assert "Options" not in text
    assert "paper" not in text


def test_page_is_about_its_environments(run):
    text = run("page", WHERE)
    assert "PKM/BiglideFamily-v0" in text
    assert "BiglideMotion" not in text


def test_evaluate_speaks_of_the_default_design(run):
    assert run("evaluate", WHERE).startswith("biglide: the default design\n")
    assert (RUNS / "evaluate.png").stat().st_size > 1000
    text = run("evaluate", WHERE, "--set", "rod=500mm")
    assert "gap as in the default design" in text
    assert "condition: the worst condition number of the Jacobian is 6.169 at x = " in text


def test_grid_has_the_steps_that_the_variables_declare(run):
    text = run("grid", WHERE)
    assert text.startswith("5,760 designs of our grid (a step of 0.01 over the bounds)")
    assert "paper" not in text
    assert (RUNS / "grid.nc").is_file()


def test_an_optimum_is_made_buildable(run):
    assert "feasible: every limit holds" in run("round", WHERE, "--to", "10mm")
    assert "yield " in run("tolerance", WHERE, "--sigma", "1mm", "--samples", "64")
    assert "What 1 % more is worth" in run("sensitivity", WHERE)
    text = run("search", WHERE, "--robust", "0.8", "--sigma", "1mm", "--trials", "4")
    assert "study: biglide-tpe-robust" in text


def test_search_and_polish(run, searched):
    assert "study: biglide-tpe in runs/biglide/studies.journal, 6 trials" in searched
    text = run("polish", WHERE)
    assert "agrees with the solved optimum" in text
    assert f"pkm-gym evaluate {WHERE} --set rod=0.1581" in text
    assert "paper" not in searched + text


def test_compare_has_no_row_of_a_paper(run):
    text = run("compare", WHERE, "--evaluations", "8", "--seeds", "1")
    rows = [row.split()[0].rstrip(",") for row in text.splitlines()[2:8]]
    assert rows == ["polished", "tpe", "cmaes", "qmc", "random", "solved"]
    assert "paper" not in text + (RUNS / "compare.md").read_text()


@pytest.mark.slow
def test_study(run):
    text = run("study", WHERE, "--trials", "10", "--name", "whole")
    assert "found: rail = 700.0 mm at rod = 158.1 mm, gap = 50.0 mm" in text
    assert f"look at it: pkm-gym dashboard {WHERE}" in text
    assert "paper" not in text


@pytest.mark.usefixtures("searched")
def test_the_dashboard_serves_its_studies():
    where = storages(WHERE)
    assert where == [str(RUNS / "studies.journal")]
    with serving(where[0], 0) as address:
        assert address.startswith("http://127.0.0.1:")


def test_solve_tasks(run):
    text = run("solve-tasks", WHERE, "-n", "4")
    assert f"pool: {RUNS / 'pool.npz'}" in text


def test_splits_are_as_large_as_declared_and_lie_under_runs(splits):
    assert "biglide, train: 256 tasks" in splits
    for split, number in {"train": 256, "val": 64, "test": 64, "ood": 64}.items():
        problem, pool = load_split(WHERE, split)
        assert (problem.name, len(pool)) == ("biglide", number)
        assert pool.certified.all()
        assert (RUNS / "splits" / f"biglide_{split}.npz").is_file()


def test_benchmark_and_score(run, measured):
    assert "biglide, val: regret in per cent of the optimum" in measured
    log = EvaluationLog.load(LOG)
    assert (log.setting.problem, log.setting.pool) == (WHERE, 256)
    assert "neighbours" in run("score", LOG)


@pytest.mark.slow
@pytest.mark.usefixtures("measured")
def test_processes_that_are_spawned_find_it(run):
    before = EvaluationLog.load(LOG)
    LOG.unlink()
    run("benchmark", WHERE, *QUICK, "--jobs", "2", *METHODS)
    np.testing.assert_array_equal(EvaluationLog.load(LOG).designs, before.designs)


def test_without_training_tasks_methods_that_need_none_are_run(run, refused, tmp_path):
    run("splits", WHERE, "--split", "val", "-o", tmp_path)
    few = ("--split", "val", "--folder", tmp_path, "--tasks", "2", "--evaluations", "3")
    text = run("benchmark", WHERE, *few, "--jobs", "1")
    assert "without interpolated: biglide has no split train yet" in text
    assert "without designer: " in text
    assert "cobyqa" in text
    sentence = refused("benchmark", WHERE, *few, "--method", "interpolated")
    assert sentence == (
        f"biglide has no split train yet: make it with `pkm-gym splits {WHERE} -o {tmp_path}`"
    )


def test_train_agent_eval_and_design(run, invoke, trained):
    assert trained.endswith(f"agent: {AGENT / 'best.json'}\n")
    assert WHERE in (AGENT / "best.json").read_text()
    assert "biglide, val" in run("agent-eval", AGENT)
    done = invoke("design", WHERE, "--model", AGENT, "--set", "task.b=0.5")
    answered = "the answer of a trained designer after 12 evaluations"
    none = "none of the 12 designs that a trained designer tried is feasible"
    assert f"biglide: {none if done.exit_code else answered}" in done.stdout
    (file,) = RUNS.glob("b=0.5-*/design.toml")
    assert (file.parent / "design.png").is_file()
    assert "is as it should be" in run("restamp", WHERE, AGENT / "best.json")


@pytest.mark.usefixtures("splits")
def test_an_id_is_known_by_the_module_that_defines_it(run, tmp_path):
    text = run("train", "biglide.problem:PKM/Biglide-v0", *FEW, "-o", tmp_path / "fixed")
    assert "on 1 validation tasks" in text


@pytest.mark.slow
@pytest.mark.usefixtures("splits")
def test_tune(run):
    assert "median of 5 fresh seeds" in run("tune", WHERE, "--trials", "1", *FEW)


@pytest.mark.usefixtures("trained")
@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("figures", WHERE), "biglide has no figures"),
        (("twin-check", WHERE), "Biglide has no MuJoCo twin"),
        (("picture", WHERE), "Biglide has no MuJoCo twin"),
        (("movie", WHERE), "Biglide has no MuJoCo twin"),
        (("export", WHERE), "Biglide has no MuJoCo twin"),
        (("validate", WHERE), "biglide has no tau_G and no tau_peak to validate"),
        (("motion-eval", WHERE), "PKM/BiglideFamily-v0 is no motion environment"),
        (("design", WHERE), "no designer of biglide is shipped: train one with `pkm-gym train`"),
        (("search", WHERE, "--sampler", "designer"), "no designer of biglide is shipped"),
        (("search", WHERE, "--warm-start", "paper"), "biglide has no paper to start from"),
        (("polish", WHERE, "--from", "paper"), "biglide has no paper to start from"),
        (("zoo", "--add", AGENT), "biglide is a mechanism from outside"),
        (("evaluate", "biglide.problem:Other"), "the module 'biglide.problem' has no 'Other'"),
        (("evaluate", "biglyde.problem:X"), "there is no module 'biglyde'"),
        (("evaluate", "biglyde"), "unknown mechanism 'biglyde'"),
        (("train", "biglyde.problem:X"), "there is no module 'biglyde'"),
    ],
)
def test_what_is_missing_is_said_in_one_sentence(refused, words, sentence):
    assert refused(*words).startswith(sentence)


@pytest.mark.usefixtures("trained", "searched")
def test_no_path_holds_an_address():
    assert not [path for path in Path("runs").rglob("*") if ":" in path.name]


@pytest.mark.usefixtures("measured")
def test_a_best_known_optimum_that_is_beaten_is_recorded_and_a_certified_one_stops_the_run():
    log = EvaluationLog.load(LOG)
    problem, split = load_split(WHERE, "val")
    better = replace(log, designs=np.repeat(split.designs[log.rows][:, None], 4, axis=1))
    worse = replace(split, designs=1.05 * split.designs)
    assert problem.evaluate(worse.designs[log.rows], split.tasks[log.rows]).feasible.all()
    with pytest.raises(ValueError, match="beats the certified optimum of val task"):
        regrets(better, problem, worse)
    known = replace(worse, certified=np.zeros(len(worse), dtype=bool))
    assert (regrets(better, problem, known) < 0.0).all()
    assert len(standings([log])[0].beaten) == 0


def test_calibrate_measures_what_the_closed_form_says(run):
    """The rail is b + 2 k gap(h, k) at the optimum; only the condition number's limit holds it."""
    problem = pkm_gym.make_problem(WHERE)
    grid = np.meshgrid(*(np.linspace(v.low, v.high, 21) for v in problem.task_variables))
    b, h, k = (axis.ravel() for axis in grid)

    def rail(k):
        c = 1.0 + k**-2
        return b + 2.0 * k * h * (c + np.sqrt(c * (c + k**2 - k**-2))) / (k**2 - k**-2)

    steepest = (np.log(rail(k - 1e-6)) - np.log(rail(k + 1e-6))).max() / 2e-6
    measured = calibrate(problem, 24)
    assert 0.3 * steepest < measured.multiplier < 1.01 * steepest
    assert measured.within == 1.0
    text = run("calibrate", WHERE, "-n", "8", "-o", "mine.toml")
    assert text.rstrip().endswith("calibration: mine.toml")
    kept = tomllib.loads(Path("mine.toml").read_text())["biglide"]
    assert set(kept["objectives"]) == {"rail"}
    assert kept["penalty_weight"] >= 1.0
