"""Agents on one task: what their training found is what it evaluated."""

from __future__ import annotations

import numpy as np

import pkm_gym
from pkm_gym.agents.sb3.comparison import algorithm_rows, train_on
from pkm_gym.studies.search.polish import verified_optimum


def test_training_counts_and_keeps_the_best_of_what_it_evaluated():
    problem = pkm_gym.make_problem("diamond", task={"payload": 1.0}, fixed={"lam_e": 0.6})
    trained = train_on(problem, "ppo", seed=0, steps=800)
    assert trained.evaluations >= 800
    assert trained.best.designs.shape == (1, 2)
    np.testing.assert_allclose(trained.best.tasks[0], problem.pack(None))
    assert trained.best.feasible[0]
    limit = problem.evaluate(0.5 * (problem.low + problem.high)[None])
    assert not limit.feasible[0] or trained.best.objectives[0, 0] < limit.objectives[0, 0]


def test_each_algorithm_has_two_rows_a_seed(monkeypatch):
    problem = pkm_gym.make_problem("diamond")
    known = train_on(problem, "ppo", seed=0, steps=400)
    monkeypatch.setattr("pkm_gym.agents.sb3.comparison.train_on", lambda *_, **__: known)
    found = algorithm_rows(problem, verified_optimum(problem), 2, lambda: None)
    assert list(found) == ["ppo, training", "ppo, trained", "sac, training", "sac, trained"]
    assert all(len(runs) == 2 for runs in found.values())
    assert found["ppo, training"][0].evaluations == known.evaluations
