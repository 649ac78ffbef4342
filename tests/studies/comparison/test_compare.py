"""The comparison of the ways to a design, on small budgets."""

from __future__ import annotations

import json

import numpy as np
import pytest

import pkm_gym
from pkm_gym.studies.comparison.compare import SAMPLERS, compare, median, run, save
from pkm_gym.studies.report.rows import Row, markdown, printed_value, verdict


@pytest.fixture(scope="module")
def comparison():
    return compare(pkm_gym.make_problem("diamond"), evaluations=40, seeds=3)


def test_there_is_a_row_for_each_way(comparison):
    names = [row.name for row in comparison.rows]
    assert names == [
        "paper, printed",
        "paper, our model",
        "our grid",
        "polished",
        *SAMPLERS,
        "verified optimum",
    ]


def test_the_rows_hold_printed_and_verified_numbers(comparison):
    problem = comparison.problem
    rows = {row.name: row for row in comparison.rows}
    printed, optimum = problem.reference["tau_G"], problem.reference.optima["tau_G"]
    assert rows["paper, printed"].value == printed.printed
    assert rows["paper, our model"].value == pytest.approx(printed.ours, rel=printed.tolerance)
    assert rows["verified optimum"].value == optimum.value
    assert rows["polished"].regret == pytest.approx(0.0, abs=1e-6)
    grid = problem.evaluate(problem.grid())
    assert rows["our grid"].value == grid.objectives[grid.feasible, 0].min()
    assert printed.verdict in comparison.verdict
    assert printed_value(problem) is printed


def test_every_run_is_the_best_feasible_design_of_equally_many_evaluations(comparison):
    problem = comparison.problem
    optimum = problem.reference.optima["tau_G"].value
    for sampler in SAMPLERS:
        runs = comparison.runs[sampler]
        assert [row.evaluations for row in runs] == [40] * 3
        assert len({row.value for row in runs}) == 3
        for row in runs:
            alone = problem.evaluate(problem.design(row.design)[None])
            assert alone.objectives[0, 0] == pytest.approx(row.value, rel=1e-12)
            assert row.feasible == ("yes" if alone.feasible[0] else "no")
            if alone.feasible[0]:
                assert row.regret == pytest.approx(row.value / optimum - 1.0, abs=1e-6)


def test_a_run_spends_just_its_evaluations(diamond, monkeypatch):
    objective = type(diamond.objective_for(None))
    asked = []
    suggest = objective.suggest
    monkeypatch.setattr(objective, "suggest", lambda *a: asked.append(1) or suggest(*a))
    run(diamond, "tpe", seed=0, evaluations=17)
    assert len(asked) == 17


def test_runs_without_a_feasible_design_count_as_the_worst():
    def row(regret):
        value = 1.0 if np.isnan(regret) else 1.0 + regret
        return Row(
            "", value, {"x": value}, regret=regret, feasible="no" if np.isnan(regret) else "yes"
        )

    middle = median("x", [row(0.3), row(np.nan), row(0.1)])
    assert (middle.regret, middle.feasible) == (0.3, "2 of 3")
    starved = median("x", [row(np.nan), row(np.nan), row(0.1)])
    assert (starved.value, starved.design, starved.feasible) == (None, {}, "1 of 3")
    assert np.isnan(starved.regret)
    assert median("x", [row(0.4), row(0.2)]).regret == 0.2


def test_another_task_is_compared_without_what_the_paper_prints():
    problem = pkm_gym.make_problem("diamond", task={"payload": 1.0}, fixed={"lam_e": 0.6})
    other = compare(problem, evaluations=5, seeds=1)
    names = [row.name for row in other.rows]
    assert names[0] == "our grid"
    assert names[-1] == "solved optimum"
    assert other.verdict == ""


def prints_no_value(name):
    """Whether there is a paper that prints neither a grid nor the objective's value."""
    problem = pkm_gym.make_problem(name)
    value = problem.reference.values.get(problem.objectives[0].name)
    return value is not None and value.printed is None and problem.grid() is None


@pytest.mark.parametrize("name", [*filter(prints_no_value, pkm_gym.problems())])
def test_what_the_paper_does_not_print_is_said(name):
    problem = pkm_gym.make_problem(name)
    objective = problem.objectives[0]
    other = compare(problem, evaluations=15, seeds=1)
    rows = {row.name: row for row in other.rows}
    assert rows["paper: none printed"].value is None
    assert rows["paper: none printed"].design == problem.reference.design
    assert rows["grid: none printed"].value is None
    ours = problem.reference[objective.name]
    optimum = problem.reference.optima[objective.name].value
    printed = rows["paper, our model"]
    assert printed.value == pytest.approx(ours.ours, rel=ours.tolerance)
    behind = objective.sign * (printed.value / optimum - 1.0)  # the share that is lost
    assert printed.regret == pytest.approx(behind, abs=1e-6)
    assert rows["polished"].value == pytest.approx(optimum, rel=1e-6)
    assert other.verdict == ""


def test_lengths_are_shown_in_millimetres():
    problem = pkm_gym.make_problem("spr3_cylinder")
    text = markdown(problem, [Row("x", 0.5, {"a": 0.1234, "b": 0.5, "z_c": 0.6})])
    assert "| 123.4 | 500.0 | 600.0 |" in text
    assert "a, b, z_c in mm" in text


def test_a_verdict_is_passed_on_the_judged_number_only(diamond):
    assert verdict(diamond)
    for changes in (
        {"inertia": "uniform-arm"},
        {"objective": "condition"},
        {"task": {"payload": 1.0}},
        {"fixed": {"lam_e": 0.5}},
    ):
        assert verdict(pkm_gym.make_problem("diamond", **changes)) == ""


def test_the_files_hold_the_table(comparison, tmp_path):
    paths = save(comparison, tmp_path / "runs", "pkm-gym compare diamond")
    content = json.loads(paths[0].read_text())
    assert content["hash"] == comparison.problem.hash()
    assert content["command"] == "pkm-gym compare diamond"
    assert content["rows"][0]["regret"] is None
    assert [row["value"] for row in content["rows"]] == [row.value for row in comparison.rows]
    assert set(content["runs"]) == set(SAMPLERS)
    text = paths[1].read_text()
    assert text.startswith("diamond: as it comes\n\n")
    assert markdown(comparison.problem, comparison.rows) in text
    assert comparison.verdict in text


def test_several_objectives_and_numbers_below_one_are_refused(diamond):
    several = pkm_gym.make_problem("diamond", objective=("tau_G", "condition"))
    with pytest.raises(ValueError, match="give a single --objective"):
        compare(several)
    with pytest.raises(ValueError, match="seeds is 0"):
        compare(diamond, seeds=0)
