"""Polishing: the optimum near a start, beside the verified one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.optimize

import pkm_gym
from pkm_gym.core.solve import solve_tasks
from pkm_gym.studies.report.rows import row_of, rows_beside_paper
from pkm_gym.studies.search.polish import best_known, judged, polish, verified_optimum
from pkm_gym.studies.storage.storages import default_storage


@pytest.mark.parametrize("objective", ["tau_G", "tau_peak", "tau_rms", "condition"])
def test_the_paper_design_is_polished_to_the_recorded_optimum(objective):
    problem = pkm_gym.make_problem("diamond", objective=objective)
    recorded = problem.reference.optima[objective]
    best = polish(problem, problem.printed_design()[None])
    assert best.feasible[0]
    assert best.objectives[0, 0] == pytest.approx(recorded.value, rel=recorded.tolerance)


def test_the_recorded_optimum_is_the_one_of_just_this_problem(diamond):
    optima = diamond.reference.optima
    assert verified_optimum(diamond).value == optima["tau_G"].value
    apex = optima["tau_G_at_printed_lam_e"]
    held = pkm_gym.make_problem("diamond", fixed=apex.fixed)
    assert verified_optimum(held).value == apex.value
    for changes in ({"task": {"payload": 1.0}}, {"inertia": "uniform-arm"}):
        other = verified_optimum(pkm_gym.make_problem("diamond", **changes))
        assert other.value != pytest.approx(optima["tau_G"].value, rel=1e-3)


@pytest.fixture
def edited(monkeypatch):
    """A function that edits a problem's recorded optimum; it returns the problem."""

    def made(**changes):
        problem = pkm_gym.make_problem("spr3")
        kept = problem.reference
        gci = replace(kept.optima["gci"], **changes)
        other = replace(kept, optima={**kept.optima, "gci": gci})
        monkeypatch.setattr(type(problem), "reference", property(lambda _: other))
        return problem

    return made


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"value": 0.2}, "paper.toml says that gci is 0.2 at its optimum 'gci', the model gives"),
        ({"value": 1e-3}, "the model gives"),
    ],
)
def test_a_recorded_optimum_that_the_model_does_not_give_is_no_verified_one(
    edited, capsys, changes, sentence
):
    problem = edited(**changes)
    optimum = verified_optimum(problem)
    assert optimum.name == "recorded, not verified"
    best = polish(problem, problem.printed_design()[None])
    assert sentence in judged(row_of("", best, 0, optimum), optimum)
    assert "agrees" not in judged(row_of("", best, 0, optimum), optimum)
    assert sentence in capsys.readouterr().err
    assert rows_beside_paper(best, "polished", optimum)[-1].name == "recorded, not verified"


def test_an_optimum_of_another_design_is_refused_by_its_file(edited):
    with pytest.raises(ValueError, match=r"paper.toml' is no reference: "):
        verified_optimum(edited(design={"H": 0.3}))


def test_an_optimum_that_is_not_recorded_is_solved():
    problem = pkm_gym.make_problem("diamond", task={"payload": 1.5}, fixed={"lam_e": 0.55})
    row = verified_optimum(problem)
    found = scipy.optimize.differential_evolution(
        lambda design: problem.evaluate(design[None]).log_merit[0],
        list(zip(problem.low, problem.high, strict=True)),
        seed=1,
        tol=1e-12,
        popsize=30,
    )
    assert np.log(row.value) == pytest.approx(
        np.log(problem.evaluate(found.x[None]).objectives[0, 0]), abs=1e-5
    )
    assert problem.evaluate(problem.design(row.design)[None]).feasible[0]


def test_an_optimum_on_which_the_seeds_disagree_is_called_uncertain(monkeypatch):
    problem = pkm_gym.make_problem("diamond", task={"payload": 1.5})
    monkeypatch.setattr(
        "pkm_gym.studies.search.polish.solve_tasks",
        lambda *a: replace(solve_tasks(*a), certified=np.array([False])),
    )
    optimum = verified_optimum(problem)
    assert optimum.name == "uncertain optimum"
    row = row_of("", problem.evaluate(problem.design(optimum.design)[None]), 0, optimum)
    assert "by searches that disagree" in judged(row, optimum)


def test_a_task_without_a_feasible_design_has_no_verified_optimum():
    problem = pkm_gym.make_problem("diamond", task={"sigma_low": 1.2, "sigma_high": 1.2})
    assert verified_optimum(problem) is None
    best = polish(problem, problem.printed_design()[None])
    assert "no feasible design of this task is known" in judged(row_of("", best, 0, None), None)


def test_a_polished_design_is_judged_by_its_distance(diamond):
    optimum = verified_optimum(diamond)
    evaluation = diamond.evaluate(diamond.printed_design()[None])
    paper = row_of("paper", evaluation, 0, optimum)
    assert paper.regret == pytest.approx(paper.value / optimum.value - 1.0, abs=1e-7)
    assert f"{100 * paper.regret:.3g} % behind the verified optimum (recorded)" in judged(
        paper, optimum
    )
    best = row_of("best", polish(diamond, diamond.printed_design()[None]), 0, optimum)
    assert judged(best, optimum).startswith("agrees")
    broken = row_of("broken", diamond.evaluate(np.array([[0.2, 1.2, 0.7]])), 0, optimum)
    assert judged(broken, optimum) == "no feasible design lies near the start"


def test_the_best_known_design_is_that_of_the_best_study_of_this_problem(searched, diamond):
    where = default_storage("diamond")
    assert best_known(diamond, where)[0] == "the printed design"
    heavier = pkm_gym.make_problem("diamond", task={"payload": 1.0})
    searched(heavier, trials=60, batch=30, name="heavier")
    assert best_known(diamond, where)[0] == "the printed design"
    found = [searched(trials=n, batch=30, name=f"of {n}") for n in (20, 90)]
    best = min(found, key=lambda f: f.best.objectives[0, 0])
    source, design = best_known(diamond, where)
    assert source == f"the best of the study {best.study.study_name}"
    np.testing.assert_array_equal(design, best.best.designs)
