"""The five-bar's design problem: indices, limits and words, and its optima against scipy's."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import differential_evolution

import pkm_gym
from pkm_gym.core.solve import solve_tasks

FIVE_BAR = "five_bar.problem:FiveBarProblem"


def usable(problem, rng, n=20):
    """Designs (n, 3) that reach the workspace."""
    designs = rng.uniform(problem.low, problem.high, (4000, 3))
    return designs[problem.evaluate(designs).unreached == 0.0][:n]


def test_indices_are_the_means_and_extremes_of_the_maps(problem, rng):
    designs = usable(problem, rng)
    assert len(designs) == 20
    evaluation = problem.evaluate(designs)
    found, sin_alpha = evaluation.indices, evaluation.quantity("sin_alpha")
    for i, design in enumerate(designs):
        machine = problem.mechanism(design)
        maps = machine.index_maps(machine.workspace_grid(401, 201))
        assert found["gci"][i] == pytest.approx(maps["gci"].values.mean(), abs=0.01)
        assert found["rate"][i] == pytest.approx(maps["rate"].values.max(), rel=1e-3)
        assert found["beta_min"][i] == pytest.approx(maps["beta_min"].values.min(), abs=0.01)
        assert sin_alpha[i] == pytest.approx(maps["sin_alpha"].values.min(), abs=0.01)
        assert found["size"][i] == pytest.approx(design.sum())


def test_the_mean_converges_with_the_nodes(problem):
    design = problem.design({"l1": 0.28, "l2": 0.43, "e": 0.03})[None]
    fine = pkm_gym.make_problem(FIVE_BAR, nodes=100).evaluate(design).indices["gci"]
    coarse = problem.evaluate(design).indices["gci"]
    assert abs(coarse - fine) < 2e-4


def test_every_limit_says_what_breaks_it(problem, rng):
    designs = rng.uniform(problem.low, problem.high, (2000, 3))
    designs[0, 0] = -0.1
    evaluation = problem.evaluate(designs)
    broken = evaluation.defined & (evaluation.constraints > 0.0)
    for name, column in zip(problem.constraint_names, broken.T, strict=True):
        i = np.flatnonzero(column)[0]
        lines = evaluation.explain(i).splitlines()
        assert any(line.startswith(f"{name}: ") for line in lines), (name, lines)


def test_there_is_no_paper(problem):
    assert not problem.reference
    assert problem.grid() is None


def test_optima_are_those_of_scipys_differential_evolution(problem, rng):
    tasks = np.concatenate([problem.pack(None)[None], problem.draw_tasks(2, rng)])
    solved = solve_tasks(problem, tasks)
    assert solved.solvable.all()
    assert solved.certified.all()
    for task, log_merit in zip(tasks, solved.log_merit, strict=True):

        def cost(designs, task=task):
            return problem.evaluate(designs.T, task[None]).log_merit

        found = differential_evolution(
            cost, list(zip(problem.low, problem.high, strict=True)), vectorized=True,
            updating="deferred", rng=1, tol=1e-12, maxiter=1000, popsize=30, polish=False,
        )  # fmt: skip
        assert log_merit == pytest.approx(found.fun, abs=1e-5)


def test_the_calibration_makes_merit_about_one_at_the_optimum(problem, rng):
    solved = solve_tasks(problem, problem.draw_tasks(8, rng))
    assert (np.abs(solved.log_merit[solved.solvable]) < 0.1).all()
    worst = problem.objectives[0].worst
    assert (solved.optima[solved.solvable] > worst).all()
