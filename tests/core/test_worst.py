"""How bad a feasible design of a task can be: over all problems, near what is feasible."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.trial import TrialObjective, trial_values
from pkm_gym.core.worst import declared_worst, worst_of

TASKS = 3  # of a Family


def test_no_feasible_design_of_a_task_reaches_its_worst(family_problem, usable):
    sign = family_problem.objectives[0].sign
    for i in range(0, len(usable), len(usable) // TASKS):
        worst = worst_of(family_problem, usable.task(i))
        same = (usable.tasks == usable.tasks[i]).all(axis=1)
        assert (sign * usable.objectives[same, 0] < sign * worst.values[0]).all()
        assert sign * worst.values[0] <= sign * declared_worst(family_problem).values[0]


def test_nor_do_others_of_the_default_task(problem, rng):
    worst = worst_of(problem, problem.task)
    drawn = problem.low + (problem.high - problem.low) * rng.random((1000, len(problem.low)))
    evaluation = problem.evaluate(drawn)
    values = evaluation.objectives[evaluation.feasible, 0] * problem.objectives[0].sign
    assert (values < problem.objectives[0].sign * worst.values[0]).all()


def test_what_is_infeasible_stands_near_what_is_feasible(problem, paper, rng):
    objective = TrialObjective(problem, problem.task)
    drawn = problem.low + (problem.high - problem.low) * rng.random((500, len(problem.low)))
    evaluation = problem.evaluate(np.concatenate([paper.designs, drawn]))
    values, feasible = objective.values(evaluation)[:, 0], evaluation.feasible
    away = np.ptp(values[feasible]) if feasible.sum() > 20 else abs(paper.optima[0])
    assert not feasible.all()
    assert np.ptp(values) < 5.0 * max(away, objective.worst.widths[0])
    assert len(set(values[~feasible])) > 1


def test_a_heavier_machine_has_a_worse_worst():
    light, heavy = (
        worst_of(pkm_gym.make_problem("diamond"), pkm_gym.make_problem("diamond", task=task).task)
        for task in (None, {"payload": 10.0})
    )
    assert heavy.values[0] > 3.0 * light.values[0]
    assert heavy.widths[0] > 3.0 * light.widths[0]


def test_where_nothing_is_feasible_what_is_declared_holds():
    problem = pkm_gym.make_problem("diamond", task={"sigma_low": 1.2, "sigma_high": 1.2})
    assert worst_of(problem, problem.task) == declared_worst(problem)
    evaluation = problem.evaluate(problem.printed_design()[None])
    objective = problem.objective_for(None)
    np.testing.assert_array_equal(objective.values(evaluation), trial_values(evaluation))


def test_the_scale_stands_for_an_optimum_where_none_was_drawn():
    problem = pkm_gym.make_problem("stroke_leg", objective=("force", "eta_P"))
    worst = worst_of(problem, problem.task_type(l=0.52))
    assert worst.values == pytest.approx([2.0 * 48.3153 * 0.52, 2.0 * 2.053139], rel=1e-12)
    assert worst.widths == pytest.approx(0.5 * worst.values, rel=1e-12)


def test_values_without_constraints_rank_as_merit_does(problem, paper, rng):
    span, shape = problem.high - problem.low, (300, len(problem.low))
    near = np.clip(paper.designs + 0.1 * span * rng.normal(size=shape), problem.low, problem.high)
    far = problem.low + span * rng.random(shape)
    evaluation = problem.evaluate(np.concatenate([paper.designs, near, far, far + 1e3]))
    objective, sign = TrialObjective(problem, problem.task), problem.objectives[0].sign
    values, merit = objective.descended(evaluation), evaluation.log_merit
    feasible = evaluation.feasible
    np.testing.assert_array_equal(values[feasible], evaluation.objectives[feasible, 0])
    ranked = np.lexsort((sign * values, merit))
    assert (np.diff(sign * values[ranked]) >= -1e-9 * np.abs(values[ranked]).max()).all()
    worst = objective.worst
    assert (sign * values <= sign * worst.values[0] + 2.0 * worst.widths[0]).all()
    assert np.isfinite(values).all()
