"""Searches: what a trial is told, what the answer is, how they start, in batches and threads."""

from __future__ import annotations

import numpy as np
import optuna
import pytest
from optuna.trial import FixedTrial, TrialState

import pkm_gym
from pkm_gym.core.merit import CAP
from pkm_gym.core.worst import worst_of
from pkm_gym.studies.search.samplers import MAKERS
from pkm_gym.studies.search.search import search
from pkm_gym.studies.storage.studies import designs_of, finished

FAST = [name for name in MAKERS if name != "gp"]


def points(study):
    return {tuple(trial.params.values()) for trial in finished(study)}


@pytest.mark.parametrize("batch", [1, 7, 64])
def test_a_batch_gives_the_values_that_the_plain_objective_gives(searched, diamond, batch):
    found = searched(trials=40, batch=batch)
    assert found.finished == 40
    objective = diamond.objective_for(diamond.task)
    for trial in finished(found.study):
        alone = FixedTrial(trial.params)
        assert trial.value == pytest.approx(objective(alone), rel=1e-12)
        assert trial.user_attrs == pytest.approx(alone.user_attrs, rel=1e-12, abs=1e-12)
        row = diamond.evaluate(np.array([list(trial.params.values())])).constraints[0]
        expected = dict(zip(diamond.constraint_names, row, strict=True))
        assert trial.constraints == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_the_best_trial_by_value_is_the_answer(searched, diamond):
    found = searched(trials=150, batch=50)
    trials = finished(found.study)
    evaluation = diamond.evaluate(designs_of(found.study, diamond))
    best = min(range(len(trials)), key=lambda i: trials[i].value)
    assert evaluation.feasible.any()
    assert best == evaluation.best()
    assert found.trial == found.study.best_trial.number == trials[best].number
    assert found.best.objectives[0, 0] == trials[best].value
    worst = worst_of(diamond, diamond.task).values[0]
    assert all((t.value < worst) == f for t, f in zip(trials, evaluation.feasible, strict=True))


def test_without_a_feasible_design_the_answer_has_the_lowest_merit(searched):
    crowded = pkm_gym.make_problem("diamond", task={"sigma_low": 1.2, "sigma_high": 1.2})
    found = searched(crowded, trials=40)
    merits = [trial.user_attrs["log_merit"] for trial in finished(found.study)]
    assert not found.best.feasible[0]
    assert found.best.log_merit[0] == min(merits)


@pytest.mark.parametrize("sampler", FAST)
def test_every_sampler_searches_and_resumes_without_repeating_a_point(searched, sampler):
    first = searched(sampler=sampler, trials=9, name=sampler)
    before = points(first.study)
    found = searched(sampler=sampler, trials=25, name=sampler)
    assert found.finished == len(points(found.study)) == 25
    assert before < points(found.study)


@pytest.mark.slow
def test_a_gaussian_process_searches_and_resumes(searched):
    searched(sampler="gp", trials=11)
    assert len(points(searched(sampler="gp", trials=13).study)) == 13


def test_a_finished_study_is_left_alone(searched):
    number = searched().trial
    again = searched(trials=10)
    assert (again.finished, again.trial) == (30, number)


def test_workers_with_one_seed_propose_different_designs(searched):
    studies = [searched(trials=8, name=f"of {k}", worker=k, seed=4).study for k in range(3)]
    assert len(set.union(*map(points, studies))) == 24


def test_the_same_seed_searches_the_same_designs(searched):
    one, other = (searched(trials=12, name=name, seed=5).study for name in ("one", "other"))
    assert points(one) == points(other)


@pytest.mark.parametrize("batch", [1, 5])
def test_threads_share_a_study_and_stop_at_the_total(searched, diamond, batch):
    found = searched(trials=43, jobs=3, batch=batch, sampler="tpe")
    assert found.finished == len(points(found.study)) == 43
    assert {t.state for t in found.study.trials} == {TrialState.COMPLETE}
    assert (
        found.trial
        == finished(found.study)[diamond.evaluate(designs_of(found.study, diamond)).best()].number
    )


def test_plain_optuna_searches_in_two_threads(diamond):
    study = optuna.create_study(sampler=optuna.samplers.RandomSampler(seed=1))
    # what two threads draw isn't the same each time: there is a feasible one
    study.enqueue_trial(dict(zip(diamond.variable_names, diamond.printed_design(), strict=True)))
    study.optimize(diamond.objective_for(diamond.task), n_trials=40, n_jobs=2)
    evaluation = diamond.evaluate(designs_of(study, diamond))
    assert study.best_value == evaluation.objectives[evaluation.best(), 0]


