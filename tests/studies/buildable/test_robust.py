"""A robust problem answers for a share of its machines."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.solve import polish
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.robust import robust
from pkm_gym.studies.buildable.tolerance import tolerance
from pkm_gym.studies.search.search import search

SIGMA = dict.fromkeys(("e", "l1", "l2", "H"), 1e-4)
SIZES = {"m": 1e-4, "rad": np.radians(0.05), "": 1e-4}


def test_numbers_are_quantiles_of_machines(problem, optimum, rng):
    sigma = {name: SIZES[unit] for name, unit in Dimensions(problem, optimum).units.items()}
    own = robust(problem, sigma, 0.75, machines=16)
    span = problem.high - problem.low
    near = optimum + 0.003 * span * rng.uniform(-1.0, 1.0, (8, len(span)))
    designs = np.clip(np.concatenate([optimum[None], near]), problem.low, problem.high)
    told = own.evaluate(designs)
    built = own._built(designs)
    feasible = built.feasible.reshape(len(designs), 16)
    np.testing.assert_array_equal(told.feasible, feasible.mean(axis=1) >= 0.75)
    np.testing.assert_array_equal(own.yields(designs), feasible.mean(axis=1))
    share = 0.75 if problem.objectives[0].direction == "minimise" else 0.25
    way = "inverted_cdf" if share > 0.5 else "higher"
    for i, held in enumerate(feasible):
        values = built.objectives[16 * i : 16 * (i + 1), 0][held]
        if len(values) and share > 0.5:
            wanted = np.quantile(values, share, method=way)
            assert told.objectives[i, 0] == pytest.approx(wanted, rel=1e-12)
        elif len(values):
            assert (values >= told.objectives[i, 0]).mean() >= 0.75
    assert np.isfinite(told.constraints).all()
    assert np.isfinite(told.log_merit).all()


def test_what_makes_no_machine_is_answered(problem, optimum):
    name = next(iter(Dimensions(problem, optimum).names))
    own = robust(problem, {name: 1e-4}, 0.9, machines=16)
    bad = np.stack([np.full(len(optimum), x) for x in (np.nan, -1.0, 1e9)])
    told = own.evaluate(bad)
    assert not told.feasible.any()
    assert np.isfinite(told.constraints).all()


def test_its_optimum_is_solved_as_any_other(diamond):
    own = robust(diamond, SIGMA, 0.75, machines=16)
    best = polish(own, own.printed_design()[None])
    told = own.evaluate(np.concatenate([best, own.printed_design()[None]]), own.pack(None)[None])
    assert told.feasible[0]
    assert told.objectives[0, 0] < told.objectives[1, 0]
    heavier = own.with_task({"payload": 1.0})
    assert heavier.errors == own.errors
    assert heavier.task.payload == 1.0
    with pytest.raises(ValueError, match="answers for its own task only"):
        own.evaluate(best, heavier.task)


@pytest.fixture
def diamond():
    return pkm_gym.make_problem("diamond")


def test_it_is_another_problem_than_the_plain_one(diamond):
    made = [robust(diamond, SIGMA, share) for share in (0.9, 0.95)]
    made.append(robust(diamond, {**SIGMA, "l1": 2e-4}, 0.9))
    assert len({diamond.hash(), *(own.hash() for own in made)}) == 4
    assert isinstance(made[0], type(diamond))
    assert diamond.evaluate(diamond.printed_design()[None]).feasible[0]


def test_a_search_finds_a_design_with_that_yield(searched, diamond):
    found = searched(robust(diamond, SIGMA, 0.9), sampler="cmaes", trials=120)
    assert found.best.feasible[0]
    share = tolerance(diamond, found.best.designs[0], SIGMA, samples=256).share
    assert share > 0.8
    with pytest.raises(ValueError, match=r"robust: 0.9 with sigma of e 0.1 mm.* there, 0.8"):
        search(robust(diamond, SIGMA, 0.8), sampler="cmaes", trials=3, name="a")
    with pytest.raises(ValueError, match="stands for another problem"):
        search(diamond, sampler="cmaes", trials=3, name="a")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"share": 1.5}, "--robust is 1.5: it must be a share of machines"),
        ({"sigma": {"l9": 1e-4}}, "unknown dimension 'l9'"),
        ({"sigma": {}}, "a robust search needs --sigma"),
        ({"machines": 10}, "must be a power of 2"),
    ],
)
def test_what_is_not_allowed_is_refused(diamond, arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        robust(diamond, **{"sigma": SIGMA, "share": 0.9, **arguments})


def test_several_objectives_are_refused():
    problem = pkm_gym.make_problem("diamond", objective=["tau_G", "condition"])
    with pytest.raises(ValueError, match="a robust search has one objective"):
        robust(problem, SIGMA, 0.9)
