"""How a problem is made, what it refuses, and what its hash depends on."""

from __future__ import annotations

import dataclasses
import pickle
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem


def refused(match: str, **arguments: Any) -> None:
    with pytest.raises(ValueError, match=match):
        pkm_gym.make_problem("diamond", **arguments)


def test_problems_are_listed_and_an_unknown_one_is_answered_with_the_closest() -> None:
    assert "diamond" in pkm_gym.problems()
    with pytest.raises(ValueError, match="unknown mechanism 'dimond'; did you mean 'diamond'"):
        pkm_gym.make_problem("dimond")


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"task": {"paylod": 1.0}}, "unknown task field 'paylod'; did you mean 'payload'"),
        ({"objective": "tau_g"}, "unknown objective 'tau_g'; did you mean 'tau_G'"),
        ({"free": ("lam_x",)}, "unknown variable 'lam_x'; did you mean 'lam_"),
        ({"fixed": {"lam_x": 1.0}}, "unknown variable 'lam_x'"),
        ({"bounds": {"gab": (0.1, 0.2)}}, "unknown variable 'gab'; did you mean 'gap'"),
        ({"smapling": (3, 3)}, "unknown argument 'smapling'; did you mean 'sampling'"),
        ({"fre": "all"}, "unknown argument 'fre'; did you mean 'free'"),
        ({"inertia": "uniform"}, "unknown inertia 'uniform'; did you mean 'uniform-arm'"),
    ],
)
def test_an_unknown_name_is_answered_with_the_closest(
    arguments: dict[str, Any], match: str
) -> None:
    refused(match, **arguments)


@pytest.mark.parametrize(
    ("arguments", "match"),
    [
        ({"task": {"payload": -1.0}}, "task.payload is -1.0: it must be a number from 0"),
        ({"objective": ()}, "name one or several"),
        ({"objective": ("tau_G", "tau_G")}, "several different"),
        ({"fixed": {"lam_e": float("nan")}}, "fixed lam_e is nan: it must be a finite number"),
        ({"fixed": {"lam_e": "wide"}}, "fixed lam_e is 'wide'"),
        ({"fixed": {"lam_e": 0.6}, "free": ("lam_e",)}, "lam_e is both free and fixed"),
        ({"free": ()}, "every variable is fixed"),
        ({"bounds": {"gap": (0.3, 0.3)}}, r"bounds of gap are \(0.3, 0.3\)"),
        ({"bounds": {"gap": (0.4, float("inf"))}}, "bound of gap is inf"),
        ({"fixed": {"gap": 0.4}, "bounds": {"gap": (0.1, 0.5)}}, "unknown variable 'gap'"),
        ({"sampling": (1, 9)}, "sampling is"),
        ({"sampling": (4.5, 9)}, "sampling is"),
        ({"sampling": (4, 4, 4)}, "sampling is"),
        ({"cycle_samples": 3}, "cycle_samples is 3"),
    ],
)
def test_an_illegal_value_is_refused(arguments: dict[str, Any], match: str) -> None:
    refused(match, **arguments)


# Free, fixed, bounds, objectives ------------------------------------------------------------------


def test_free_leaves_the_others_at_the_printed_design() -> None:
    problem = pkm_gym.make_problem("diamond", free=("gap",))
    printed = problem.reference.design
    assert problem.variable_names == ("gap",)
    assert problem.fixed == {name: printed[name] for name in ("lam_e", "lam_l")}


def test_a_fixed_variable_is_put_in() -> None:
    whole = pkm_gym.make_problem("diamond")
    part = pkm_gym.make_problem("diamond", fixed={"lam_l": 2.5})
    assert part.variable_names == ("lam_e", "gap")
    designs = np.array([[0.5, 0.4], [0.6, 0.3]])
    full = part.complete(designs)
    np.testing.assert_array_equal(full, [[0.5, 2.5, 0.4], [0.6, 2.5, 0.3]])
    np.testing.assert_array_equal(part.reduced(full), designs)
    one, other = part.evaluate(designs), whole.evaluate(full)
    np.testing.assert_array_equal(one.objectives, other.objectives)
    np.testing.assert_array_equal(one.log_merit, other.log_merit)
    assert part.mechanism(designs[0]) == whole.mechanism(full[0])


def test_bounds_replace_the_box() -> None:
    problem = pkm_gym.make_problem("diamond", bounds={"lam_l": (2.0, 3.0)})
    assert (problem.low[1], problem.high[1]) == (2.0, 3.0)
    assert problem.low[0] == pkm_gym.make_problem("diamond").low[0]


def test_bounds_are_no_constraint() -> None:
    problem = pkm_gym.make_problem("diamond", bounds={"lam_e": (0.2, 0.3)})
    outside = problem.printed_design()[None]
    assert outside[0, 0] > problem.high[0]
    assert problem.evaluate(outside).feasible[0]


