"""Slopes against SciPy's, prices against tasks that are solved again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import approx_fprime

import pkm_gym
from pkm_gym.core.solve import solve_tasks
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.sensitivity import sensitivity

from .conftest import optimum_of

SHARE = 1e-3  # by which a number of the task is changed
CHEAP = ("diamond", "stroke_leg")


@pytest.fixture(scope="session")
def found(problem, optimum):
    return sensitivity(problem, optimum)


def test_slopes_are_those_of_scipy(problem, optimum, found):
    """By the chain rule: the dimensions' slopes times how they go with the variables."""
    if found.kinks:
        pytest.skip("there is no slope where there is a kink")
    dimensions = Dimensions(problem, optimum)
    opened, full = dimensions.problem, dimensions.full

    def objective(design):
        return opened.evaluate(design[None]).objectives[0, 0]

    step = 1e-7 * np.abs(full) + 1e-12
    wanted = approx_fprime(full, objective, step)
    moves = approx_fprime(full, dimensions.of, step)
    own = np.array([found.gradient[n] / found.steps[n] for n in dimensions.names]) @ moves
    assert own == pytest.approx(wanted, rel=1e-4, abs=1e-5 * np.abs(wanted).max())


def test_bends_are_slopes_of_slopes(problem, optimum, found):
    if found.kinks:
        pytest.skip("there is no slope where there is a kink")
    dimensions = Dimensions(problem, optimum)
    point = dimensions.of(dimensions.full)

    def slopes(point):
        step = np.diag(1e-5 * np.abs(point))
        values = dimensions.evaluate(np.concatenate([point + step, point - step])).objectives
        return (values[: len(point), 0] - values[len(point) :, 0]) / (2.0 * np.diag(step))

    wanted = approx_fprime(point, slopes, 1e-4 * np.abs(point))
    steps = np.array([found.steps[name] for name in dimensions.names])
    wanted = wanted * np.outer(steps, steps)
    assert found.hessian == pytest.approx(found.hessian.T)
    assert found.hessian == pytest.approx(wanted, rel=0.02, abs=0.02 * np.abs(wanted).max())


def test_at_an_optimum_slopes_balance(found):
    assert found.optimal
    limits, edges = found.multipliers.limits, found.multipliers.edges
    assert limits or edges
    assert all(x >= 0.0 for x in (*limits.values(), *edges.values()))
    assert set(found.limits) <= set(limits)


@pytest.mark.parametrize("name", CHEAP)
def test_prices_are_those_of_tasks_that_are_solved_again(name):
    problem = pkm_gym.make_problem(name)
    found = sensitivity(problem, solve_tasks(problem, problem.pack(None)[None]).designs[0])
    priced = {k: price for k, price in found.task.items() if abs(price.share) > 1e-5}
    assert priced
    rows = [problem.task]
    for field in priced:
        value = getattr(problem.task, field)
        rows += [problem.task.replace(**{field: value * (1.0 + x)}) for x in (SHARE, -SHARE)]
    solved = solve_tasks(problem, np.array([task.pack() for task in rows]))
    assert solved.certified.all()
    worse = problem.objectives[0].sign * (solved.optima / solved.optima[0] - 1.0)
    for k, (field, price) in enumerate(priced.items()):
        slope = (worse[2 * k + 1] - worse[2 * k + 2]) / (2.0 * SHARE)
        assert 100.0 * price.share == pytest.approx(slope, rel=1e-3, abs=1e-4), field


@pytest.mark.parametrize("name", CHEAP)
def test_a_limit_s_price_is_that_of_the_field_that_bounds_nothing_else(name):
    problem = pkm_gym.make_problem(name)
    found = sensitivity(problem, optimum_of(problem))
    limits = {c.name: c for c in problem.declared.constraints if not isinstance(c, str)}
    bounds = [limit.bound for limit in limits.values()]
    compared = 0
    for name_, price in found.limits.items():
        field = limits[name_].bound
        if bounds.count(field) == 1 and field in found.task and not limits[name_].times:
            assert price.share == pytest.approx(found.task[field].share, rel=1e-4)
            compared += 1
    assert compared


def test_the_price_of_an_edge_is_that_of_another_search_box():
    problem = pkm_gym.make_problem("stroke_leg")
    found = sensitivity(problem, optimum_of(problem))
    assert found.multipliers.edges
    for name, share in found.multipliers.edges.items():
        (variable,) = (v for v in problem.variables if v.name == name)
        low, high = variable.low, variable.high
        at_low = abs(found.values[name] - low) < abs(found.values[name] - high)
        inwards = 1e-3 * (high - low)
        bounds = (low + inwards, high) if at_low else (low, high - inwards)
        other = pkm_gym.make_problem("stroke_leg", bounds={name: bounds})
        best = solve_tasks(other, other.pack(None)[None]).optima[0]
        worse = problem.objectives[0].sign * (best / found.nominal.objectives[0, 0] - 1.0)
        assert share * inwards == pytest.approx(worse, rel=0.02)


def test_what_is_no_optimum_has_no_prices():
    problem = pkm_gym.make_problem("diamond")
    assert not sensitivity(problem, problem.printed_design()).optimal


def test_a_design_whose_objective_is_undefined_is_refused():
    problem = pkm_gym.make_problem("diamond")
    with pytest.raises(ValueError, match="tau_G of this design is undefined: reach"):
        sensitivity(problem, np.array([0.6, 1.2, 0.1]))
