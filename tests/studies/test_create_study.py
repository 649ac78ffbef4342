"""Studies in the directions of a problem's objectives; others are refused."""

from __future__ import annotations

import optuna
import pytest

import pkm_gym
from pkm_gym.studies import create_study


@pytest.mark.parametrize(
    ("name", "objective", "directions"),
    [
        ("spr3", "gci", ["MAXIMIZE"]),
        ("diamond", "condition", ["MINIMIZE"]),
        ("diamond", ["tau_G", "condition"], ["MINIMIZE", "MINIMIZE"]),
    ],
)
def test_a_study_has_the_directions_of_its_objectives(name, objective, directions):
    problem = pkm_gym.make_problem(name, objective=objective)
    study = create_study(problem, study_name="mine")
    assert [direction.name for direction in study.directions] == directions
    assert study.study_name == "mine"
    study.optimize(problem.objective_for(), n_trials=3)


def test_a_study_that_would_find_the_worst_design_is_refused():
    problem = pkm_gym.make_problem("spr3")
    study = optuna.create_study()
    with pytest.raises(
        ValueError,
        match=r"the study is to minimize, but gci of spr3 to maximize: .*create_study\(problem\)",
    ):
        study.optimize(problem.objective_for(), n_trials=1)


def test_a_direction_of_one_s_own_is_refused():
    problem = pkm_gym.make_problem("spr3")
    with pytest.raises(ValueError, match="direction is what spr3 says: leave it out"):
        create_study(problem, direction="minimize")
