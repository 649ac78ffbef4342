"""solve_tasks and polish: certified, feasible, repeatable."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, polish, solve_tasks


def test_almost_every_task_of_the_family_is_solvable_and_certified(
    family_problem: DesignProblem, family: Solutions
) -> None:
    assert family.solvable.mean() >= 0.9
    if family_problem.declared.searches > 1:
        assert family.certified.mean() >= 0.99
    else:  # one search of many basins: the best known
        assert not family.certified.any()


def test_optima_are_strictly_feasible(family_problem: DesignProblem, family: Solutions) -> None:
    evaluation = family_problem.evaluate(family.designs, family.tasks)
    solved = family.solvable
    assert evaluation.feasible[solved].all()
    assert evaluation.constraints[solved].max() < 0.0
    np.testing.assert_array_equal(evaluation.objectives[solved, 0], family.optima[solved])
    np.testing.assert_array_equal(evaluation.log_merit, family.log_merit)
    np.testing.assert_array_equal(np.isnan(family.optima), ~solved)
    assert ((family.designs >= family_problem.low) & (family.designs <= family_problem.high)).all()


def test_random_designs_never_beat_an_optimum(
    family_problem: DesignProblem, family: Solutions, rng: np.random.Generator
) -> None:
    designs = family_problem.low + (family_problem.high - family_problem.low) * rng.random(
        (1000, len(family_problem.low))
    )
    sign = 1.0 if family_problem.directions[0] == "minimize" else -1.0
    for task, optimum, solvable in zip(
        family.tasks[:20], family.optima, family.solvable, strict=False
    ):
        evaluation = family_problem.evaluate(designs, task[None])
        values = sign * evaluation.objectives[evaluation.feasible, 0]
        assert not values.size or (solvable and values.min() >= sign * optimum)


def test_the_same_seed_gives_the_same_optima(
    family_problem: DesignProblem, family: Solutions
) -> None:
    few = family.tasks[: 1 if family_problem.declared.starts else 2]
    one, other = (solve_tasks(family_problem, few, seed=3) for _ in range(2))
    for name in ("designs", "optima", "log_merit", "active", "solvable", "certified"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
    assert one.evaluations == other.evaluations > 0


def test_another_seed_agrees_to_ten_digits(
    family_problem: DesignProblem, family: Solutions
) -> None:
    if family_problem.declared.searches == 1:
        pytest.skip("one search of many basins: another one may end in another")
    few = slice(4 if family_problem.declared.starts else 12)
    again = solve_tasks(family_problem, family.tasks[few], seed=99)
    both = again.certified & family.certified[few] & again.solvable
    assert both.sum() >= 0.9 * again.solvable.sum() > 0.0
    np.testing.assert_array_equal(again.solvable, family.solvable[few])
    np.testing.assert_allclose(
        again.log_merit[both], family.log_merit[few][both], rtol=0.0, atol=1e-10
    )


def test_an_impossible_task_is_marked_unsolvable() -> None:
    problem = pkm_gym.make_problem("diamond")
    impossible = problem.pack({"sigma_low": 1.2, "sigma_high": 1.2})
    solutions = solve_tasks(problem, np.stack([problem.pack(None), impossible]))
    np.testing.assert_array_equal(solutions.solvable, [True, False])
    assert np.isnan(solutions.optima[1])
    assert np.isfinite(solutions.designs).all()
    assert not solutions.active[1].any()


def test_active_limits_hold_the_optimum_back() -> None:
    problem = pkm_gym.make_problem("diamond")
    base = solve_tasks(problem, problem.pack(None)[None])
    names = np.array(problem.constraint_names)[base.active[0]]
    assert list(names) == ["sigma_max"]
    freed = solve_tasks(problem, problem.pack({"sigma_high": 1.55})[None])
    same = solve_tasks(problem, problem.pack({"sigma_low": 0.55})[None])
    assert freed.optima[0] < base.optima[0] * (1.0 - 1e-3)
    assert same.optima[0] == pytest.approx(base.optima[0], rel=1e-9)


def test_a_single_task_row_and_progress(problem: DesignProblem) -> None:
    told: list[int] = []
    solutions = solve_tasks(problem, problem.pack(None), progress=told.append)
    assert solutions.tasks.shape == (1, len(problem.task_variables))
    assert told == sorted(told)
    assert told[-1] == 1


def test_solving_follows_fixed_variables_and_bounds() -> None:
    problem = pkm_gym.make_problem(
        "diamond", fixed={"lam_e": 0.5}, bounds={"lam_l": (2.2, 2.4), "gap": (0.38, 0.5)}
    )
    solutions = solve_tasks(problem, problem.pack(None)[None])
    assert solutions.designs.shape == (1, 2)
    assert ((solutions.designs >= problem.low) & (solutions.designs <= problem.high)).all()


def test_polish_is_never_worse_than_its_start(
    family_problem: DesignProblem, usable: Evaluation, broken: Evaluation
) -> None:
    starts = np.concatenate([broken.designs[:12], usable.designs[:12]])
    tasks = np.concatenate([broken.tasks[:12], usable.tasks[:12]])
    before = family_problem.evaluate(starts, tasks)
    after = family_problem.evaluate(polish(family_problem, starts, tasks), tasks)
    assert after.feasible[before.feasible].all()
    assert after.feasible.sum() > before.feasible.sum() == 12
    assert (after.log_merit <= before.log_merit + 1e-12)[before.feasible].all()
    lost = ~after.feasible
    assert (after.log_merit <= before.log_merit)[lost].all()


def test_polish_keeps_a_start_that_nothing_in_the_box_beats() -> None:
    problem = pkm_gym.make_problem("diamond", bounds={"lam_e": (0.2, 0.3)})
    outside = problem.design(problem.reference.optima["tau_G"].design)[None]
    np.testing.assert_array_equal(polish(problem, outside), outside)


def test_polish_of_an_optimum_stays_there(family_problem: DesignProblem, family: Solutions) -> None:
    solved = np.flatnonzero(family.solvable)[:8]
    polished = polish(family_problem, family.designs[solved], family.tasks[solved])
    after = family_problem.evaluate(polished, family.tasks[solved])
    np.testing.assert_allclose(after.log_merit, family.log_merit[solved], rtol=0.0, atol=1e-10)


def test_polish_reaches_the_optimum_from_nearby() -> None:
    problem = pkm_gym.make_problem("diamond")
    optimum = problem.reference.optima["tau_G"]
    start = problem.design(optimum.design) + np.array([-5e-3, 0.02, 5e-3])
    polished = polish(problem, start[None])
    assert problem.evaluate(polished).objectives[0, 0] == pytest.approx(optimum.value, rel=1e-7)
