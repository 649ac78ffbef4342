"""Merit: its formula, its exactness, its scale, and which design is the answer."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pkm_gym
from pkm_gym.core import merit
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.limit import packed
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, solve_tasks

PERTURBATIONS = 64


def scored(
    values: list[float],
    constraints: list[list[float]],
    unreached: list[float],
    *,
    minimise: bool = True,
    scale: float = 2.0,
    weight: float = 5.0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Constraints, log merit and feasibility from scaled violations."""
    own = np.column_stack([np.full(len(values), -1.0), np.array(constraints)])
    n, c = own.shape
    names = [f"limit {j}" for j in range(c)]
    log_merit, feasible = np.empty(n), np.empty(n, dtype=bool)
    judged, defined = np.empty((n, c)), np.empty((n, c), dtype=bool)
    merit.judge(
        0.0, np.empty((n, 1)), np.empty((1, 1)), np.array(values)[:, None], own,
        np.array(unreached), np.full(n, scale), np.zeros(1), np.zeros(1),
        packed(names, names, {}, {}, ()), 0,
        1.0 if minimise else -1.0, 0.0, weight, judged, defined, log_merit, feasible,
    )  # fmt: skip
    assert defined.all()
    return judged[:, 1:], log_merit, feasible


@given(
    value=st.floats(1e-3, 1e3),
    violations=st.lists(st.floats(-1.0, 1.0), min_size=2, max_size=2),
    minimise=st.booleans(),
)
def test_log_merit_is_its_formula(value: float, violations: list[float], minimise: bool) -> None:
    constraints, log_merit, feasible = scored([value], [violations], [0.0], minimise=minimise)
    expected = [violation - merit.TOLERANCE for violation in violations]
    np.testing.assert_allclose(constraints[0], expected)
    ratio = value / 2.0 if minimise else 2.0 / value
    penalised = np.log(ratio) + 5.0 * sum(max(0.0, c) for c in expected)
    assert log_merit[0] == pytest.approx(min(penalised, merit.CAP), rel=1e-12, abs=1e-12)
    assert feasible[0] == (max(expected) <= 0.0)


def test_the_tolerance_is_inside_the_constraint() -> None:
    just_in, just_out = merit.TOLERANCE, np.nextafter(merit.TOLERANCE, 1.0)
    constraints, _, feasible = scored([1.0, 1.0], [[just_in], [just_out]], [0.0, 0.0])
    assert constraints[0, 0] == 0.0
    assert list(feasible) == [True, False]


@given(st.lists(st.floats(1e-9, 1e9), min_size=2, max_size=20))
def test_log_merit_rises_from_six_to_seven_beyond_reach(unreached: list[float]) -> None:
    ordered = sorted(unreached)
    n = len(ordered)
    _, log_merit, _ = scored([np.nan] * n, [[1.0]] * n, ordered)
    assert (np.diff(log_merit) >= 0.0).all()
    assert log_merit[0] > merit.CAP
    assert log_merit[-1] < merit.WORST + 1e-12


def test_log_merit_is_capped_where_something_can_be_evaluated() -> None:
    _, log_merit, _ = scored([np.inf, 1e300, 1.0], [[0.0], [0.0], [1e9]], [0.0] * 3)
    np.testing.assert_array_equal(log_merit, merit.CAP)


def test_the_answer_is_the_best_feasible_design_else_the_lowest_merit() -> None:
    values, log_merit = np.array([1.0, 3.0, 2.0]), np.array([0.0, -1.0, 1.0])
    feasible = np.array([False, True, True])
    assert merit.answer(values, feasible, log_merit, 1.0) == 2
    assert merit.answer(values, feasible, log_merit, -1.0) == 1
    assert merit.answer(values, ~np.ones(3, dtype=bool), log_merit, 1.0) == 1
    undefined = np.array([np.nan, 3.0, 2.0])
    assert merit.answer(undefined, feasible, log_merit, 1.0) == 2


# The merit of problems ----------------------------------------------------------------------------


