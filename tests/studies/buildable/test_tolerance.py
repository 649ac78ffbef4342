"""Tolerances: Sobol indices of known functions, distributions against plain Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.plots import figure_to_array
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.errors import normal, sobol_points
from pkm_gym.studies.buildable.pictures import tolerance_figure
from pkm_gym.studies.buildable.tolerance import _saltelli, sobol_indices, tolerance

from .conftest import optimum_of

SIZES = {"m": 1e-4, "rad": np.radians(0.05), "": 1e-4}
SAMPLES = 64


@pytest.fixture(scope="session")
def sigma(problem, optimum):
    """Errors of all that is built of each problem."""
    return {name: SIZES[unit] for name, unit in Dimensions(problem, optimum).units.items()}


@pytest.fixture(scope="session")
def found(problem, optimum, sigma):
    return tolerance(problem, optimum, sigma, samples=SAMPLES)


def test_the_indices_of_ishigami_s_function():
    """Known in closed form: Ishigami and Homma 1990, a = 7, b = 0.1."""
    x = np.pi * (2.0 * _saltelli(sobol_points(15, 6, seed=1)) - 1.0)
    values = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    first, total = sobol_indices(values, ["a", "b", "c"])
    assert [*first.values()] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.01)
    assert [*total.values()] == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.01)


def test_the_indices_of_a_sum_are_the_shares_of_its_variance():
    weights = np.array([3.0, 2.0, 1.0, 0.0])
    values = normal(_saltelli(sobol_points(11, 8, seed=2))) @ weights
    first, total = sobol_indices(values, [*"abcd"])
    for found in (first, total):
        assert [*found.values()] == pytest.approx(weights**2 / (weights**2).sum(), abs=0.01)


def test_what_does_not_vary_or_is_undefined_has_no_indices():
    values = np.ones(64)
    assert sobol_indices(values, ["a", "b"]) == ({}, {})
    values[3] = np.nan
    assert sobol_indices(values, ["a", "b"]) == ({}, {})


def test_sobol_points_are_scrambled_and_even():
    points = sobol_points(8, 3, seed=5)
    np.testing.assert_array_equal(points, sobol_points(8, 3, seed=5))
    assert not np.array_equal(points, sobol_points(8, 3, seed=6))
    for column in points.T:  # one in each of 256 strata
        assert sorted((256 * column).astype(int)) == [*range(256)]
    assert np.isfinite(normal(points)).all()


def test_the_machines_are_those_of_plain_monte_carlo(problem, optimum, sigma, found, rng):
    dimensions = Dimensions(problem, optimum)
    nominal = dimensions.of(dimensions.full)
    size = np.array([sigma[name] for name in dimensions.names])
    plain = dimensions.evaluate(nominal + size * rng.normal(size=(2 * SAMPLES, len(size))))
    share, error = plain.feasible.mean(), 4.0 * np.sqrt(0.5 / (2 * SAMPLES))
    assert found.share == pytest.approx(share, abs=error)
    values = plain.objectives[:, 0][np.isfinite(plain.objectives[:, 0])]
    assert found.objective.mean == pytest.approx(values.mean(), abs=0.5 * values.std())
    assert found.objective.std == pytest.approx(values.std(), rel=0.35)
    for name, of_plain in zip(problem.constraint_names, plain.constraints.T, strict=True):
        own = found.constraints[name]
        assert own.mean == pytest.approx(of_plain.mean(), abs=0.5 * of_plain.std() + 1e-12)


def test_an_optimum_on_its_limits_has_a_low_yield(problem, optimum, found):
    assert problem.evaluate(optimum[None]).feasible[0]
    assert found.share < 0.65
    assert found.broken
    assert max(found.broken.values()) <= 1.0 - found.share + 1e-12
    assert found.broken.keys() == found.margins.keys()


def test_a_margin_is_what_the_share_of_machines_needs(found):
    machines = found.machines
    for name, margin in found.margins.items():
        own = found.constraints[name]
        assert margin >= own.quantiles[0.95] - own.nominal - 1e-12
        assert margin <= own.quantiles[0.99] - own.nominal + 1e-12 or machines < 100


def test_indices_are_shares(found):
    own = found.objective
    assert own.first.keys() == own.total.keys() == found.sigma.keys()
    assert sum(own.first.values()) < 1.4
    assert sum(own.total.values()) > 0.6


def test_a_design_with_margins_is_built_without_rejects():
    problem = pkm_gym.make_problem("diamond")
    found = tolerance(problem, problem.printed_design(), {"l1": 1e-5, "e": 1e-5}, samples=64)
    assert found.share == 1.0
    assert found.broken == found.margins == {}


@pytest.mark.parametrize("size", [1e-5, 1e-4])
def test_the_picture_shows_every_dimension_and_broken_limit(size):
    problem = pkm_gym.make_problem("diamond")
    found = tolerance(problem, optimum_of(problem), {"l1": size, "e": size}, samples=64)
    pixels = figure_to_array(figure := tolerance_figure(found))
    assert pixels.std() > 10.0
    _, spread, limits = figure.axes
    assert [text.get_text() for text in spread.get_yticklabels()] == ["$e$", "$l_{1}$"]
    assert len(limits.patches) == len(found.broken)


def test_it_repeats_and_tells_how_far_it_is():
    problem = pkm_gym.make_problem("diamond")
    told = []
    made = [
        tolerance(problem, problem.printed_design(), {"H": 1e-4}, samples=64, report=told.append)
        for _ in range(2)
    ]
    assert made[0].objective == made[1].objective
    assert told == [192, 192]
    assert made[0].objective.first == {"H": 1.0}


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"sigma": {"l9": 1e-4}}, "unknown dimension 'l9'"),
        ({"sigma": {}}, "tolerances need a standard deviation > 0"),
        ({"sigma": {"l1": 0.0}}, "tolerances need a standard deviation > 0"),
        ({"samples": 100}, "samples is 100: it must be a power of 2 from 16 to 65,536"),
        ({"goal": 1.0}, "the goal is 1: it must be a share of machines from 0.5 to below 1"),
    ],
)
def test_what_is_not_allowed_is_refused(arguments, sentence):
    problem = pkm_gym.make_problem("diamond")
    with pytest.raises(ValueError, match=sentence):
        tolerance(problem, problem.printed_design(), **{"sigma": {"l1": 1e-4}, **arguments})