def test_cmaes_ranks_by_merit_in_the_objective_s_unit_and_answers_with_the_best(searched, diamond):
    found = searched(sampler="cmaes", trials=80)
    trials = finished(found.study)
    evaluation = diamond.evaluate(designs_of(found.study, diamond))
    values = np.array([t.value for t in trials])
    feasible = evaluation.feasible
    np.testing.assert_array_equal(values[feasible], evaluation.objectives[feasible, 0])
    known = evaluation.log_merit < CAP
    order, ranked = np.argsort(values[known]), np.argsort(evaluation.log_merit[known])
    np.testing.assert_array_equal(order, ranked)
    assert not any(t.constraints for t in trials)
    for trial, row in zip(trials, evaluation.constraints, strict=True):
        assert list(trial.user_attrs["constraints"].values()) == pytest.approx(list(row))
    assert trials[0].params == dict(
        zip(diamond.variable_names, 0.5 * (diamond.low + diamond.high), strict=True)
    )
    feasible = np.flatnonzero(evaluation.feasible)
    best = feasible[np.argmin(evaluation.objectives[feasible, 0])]
    assert found.trial == trials[best].number
    assert found.study.metric_names == ["tau_G"]


@pytest.mark.parametrize("sampler", ["tpe", "nsga2", "nsga3"])
def test_several_objectives_keep_their_values_and_the_answer_is_the_first_ones(searched, sampler):
    problem = pkm_gym.make_problem("diamond", objective=("tau_G", "condition"))
    found = searched(problem, sampler=sampler, trials=80)
    evaluation = problem.evaluate(designs_of(found.study, problem))
    trials = finished(found.study)
    assert found.trial == trials[evaluation.best()].number
    values = np.array([t.values for t in trials])
    np.testing.assert_array_equal(
        values[evaluation.feasible], evaluation.objectives[evaluation.feasible]
    )
    front = found.study.best_trials
    assert front
    assert all(t.user_attrs["feasible"] for t in front)


def test_a_warm_start_from_the_paper_tries_the_printed_design_first(searched, diamond):
    found = searched(trials=2, warm_start=["paper"])
    params = finished(found.study)[0].params
    np.testing.assert_array_equal(list(params.values()), diamond.printed_design())


def test_a_warm_start_from_the_grid_tries_its_best_feasible_designs(searched, diamond):
    found = searched(trials=15, warm_start=["grid"])
    evaluation = diamond.evaluate(diamond.grid())
    feasible = np.flatnonzero(evaluation.feasible)
    best = feasible[np.argsort(evaluation.objectives[feasible, 0], kind="stable")[:10]]
    np.testing.assert_array_equal(designs_of(found.study, diamond)[:10], diamond.grid()[best])


def test_a_warm_start_from_a_study_takes_over_its_best_designs_once(searched, diamond):
    source = searched(trials=100, batch=50, name="source").study
    heavier = pkm_gym.make_problem("diamond", task={"payload": 1.0})
    for trials in (12, 14):
        found = searched(heavier, trials=trials, name="warm", warm_start=["source"])
    designs = designs_of(source, diamond)
    best = designs[heavier.evaluate(designs).ranking()[:10]]
    np.testing.assert_array_equal(designs_of(found.study, heavier)[:10], best)
    assert len(points(found.study)) == 14


def test_a_warm_start_keeps_to_the_search_bounds(searched):
    narrow = pkm_gym.make_problem("diamond", bounds={"lam_l": (2.6, 3.0)})
    found = searched(narrow, trials=12, warm_start=["grid"])
    assert (designs_of(found.study, narrow)[:, 1] >= 2.6).all()
    with pytest.raises(ValueError, match="no design of 'paper' lies within the search bounds"):
        searched(narrow, name="b", warm_start=["paper"])


@pytest.mark.parametrize("number", ["trials", "batch", "jobs"])
def test_numbers_below_one_are_refused(searched, number):
    with pytest.raises(ValueError, match=f"{number} is 0: it must be at least 1"):
        searched(**{number: 0})


@pytest.mark.usefixtures("undrawn")
def test_a_sampler_that_cannot_do_it_is_refused(diamond):
    with pytest.raises(ValueError, match="unknown sampler 'cma'; did you mean 'cmaes'"):
        search(diamond, sampler="cma")
    several = pkm_gym.make_problem("diamond", objective=("tau_G", "condition"))
    with pytest.raises(ValueError, match="cmaes searches one objective"):
        search(several, sampler="cmaes")