def test_log_merit_of_designs_is_the_formula_up_to_the_tasks_scale(
    family_problem: DesignProblem, usable: Evaluation, broken: Evaluation, rng: np.random.Generator
) -> None:
    drawn = family_problem.low + (family_problem.high - family_problem.low) * rng.random(
        (500, len(family_problem.low))
    )
    evaluation = family_problem.evaluate(np.concatenate([usable.designs, broken.designs, drawn]))
    below = evaluation.log_merit < merit.CAP
    penalty = np.maximum(evaluation.constraints, 0.0).sum(axis=1)
    sign = 1.0 if family_problem.directions[0] == "minimize" else -1.0
    rest = evaluation.log_merit - family_problem.declared.penalty_weight * penalty
    rest -= sign * np.log(evaluation.objectives[:, 0] + family_problem.objectives[0].offset)
    assert below.sum() > 20
    np.testing.assert_allclose(rest[below], rest[below][0], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(evaluation.merit, np.exp(evaluation.log_merit), rtol=1e-15)


def test_log_merit_rises_on_the_way_out_of_reach() -> None:
    problem = pkm_gym.make_problem("diamond")
    ways = {"too near": [0.6, 2.56, -0.3], "too far": [0.6, 1.2, 1.5]}
    for end in ways.values():
        steps = np.linspace(0.0, 1.0, 400)[:, None]
        evaluation = problem.evaluate((1 - steps) * problem.printed_design() + steps * end)
        outside = np.isnan(evaluation.objectives[:, 0])
        assert outside.sum() > 50
        log_merit = evaluation.log_merit[outside]
        assert (np.diff(log_merit) > 0.0).all()
        assert (log_merit > merit.CAP).all()
        assert (evaluation.log_merit[~outside] <= merit.CAP).all()


@pytest.mark.parametrize(
    "objective", ["tau_G", "tau_peak", "tau_rms", "condition", "sigma_min", "sigma_max"]
)
def test_merit_is_one_at_the_optimum_of_the_papers_task(objective: str) -> None:
    problem = pkm_gym.make_problem("diamond", objective=objective)
    solution = solve_tasks(problem, problem.pack(None)[None])
    assert np.exp(solution.log_merit[0]) == pytest.approx(1.0, abs=1e-3)


def test_merit_is_near_one_at_the_optima_of_the_family(family: Solutions) -> None:
    merits = np.exp(family.log_merit[family.solvable])
    assert ((merits >= 0.5) & (merits <= 2.0)).mean() >= 0.95


def lower(family_problem: DesignProblem, family: Solutions, offsets: np.ndarray) -> np.ndarray:
    """By how much designs (tasks, k, d) away from the optima undercut their log merit: (tasks,)."""
    n, k, d = offsets.shape
    designs = np.clip(family.designs[:, None] + offsets, family_problem.low, family_problem.high)
    tasks = np.repeat(family.tasks, k, axis=0)
    log_merit = family_problem.evaluate(designs.reshape(-1, d), tasks).log_merit.reshape(n, k)
    undercut: np.ndarray = family.log_merit - log_merit.min(axis=1)
    return undercut[family.solvable]


@pytest.mark.parametrize("size", 10.0 ** np.arange(-6, 0))
def test_no_neighbour_of_a_constrained_optimum_has_a_lower_merit(
    family_problem: DesignProblem, family: Solutions, rng: np.random.Generator, size: float
) -> None:
    shape = (len(family.designs), PERTURBATIONS, len(family_problem.low))
    offsets = size * (family_problem.high - family_problem.low) * rng.normal(size=shape)
    assert lower(family_problem, family, offsets).max() <= 1e-9


@pytest.mark.parametrize("size", 10.0 ** np.arange(-6, 0))
def test_breaking_an_active_limit_never_pays(
    family_problem: DesignProblem, family: Solutions, size: float
) -> None:
    span = family_problem.high - family_problem.low
    step = 1e-7
    slopes = []
    for d in np.diag(span):
        ahead, behind = (
            family_problem.evaluate(family.designs + sign * step * d, family.tasks).constraints
            for sign in (1.0, -1.0)
        )
        slopes.append((ahead - behind) / (2.0 * step))
    gradients = np.stack(slopes, axis=-1) * family.active[..., None]  # (tasks, constraints, d)
    gradients = np.concatenate([gradients, gradients.sum(axis=1, keepdims=True)], axis=1)
    length = np.linalg.norm(gradients, axis=-1, keepdims=True)
    outward = np.divide(gradients, length, out=np.zeros_like(gradients), where=length > 0.0)
    coordinate = np.broadcast_to(np.eye(len(span)), (len(outward), len(span), len(span)))
    tangent = coordinate - np.einsum("nci,ncj->nij", outward[:, -1:], outward[:, -1:])
    directions = np.concatenate([outward, coordinate, tangent], axis=1)
    for sign in (1.0, -1.0):
        assert lower(family_problem, family, sign * size * span * directions).max() <= 1e-9
