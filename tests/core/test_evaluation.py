"""What an Evaluation answers: hostile rows, the best design, broken limits in words."""

from __future__ import annotations

import pickle
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pkm_gym
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions

HOSTILE = (np.nan, np.inf, -np.inf, 0.0, -0.0, -1.0, 1e300, -1e300, 5e-324)


# Hostile designs ----------------------------------------------------------------------------------


def assert_answered(evaluation: Evaluation) -> None:
    assert np.isfinite(evaluation.merit).all()
    assert (evaluation.merit > 0.0).all()
    assert np.isfinite(evaluation.constraints).all()
    assert (evaluation.log_merit <= 7.0).all()


@pytest.mark.parametrize("value", HOSTILE)
def test_a_row_that_makes_no_machine_is_answered(problem: DesignProblem, value: float) -> None:
    d = len(problem.low)
    middle = 0.5 * (problem.low + problem.high)
    designs = np.concatenate(
        [np.full((1, d), value), np.where(np.eye(d, dtype=bool), value, middle), middle[None]]
    )
    evaluation = problem.evaluate(designs)
    assert_answered(evaluation)
    if not abs(value) <= 1.0:  # less may be legal of one variable, such as an angle
        assert not evaluation.feasible[:-1].any()
    if not 0.0 < value < 1.0:  # the tiniest machine is one
        assert evaluation.constraints[0, problem.constraint_names.index("dimensions")] > 0.0
        assert evaluation.log_merit[0] == pytest.approx(7.0)
    alone = problem.evaluate(middle[None])
    np.testing.assert_array_equal(evaluation.log_merit[-1:], alone.log_merit)
    for i in range(d + 1):
        said = evaluation.explain(i)
        assert (said == "feasible: every limit holds") == evaluation.feasible[i]


@given(st.lists(st.lists(st.floats(width=64), min_size=3, max_size=3), min_size=1, max_size=8))
def test_any_floats_are_answered(rows: list[list[float]]) -> None:
    problem = pkm_gym.make_problem("diamond", objective=("tau_peak", "condition"))
    evaluation = problem.evaluate(np.array(rows))
    assert_answered(evaluation)
    for i, row in enumerate(rows):
        words = evaluation.explain(i)
        assert words
        if evaluation.constraints[i, 0] <= 0.0:
            problem.mechanism(np.array(row))


@given(st.floats(-2e-6, 2e-6), st.floats(0.9, 1.1))
def test_the_edge_of_what_makes_a_machine_is_answered(slip: float, factor: float) -> None:
    problem = pkm_gym.make_problem("diamond")
    designs = np.array([[1e-3 + slip, 2.5, 0.4], [1e3 * factor, 2.5, 0.4], [0.6, 1e-3 + slip, 1.5]])
    evaluation = problem.evaluate(designs)
    assert_answered(evaluation)
    for i in range(len(designs)):
        assert evaluation.explain(i)


@pytest.mark.parametrize(
    "designs",
    [
        np.zeros(3),
        np.zeros((2, 2)),
        np.zeros((2, 4)),
        np.zeros((1, 2, 3)),
        np.zeros((2, 3), dtype=complex),
        np.zeros((2, 3), dtype=bool),
        [["a", "b", "c"]],
        [[None, 1.0, 2.0]],
        None,
        "design",
    ],
)
def test_a_wrong_shape_or_type_is_refused(designs: Any) -> None:
    with pytest.raises(ValueError, match=r"designs must be numbers of shape \(n, 3\)"):
        pkm_gym.make_problem("diamond").evaluate(designs)


@pytest.mark.parametrize(
    "shape", [(3, 13), (2, 12), (13,), (2, 13, 1)], ids=lambda shape: "x".join(map(str, shape))
)
def test_tasks_of_a_wrong_shape_are_refused(shape: tuple[int, ...]) -> None:
    problem = pkm_gym.make_problem("diamond")
    with pytest.raises(ValueError, match="tasks must be one task or packed tasks of shape"):
        problem.evaluate(np.ones((2, 3)), np.ones(shape))


def test_an_illegal_task_row_is_refused(problem: DesignProblem) -> None:
    tasks = np.repeat(problem.pack(None)[None], 2, axis=0)
    tasks[1, 0] = np.nan
    with pytest.raises(ValueError, match=f"task row 1: {problem.task_variables[0].name} is nan"):
        problem.evaluate(np.ones((2, len(problem.low))), tasks)


def test_no_design_at_all_is_an_empty_evaluation(problem: DesignProblem) -> None:
    evaluation = problem.evaluate(np.empty((0, len(problem.low))))
    assert len(evaluation) == 0
    with pytest.raises(ValueError, match="no design to choose from"):
        evaluation.best()


def test_integers_and_strided_arrays_are_taken(problem: DesignProblem) -> None:
    d = len(problem.low)
    whole = np.ones((4, 2 * d), dtype=np.int32)
    strided = problem.evaluate(whole[::2, ::2])
    np.testing.assert_array_equal(strided.log_merit, problem.evaluate(np.ones((2, d))).log_merit)


# Answers ------------------------------------------------------------------------------------------


def test_an_evaluation_survives_pickling(problem: DesignProblem, rng: np.random.Generator) -> None:
    designs = problem.low + (problem.high - problem.low) * rng.random((5, len(problem.low)))
    evaluation = problem.evaluate(designs)
    copy = pickle.loads(pickle.dumps(evaluation))
    np.testing.assert_array_equal(copy.constraints, evaluation.constraints)
    np.testing.assert_array_equal(copy.objectives, evaluation.objectives)
    assert copy.explain(0) == evaluation.explain(0)


