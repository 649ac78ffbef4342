"""Planning: against SciPy's own optimiser, and on a surrogate that is off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import NonlinearConstraint, minimize

from pkm_gym.agents.designers.library import designer_for, load_designer
from pkm_gym.agents.planner.belief import Belief, terms
from pkm_gym.agents.planner.planner import FARTHEST, TRUST, plan
from pkm_gym.benchmark.splits import load_split

D, T = 3, 10


def random_belief(rng: np.random.Generator, deviation: float) -> Belief:
    """A convex merit, two constraints of two pieces each, all of them uncertain."""
    mean = np.zeros((3, 2, T))
    mean[:, :, 1 : 1 + D] = rng.normal(size=(3, 2, D))
    mean[:, :, 1 + D :] = 0.3 * rng.normal(size=(3, 2, T - 1 - D))
    mean[0, 0, [4, 7, 9]] = 8.0
    mean[1:, :, 0] = -0.01
    mean[0, 1, 0] = -np.inf
    covariance = np.broadcast_to(deviation**2 * np.eye(T), (3, 2, T, T))
    return Belief(np.full(D, 0.5), mean, covariance, np.zeros((1, 3), dtype=int))


@pytest.mark.parametrize("caution", [0.0, 1.0])
@pytest.mark.parametrize("seed", range(8))
def test_a_plan_is_what_trust_constr_finds(seed, caution):
    belief = random_belief(np.random.default_rng(seed), 1e-3)
    low, high = np.full(D, 0.4), np.full(D, 0.6)
    found = plan(belief, low, high, caution, caution)

    def worst(place):
        basis = terms(place - belief.centre)
        deviation = np.sqrt(np.einsum("t,fktu,u->fk", basis, belief.covariance[1:], basis))
        return (belief.mean[1:] @ basis + caution * deviation).ravel()

    def merit(place):
        return belief.mean[0, 0] @ terms(place - belief.centre)

    expected = minimize(
        merit, belief.centre, method="trust-constr", bounds=[*zip(low, high, strict=True)],
        constraints=NonlinearConstraint(worst, -np.inf, 0.0),
        options={"gtol": 1e-10, "xtol": 1e-12},
    )  # fmt: skip
    assert worst(found).max() <= 1e-9
    assert merit(found) <= expected.fun + 1e-6


def test_what_cannot_be_kept_is_broken_as_little_as_possible():
    belief = random_belief(np.random.default_rng(1), 1e-6)
    belief.mean[1, 0] = 0.0
    belief.mean[1, 0, :2] = 0.5, 1.0  # 0.5 + x, x >= -0.1
    place = plan(belief, np.full(D, 0.4), np.full(D, 0.6), 0.0, 0.0)
    assert place[0] == pytest.approx(0.4, abs=1e-6)


def test_hope_tries_what_caution_avoids():
    belief = random_belief(np.random.default_rng(2), 1e-2)
    low, high = np.full(D, 0.4), np.full(D, 0.6)
    careful, hopeful = (plan(belief, low, high, caution, caution) for caution in (2.0, -2.0))
    merits = [belief.mean[0, 0] @ terms(place - belief.centre) for place in (careful, hopeful)]
    assert merits[1] < merits[0]


def test_proposals_stay_in_the_box(random_planner):
    tasks = random_planner.problem.draw_tasks(3, np.random.default_rng(0))
    designs = random_planner.design(tasks).designs
    assert (
        (designs >= random_planner.problem.low) & (designs <= random_planner.problem.high)
    ).all()


def test_a_design_that_can_not_be_evaluated_ends_nothing(random_planner):
    problem = random_planner.problem
    wild = replace(random_planner, starts=Corner(problem.low))
    assert np.isfinite(wild.design({}).designs).all()


def test_a_start_that_breaks_a_limit_by_far_is_left_by_far():
    designer = load_designer("DiamondFamily")
    problem, split = load_split("diamond", "val")
    row = int(np.flatnonzero(split.solvable)[0])
    off = split.designs[row] + 0.3 * (problem.high - problem.low) * [1.0, -1.0, 1.0]
    moves = []
    for start in (split.designs[row], np.clip(off, problem.low, problem.high)):
        session = replace(designer, starts=Corner(start)).open(split.tasks[row][None])
        way = (designer.propose(session)[0] - start) / (problem.high - problem.low)
        moves.append(np.abs(way).max())
    assert moves[0] < 1e-2
    assert TRUST < moves[1] <= FARTHEST


@pytest.mark.slow
@pytest.mark.parametrize(("name", "share"), [("diamond", 0.87), ("spr3", 0.98)])
def test_beyond_the_range_most_answers_are_feasible(name, share):
    problem, split = load_split(name, "ood")
    rows = np.flatnonzero(split.solvable)[:64]
    found = designer_for(problem).design(split.tasks[rows])
    assert found.answer.feasible.mean() >= share


class Corner:
    """A start where nothing can be evaluated."""

    def __init__(self, design):
        self._design = design

    def designs(self, tasks):
        return np.repeat(self._design[None], len(tasks), axis=0)