@pytest.mark.parametrize("names", ["tau_rms", ("condition", "tau_G"), ("tau_peak", "condition")])
def test_objectives_are_the_chosen_indices_in_order(names: str | tuple[str, ...]) -> None:
    problem = pkm_gym.make_problem("diamond", objective=names)
    evaluation = problem.evaluate(problem.printed_design()[None])
    chosen = (names,) if isinstance(names, str) else names
    assert tuple(objective.name for objective in problem.objectives) == chosen
    assert problem.directions == ("minimize",) * len(chosen)
    expected = np.stack([evaluation.indices[name] for name in chosen], axis=1)
    np.testing.assert_array_equal(evaluation.objectives, expected)


def test_merit_uses_the_first_of_several_objectives(rng: np.random.Generator) -> None:
    both = pkm_gym.make_problem("diamond", objective=("condition", "tau_G"))
    first = pkm_gym.make_problem("diamond", objective="condition")
    designs = both.low + (both.high - both.low) * rng.random((100, 3))
    np.testing.assert_array_equal(
        both.evaluate(designs).log_merit, first.evaluate(designs).log_merit
    )


# Designs by name ----------------------------------------------------------------------------------


def test_named_and_design_are_inverse(problem: DesignProblem, rng: np.random.Generator) -> None:
    design = problem.low + (problem.high - problem.low) * rng.random(len(problem.low))
    named = problem.named(design)
    assert list(named) == [variable.name for variable in problem.all_variables]
    np.testing.assert_array_equal(problem.design(named), design)


@pytest.mark.parametrize(
    ("values", "match"),
    [
        ({"lam_l": 2.5}, "the design lacks gap: give lam_l, gap"),
        ({"lam_l": 2.5, "gap": 0.4, "lam_e": 0.5}, "lam_e is fixed at 0.6: 0.5 disagrees"),
        ({"lam_l": 2.5, "gop": 0.4}, "unknown variable 'gop'; did you mean 'gap'"),
    ],
)
def test_a_design_that_does_not_fit_is_refused(values: dict[str, float], match: str) -> None:
    problem = pkm_gym.make_problem("diamond", fixed={"lam_e": 0.6})
    with pytest.raises(ValueError, match=match):
        problem.design(values)


def test_a_design_that_makes_no_machine_is_refused(problem: DesignProblem) -> None:
    with pytest.raises(ValueError, match="nan"):
        problem.mechanism(np.full(len(problem.low), np.nan))
    with pytest.raises(ValueError, match="shape"):
        problem.mechanism(np.ones(len(problem.low) + 1))


def test_a_problem_survives_pickling(problem: DesignProblem) -> None:
    copy = pickle.loads(pickle.dumps(problem))
    assert copy.hash() == problem.hash()
    designs = 0.5 * (problem.low + problem.high)[None]
    np.testing.assert_array_equal(
        copy.evaluate(designs).log_merit, problem.evaluate(designs).log_merit
    )


# Hash ---------------------------------------------------------------------------------------------


def test_the_hash_is_the_same_every_time() -> None:
    arguments: dict[str, Any] = {"fixed": {"lam_e": 0.6}, "objective": ("tau_G", "condition")}
    one, other = (pkm_gym.make_problem("diamond", **arguments).hash() for _ in range(2))
    assert one == other
    assert len(one) == 64


@pytest.mark.parametrize(
    "arguments",
    [
        {"objective": "condition"},
        {"objective": ("tau_G", "condition")},
        {"free": ("lam_e", "gap")},
        {"fixed": {"lam_e": 0.6}},
        {"bounds": {"gap": (0.1, 0.6)}},
        {"inertia": "uniform-arm"},
        {"sampling": (25, 9)},
        {"cycle": True},
        {"cycle_samples": 101},
    ],
)
def test_the_hash_tells_problems_apart(arguments: dict[str, Any]) -> None:
    assert (
        pkm_gym.make_problem("diamond").hash()
        != pkm_gym.make_problem("diamond", **arguments).hash()
    )


