"""Opponents that search with Optuna's samplers: counted, repeatable, better than chance."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np
import optuna
import pytest

from pkm_gym.benchmark import Session, Spent, Training, View, find_method, load_split
from pkm_gym.benchmark.methods import METHODS
from pkm_gym.benchmark.optima import KnownOptima
from pkm_gym.benchmark.splits import manifest
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.benchmark import opponents
from pkm_gym.studies.benchmark.opponents import sampler_search

NAMES = [name for name, where in METHODS.items() if where.startswith("pkm_gym.studies.")]
FAST = [name for name in NAMES if name != "gp"]
SHIPPED = sorted({name.rpartition("_")[0] for name in manifest()})
BUDGET = 200  # four generations of NSGA-II
TASKS = 3


@pytest.fixture(scope="session", params=SHIPPED)
def shipped(request) -> tuple[DesignProblem, Pool, Pool]:
    """Each problem that has splits, with its first solvable tasks of val and the rest as a pool."""
    problem, split = load_split(request.param, "val")
    rows = np.flatnonzero(split.solvable)
    return problem, split.only(rows[:TASKS]), split.only(rows[TASKS:])


def prepared(name: str, problem: DesignProblem, pool: Pool):
    found = find_method(name)
    known = Training(problem, pool) if found.knowledge == "transfer" else None
    return found.prepare(View.of(problem), known)


def search(name: str, shipped, row: int, *, budget: int = BUDGET, seed: int = 0) -> Session:
    problem, asked, pool = shipped
    session = Session(problem, asked.tasks[row], budget=budget, seed=seed)
    with suppress(Spent):
        prepared(name, problem, pool)(session)
    return session


@pytest.fixture(scope="session")
def searched(shipped) -> Callable[[str], list[Session]]:
    """Return what a method did on the tasks; it runs once."""
    known: dict[str, list[Session]] = {}

    def of(name: str) -> list[Session]:
        if name not in known:
            known[name] = [search(name, shipped, row) for row in range(TASKS)]
        return known[name]

    return of


def reached(sessions: list[Session]) -> float:
    """Return the median over tasks of the lowest log merit of a feasible design."""
    return float(np.median([e.log_merit[e.feasible].min(initial=np.inf) for e in sessions]))


@pytest.mark.parametrize("name", FAST)
def test_what_is_counted_is_what_was_evaluated(name, shipped, monkeypatch):
    problem = shipped[0]
    evaluate, seen = problem.evaluate, []

    def instrumented(designs, tasks=None):
        seen.extend(np.array(designs))
        return evaluate(designs, tasks)

    monkeypatch.setattr(problem, "evaluate", instrumented)
    searching = prepared(name, problem, shipped[2])
    seen.clear()
    session = Session(problem, shipped[1].tasks[0], budget=30)
    with pytest.raises(Spent):
        searching(session)
    assert session.count == len(seen) == 30
    np.testing.assert_array_equal(session.designs, seen)


@pytest.mark.parametrize("name", FAST)
def test_the_same_seed_repeats_every_design(name, shipped):
    one, other = (search(name, shipped, 0, budget=40, seed=7).designs for _ in range(2))
    np.testing.assert_array_equal(one, other)
    last = search(name, shipped, 0, budget=40, seed=8).designs
    assert not np.array_equal(one, last)


@pytest.mark.parametrize("name", FAST)
def test_each_stays_in_the_box_and_mostly_finds_feasible_designs(name, searched, shipped):
    problem = shipped[0]
    for session in searched(name):
        designs = session.designs
        assert len(designs) == BUDGET
        assert (designs >= problem.low).all()
        assert (designs <= problem.high).all()
    # Where one search is declared there are so many basins that some find nothing in so few.
    assert np.isfinite(reached(searched(name))) or problem.declared.searches == 1


@pytest.mark.parametrize("name", sorted({*FAST} - {"nsga2"}))
def test_a_search_beats_chance_at_equal_evaluations(name, searched):
    # NSGA-II's first generation alone is 50 random designs.
    chance = reached(searched("random"))
    assert reached(searched(name)) < chance or np.isinf(chance)


@pytest.mark.slow
def test_a_gaussian_process_searches_within_its_budget(shipped):
    found = find_method("gp")
    assert (found.evaluations, found.tasks) == (40, 16)
    one = search("gp", shipped, 0, budget=25)
    assert one.count == 25
    chance = [search("random", shipped, 0, budget=25, seed=seed) for seed in range(21)]
    lowest = np.median([run.log_merit[run.feasible].min(initial=np.inf) for run in chance])
    assert one.log_merit[one.feasible].min(initial=np.inf) < lowest or np.isinf(lowest)
    np.testing.assert_array_equal(one.designs[:14], search("gp", shipped, 0, budget=14).designs)


def test_tpe_tries_the_optima_of_the_nearest_tasks_first(searched, shipped):
    problem, asked, pool = shipped
    nearest = KnownOptima(View.of(problem), Training(problem, pool)).nearest(
        asked.tasks[0], opponents.ENQUEUED
    )
    first = searched("neighbours+tpe")[0].designs[: opponents.ENQUEUED]
    np.testing.assert_allclose(first, nearest, rtol=1e-14)


def test_cmaes_begins_around_the_optima_of_the_nearest_tasks(searched, shipped):
    problem, asked, pool = shipped
    nearest = KnownOptima(View.of(problem), Training(problem, pool)).nearest(
        asked.tasks[0], opponents.STARTED_AT
    )
    offsets = searched("neighbours+cmaes")[0].designs[:6] - nearest.mean(axis=0)
    assert np.abs(offsets / (problem.high - problem.low)).max() < 5.0 * opponents.SIGMA


def test_any_sampler_competes(shipped):
    problem, asked, _ = shipped
    session = Session(problem, asked.tasks[0], budget=12)
    with pytest.raises(Spent):
        sampler_search(
            lambda seed: optuna.samplers.NSGAIISampler(
                seed=seed,
                population_size=4,
                mutation_prob=1.0,  # so that no design comes twice
            )
        )(session)
    assert len(np.unique(session.designs, axis=0)) == 12


def test_a_sampler_is_told_values_and_constraints(shipped):
    problem, asked, _ = shipped
    told = []

    class Listening(optuna.samplers.RandomSampler):
        def after_trial(self, _study, trial, _state, values):
            told.append((list(trial.params.values()), trial.constraints, values))

    session = Session(problem, asked.tasks[0], budget=60)
    with pytest.raises(Spent):
        sampler_search(lambda seed: Listening(seed=seed))(session)
    assert len(told) == 60
    for i, (design, constraints, (value,)) in enumerate(told):
        np.testing.assert_allclose(design, session.designs[i], rtol=1e-14)
        assert list(constraints.values()) == session.constraints[i].tolist()
        if session.feasible[i]:
            assert value == session.values[i]


def test_nothing_is_logged_and_the_level_stays(shipped, capfd):
    before = optuna.logging.get_verbosity()
    search("tpe", shipped, 0, budget=5)
    assert optuna.logging.get_verbosity() == before
    assert capfd.readouterr() == ("", "")
