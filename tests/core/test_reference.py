"""The numbers a paper prints, as they are read from paper.toml."""

from __future__ import annotations

import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import Reference

VERDICTS = ("reproduced", "not reproducible", "contradicted", "ours")
PRINTED = [name for name in pkm_gym.problems() if pkm_gym.make_problem(name).reference]


@pytest.fixture(scope="module", params=PRINTED)
def problem(request: pytest.FixtureRequest) -> DesignProblem:
    """Each problem that has a paper."""
    return pkm_gym.make_problem(request.param)


def test_every_number_has_a_place_a_verdict_and_a_tolerance(problem: DesignProblem) -> None:
    assert problem.reference.values
    for name, value in problem.reference.values.items():
        assert value.name == name
        assert value.symbol
        assert value.where
        assert 0.0 < value.tolerance <= 1e-2
        assert value.verdict.startswith(VERDICTS)
        assert (value.verdict == "ours") == (value.where == "not printed")
        if not value.verdict.startswith(("reproduced", "ours")):
            assert value.note, f"{name}: why is it not reproduced?"


def test_every_claim_has_a_verdict(problem: DesignProblem) -> None:
    for claim in problem.reference.claims:
        assert claim.claim
        assert claim.ours
        assert claim.verdict


def test_the_printed_design_lies_in_the_box(problem: DesignProblem) -> None:
    box = {variable.name: (variable.low, variable.high) for variable in problem.all_variables}
    for name, value in problem.reference.design.items():
        assert box[name][0] <= value <= box[name][1]


def test_each_objective_has_a_verified_optimum(problem: DesignProblem) -> None:
    optima = problem.reference.optima
    for objective in problem.all_objectives:
        assert optima[objective.name].objective == objective.name
        assert not optima[objective.name].fixed
    for optimum in optima.values():
        assert set(optimum.active) <= set(problem.constraint_names)
        assert set(optimum.design) == {v.name for v in problem.all_variables}
        assert optimum.fixed.items() <= optimum.design.items()


def test_the_paper_can_be_cited(problem: DesignProblem) -> None:
    assert {"authors", "title", "journal", "year"} <= set(problem.reference.paper)


def test_a_value_is_found_by_name_else_the_closest_is_offered(problem: DesignProblem) -> None:
    name = next(iter(problem.reference.values))
    assert problem.reference[name].name == name
    with pytest.raises(ValueError, match=f"unknown printed value '{name}_'; did you mean '{name}'"):
        problem.reference[f"{name}_"]


def test_it_is_read_once(problem: DesignProblem) -> None:
    assert Reference.load(problem.declared.package, problem.declared.reference) is problem.reference


def test_without_a_paper_nothing_is_printed() -> None:
    nothing = Reference.load("pkm_gym.core")
    assert not nothing
    for part in (nothing.design, nothing.values, nothing.optima, nothing.claims):
        assert not part
    assert not Reference.load("no_such_package")
    with pytest.raises(ValueError, match="unknown printed value 'l1'"):
        nothing["l1"]