def test_the_hash_depends_on_the_version_and_the_tasks_ranges(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = pkm_gym.make_problem("diamond")
    before = problem.hash()
    newer = dataclasses.replace(problem.declared, version=problem.declared.version + 1)
    monkeypatch.setattr(type(problem), "declared", newer)
    versioned = problem.hash()
    fewer = problem.task_variables[:-1]
    monkeypatch.setattr(problem.task_type, "variables", lambda: fewer)
    assert len({before, versioned, problem.hash()}) == 3


def test_the_hash_does_not_depend_on_the_task() -> None:
    # a study or a pool stores its tasks beside the hash
    loaded = pkm_gym.make_problem("diamond", task={"payload": 1.0})
    assert loaded.hash() == pkm_gym.make_problem("diamond").hash()


# What isn't searched unless it is asked for -------------------------------------------------------


def test_what_is_not_searched_stays_at_its_default_or_follows(slider: Any) -> None:
    problem = slider()
    assert problem.variable_names == ("arm", "rod")
    assert problem.fixed == {"gap": 0.1}
    assert problem.following == {"tail": "rod"}
    full = problem.complete(np.array([[0.3, 0.5], [0.4, 0.6]]))
    np.testing.assert_array_equal(full, [[0.3, 0.5, 0.5, 0.1], [0.4, 0.6, 0.6, 0.1]])
    assert problem.named(np.array([0.3, 0.5])) == {"arm": 0.3, "rod": 0.5, "tail": 0.5, "gap": 0.1}


def test_free_lists_exactly_what_is_searched(slider: Any) -> None:
    every = slider(free="all")
    assert every.variable_names == ("arm", "rod", "tail", "gap")
    assert every.fixed == every.following == {}
    problem = slider(free=("gap", "rod"))
    assert problem.variable_names == ("rod", "gap")
    assert problem.following == {"tail": "rod"}
    assert problem.fixed == {"arm": 0.85}  # without a paper, the middle of its range
    assert slider(free=("tail",)).variable_names == ("tail",)


def test_with_another_task_the_same_is_searched(slider: Any) -> None:
    problem = slider(free=("gap", "tail"), fixed={"arm": 0.5}, bounds={"gap": (0.05, 0.2)})
    field = problem.task_variables[0]
    again = problem.with_task({field.name: field.legal_high})
    assert getattr(again.task, field.name) == field.legal_high
    assert again.variables == problem.variables
    assert (again.fixed, again.following) == (problem.fixed, problem.following)
    assert again.hash() == problem.hash()


def test_what_follows_a_fixed_variable_has_its_value(slider: Any) -> None:
    problem = slider(fixed={"rod": 0.7})
    np.testing.assert_array_equal(problem.complete(np.array([[0.3]])), [[0.3, 0.7, 0.7, 0.1]])
    held = slider(fixed={"tail": 0.9})
    assert held.following == {}
    np.testing.assert_array_equal(held.complete(np.array([[0.3, 0.5]])), [[0.3, 0.5, 0.9, 0.1]])


def test_a_follower_is_no_free_coordinate_of_a_design(slider: Any) -> None:
    problem = slider()
    expected = np.array([0.3, 0.5])
    np.testing.assert_array_equal(problem.design({"arm": 0.3, "rod": 0.5}), expected)
    np.testing.assert_array_equal(problem.design(problem.named(expected)), expected)
    with pytest.raises(ValueError, match="tail follows rod: free it with free= to give its value"):
        problem.design({"arm": 0.3, "rod": 0.5, "tail": 0.6})
    with pytest.raises(ValueError, match=r"gap is fixed at 0\.1: 0\.2 disagrees"):
        problem.design({"arm": 0.3, "rod": 0.5, "gap": 0.2})
    every = slider(free="all")
    assert every.design({"arm": 0.3, "rod": 0.5, "tail": 0.6, "gap": 0.2})[2] == 0.6
    with pytest.raises(ValueError, match="the design lacks tail"):
        every.design({"arm": 0.3, "rod": 0.5})


def test_the_hash_knows_what_is_searched_and_leaves_defaults_out(slider: Any) -> None:
    made = [
        slider(), slider(fixed={"gap": 0.2}), slider(fixed={"tail": 0.9}), slider(free="all"),
        slider(free=("arm", "rod", "gap")), slider(fixed={"rod": 0.7}), slider(samples=7),
    ]  # fmt: skip
    assert len({problem.hash() for problem in made}) == len(made)
    same = [slider(fixed={"gap": 0.1}), slider(samples=5), slider(free=("arm", "rod"))]
    assert {problem.hash() for problem in same} == {made[0].hash()}


def test_a_problem_without_a_paper_prints_nothing_and_has_a_default_design(slider: Any) -> None:
    problem = slider()
    assert not problem.reference
    assert problem.grid() is None
    assert problem.derived(problem.printed_design()) == {}
    np.testing.assert_array_equal(problem.printed_design(), [0.85, 0.85])
    assert problem.mechanism(problem.printed_design()).symmetries() == ()


def test_an_index_is_reported_where_its_option_or_the_objective_asks_for_it(slider: Any) -> None:
    assert slider().index_names == ("size", "slope")
    for problem in (slider(full=True), slider(objective="mass")):
        assert problem.index_names == ("size", "slope", "mass")
        assert problem.options.full
    evaluation = slider(objective="mass").evaluate(np.array([[0.3, 0.5]]))
    assert evaluation.indices["mass"] == evaluation.objectives[:, 0] == pytest.approx([2.8])


def test_numbers_are_measured_where_variables_follow(slider: Any) -> None:
    problem, every = slider(), slider(free="all")
    designs = np.array([[0.3, 0.5], [0.4, 1.45], [0.2, 0.2]])
    one, other = problem.evaluate(designs), every.evaluate(problem.complete(designs))
    np.testing.assert_array_equal(one.constraints, other.constraints)
    np.testing.assert_array_equal(one.log_merit, other.log_merit)
    assert problem.mechanism(designs[0]) == every.mechanism(problem.complete(designs)[0])
    np.testing.assert_array_equal(one.quantity("tail"), designs[:, 1])
