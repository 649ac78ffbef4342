"""The task model: what depends on which field, how well it tells a new task, what it finds."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest

from pkm_gym.benchmark import Session, Spent, Told, Training, View, load_split
from pkm_gym.benchmark.task_model import Outputs, TaskModel, task_model


@pytest.fixture(scope="module")
def known():
    """The 3-SPR, its val split and its training tasks."""
    problem, split = load_split("spr3", "val")
    return problem, split, Training(problem, load_split("spr3", "train")[1])


@pytest.fixture(scope="module")
def outputs(known) -> Outputs:
    return Outputs(View.of(known[0]), known[2])


def exact(outputs, known, row, designs):
    problem, split, _ = known
    return outputs.of(Told.of(problem.evaluate(designs, split.tasks[row][None])))


def test_a_limit_reacts_to_its_own_field(outputs, known):
    problem, _, _ = known
    drawn = [v.name for v in problem.task_variables if v.drawn]
    names = ["objective", *problem.constraint_names]
    pairs = zip(names, outputs.reacts, strict=True)
    reacts = {name: set(np.array(drawn)[kind]) for name, kind in pairs}
    assert "volume_min" in reacts["volume"]
    assert all("volume_min" not in fields for name, fields in reacts.items() if name != "volume")


def test_a_new_task_is_told_by_its_neighbours_and_corrected_by_what_is_evaluated(outputs, known):
    problem, split, _ = known
    span = problem.high - problem.low
    errors = []
    for row in np.flatnonzero(split.solvable)[:4].tolist():
        model, place = (
            TaskModel(outputs, split.tasks[row]),
            (split.designs[row] - problem.low) / span,
        )
        true = exact(outputs, known, row, split.designs[row][None])[0]
        errors.append(np.abs(model(place[None])[0] - true).max())
        model.correct(place, true)
        np.testing.assert_allclose(model(place[None])[0], true, atol=1e-9)
        beside = np.clip(place + 1e-3, 0.0, 1.0)
        other = exact(outputs, known, row, (problem.low + span * beside)[None])[0]
        model.correct(beside, other)
        np.testing.assert_allclose(model(np.array([place, beside])), [true, other], atol=1e-9)
    assert np.median(errors) < 1e-3


def test_it_finds_the_optimum_within_a_few_evaluations(known):
    problem, split, training = known
    search = task_model.prepare(View.of(problem), training)
    regrets = []
    for row in np.flatnonzero(split.solvable)[:3].tolist():
        session = Session(problem, split.tasks[row], budget=6)
        with suppress(Spent):
            search(session)
        optimum = problem.evaluate(split.designs[row][None], split.tasks[row][None]).log_merit[0]
        regrets.append(session.log_merit[session.feasible].min(initial=np.inf) - optimum)
    assert np.median(regrets) < 1e-4