def test_feasible_means_every_constraint_holds(usable: Evaluation, broken: Evaluation) -> None:
    for evaluation, feasible in ((usable, True), (broken, False)):
        holds = (evaluation.constraints <= 0.0).all(axis=1)
        np.testing.assert_array_equal(evaluation.feasible, holds)
        assert (holds == feasible).all()


def test_the_best_is_the_best_feasible_design(
    family_problem: DesignProblem, usable: Evaluation, broken: Evaluation
) -> None:
    designs = np.concatenate([usable.designs, broken.designs])
    evaluation = family_problem.evaluate(designs, usable.tasks[:1])
    assert evaluation.feasible[0]
    values = evaluation.objectives[:, 0]
    sign = 1.0 if family_problem.directions[0] == "minimize" else -1.0
    order = sorted(np.flatnonzero(evaluation.feasible), key=lambda i: sign * values[i])
    assert evaluation.best() == order[0]
    assert list(evaluation.ranking()[: len(order)]) == order
    infeasible = family_problem.evaluate(designs[~evaluation.feasible], usable.tasks[:1])
    assert infeasible.best() == np.argmin(infeasible.log_merit)
    for i, j in ((0, 1), (5, 2), (len(designs) - 1, 0)):
        pair = family_problem.evaluate(designs[[j, i]], usable.tasks[:1])
        assert evaluation.beats(i, evaluation, j) == (pair.best() == 1)
    assert not evaluation.beats(0, evaluation, 0)


def test_the_task_of_a_design(family_problem: DesignProblem, family: Solutions) -> None:
    evaluation = family_problem.evaluate(family.designs, family.tasks)
    np.testing.assert_array_equal(evaluation.task(5).pack(), family.tasks[5])
    assert family_problem.evaluate(family.designs).task(5) == family_problem.task


# Words --------------------------------------------------------------------------------------------


def test_explain_has_a_line_for_each_broken_limit_that_is_defined(
    family_problem: DesignProblem, spread: Any, broken: Evaluation, rng: np.random.Generator
) -> None:
    drawn = spread(family_problem, rng, 60)
    both = zip(drawn, (broken.designs[:40], broken.tasks[:40]), strict=True)
    evaluation = family_problem.evaluate(*map(np.concatenate, both))
    own = {limit for limit in family_problem.declared.constraints if isinstance(limit, str)}
    for i, row in enumerate(evaluation.constraints):
        broken = {
            n for n, value in zip(family_problem.constraint_names, row, strict=True) if value > 0.0
        }
        words = evaluation.explain(i)
        if not broken:
            assert words == "feasible: every limit holds"
            continue
        told = {line.split(":")[0] for line in words.splitlines()}
        edge = evaluation.unreached[i] > 0.0  # of which the limit that is nearest is told
        assert told <= (broken | own if edge else broken)
        if evaluation.unreached[i] == 0.0:
            assert told == broken
        assert re.search(r"\d", words)


def test_explain_counts_from_either_end(problem: DesignProblem) -> None:
    designs = np.stack([problem.low, problem.printed_design()])
    evaluation = problem.evaluate(designs)
    assert evaluation.explain(-1) == evaluation.explain(1)
    for i in (2, -3):
        with pytest.raises(IndexError, match=f"there is no design {i}: 2 were evaluated"):
            evaluation.explain(i)


PRINTED = (0.6, 2.56, 0.41)
CORNER, TOP = r"at x = -?400 mm, y = -612 mm", r"at x = -?1\d\d mm, y = -492 mm"
BROKEN: dict[str, tuple[dict[str, float], tuple[float, ...], str]] = {
    "reach_inner": ({}, (0.6, 2.56, -0.1), r"top edge comes 25\.0 mm too near to a drive"),
    "reach_outer": ({}, (0.6, 1.3, 0.7), r"far bottom corner lies 87\.9 mm beyond the limb"),
    "spacing": (
        {"lam_e_min": 0.65},
        PRINTED,
        r"lam_e is 0\.6, 0\.05 too small; it must be at least 0\.65",
    ),
    "sigma_max": (
        {"sigma_high": 1.4},
        PRINTED,
        rf"is 1\.49\d+ {TOP}, 0\.09\d+ too large; .* at most 1\.4",
    ),
    "sigma_min": (
        {"sigma_low": 0.75},
        PRINTED,
        rf"is 0\.7301 {CORNER}, 0\.0198\d+ too small; .* at least 0\.75",
    ),
    "alpha": (
        {"alpha_low": 1.0},
        PRINTED,
        rf"is 55\.25 deg {CORNER}, 2\.05 deg too small; .* at least 57\.3 deg",
    ),
    "beta": (
        {"beta_low": 0.8},
        PRINTED,
        rf"is 44\.17 deg {TOP}, 1\.67\d deg too small; .* at least 45\.84 deg",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_the_diamonds_broken_limit_is_told_with_place_and_amount(name: str) -> None:
    task, design, words = BROKEN[name]
    problem = pkm_gym.make_problem("diamond", task=task)
    told = problem.evaluate(np.array([design])).explain(0)
    assert re.fullmatch(f"{name}: .*{words}", told), told
