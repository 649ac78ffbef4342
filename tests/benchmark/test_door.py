"""The door: what a method sees holds nothing that evaluates, and what goes past it is seen."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

from pkm_gym.benchmark import Session, Training, load_split, run, setting
from pkm_gym.benchmark.standings import ranked, standings
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.tally import TALLY

PAST = {
    "solving the task": """
def search(session):
    problem = family_problem(session.view.problem)
    problem.evaluate(view.low[None], session.task[None])
    session.evaluate(view.low)
""",
    "a counter set back": """
def search(session):
    session.evaluate(np.array([view.low, view.high]))
    session._count = 0
    session.evaluate(view.high)
""",
}
WHOLE = "@method()\ndef mine(view, training):\n{}\n    return search\n"


@pytest.fixture
def training(shipped) -> Training:
    problem, _ = shipped
    return Training(problem, load_split(problem.name, "train")[1].first(50))


def logged(problem, name, **arguments):
    return run(setting(problem.name, "val", f"{name}:mine", evaluations=12, **arguments), [0, 1])


def test_what_is_handed_over_holds_numbers_and_names(shipped):
    problem, split = shipped
    session = Session(problem, split.tasks[0], budget=2)
    told = session.evaluate(split.designs[0])
    for thing in (session.view, told):
        for item in fields(thing):
            value = getattr(thing, item.name)
            assert not callable(value)
            assert not isinstance(value, DesignProblem)
    public = [getattr(session, name) for name in dir(session) if not name.startswith("_")]
    assert not any(isinstance(value, DesignProblem) for value in public)


@pytest.mark.parametrize("name", ["count", "budget", "designs", "values"])
def test_what_is_counted_can_not_be_set(shipped, name):
    problem, split = shipped
    with pytest.raises(AttributeError):
        setattr(Session(problem, split.tasks[0], budget=2), name, 0)


def test_what_is_handed_over_can_not_be_written_to(shipped, training):
    problem, split = shipped
    session = Session(problem, split.tasks[0], budget=2, start=split.starts[0])
    view = session.view
    for array in (session.task, session.start, view.low, view.high, training.tasks):
        with pytest.raises(ValueError, match="read-only"):
            array[:] = 0.0


def test_training_tasks_are_evaluated_as_the_problem_does_and_counted(shipped, training):
    problem, _ = shipped
    rows, field = [3, 3, 7], next(v for v in problem.task_variables if v.drawn)
    told = training.evaluate(training.designs[rows], rows)
    exact = problem.evaluate(training.designs[rows], training.tasks[rows])
    np.testing.assert_array_equal(told.constraints, exact.constraints)
    np.testing.assert_array_equal(told.values, exact.objectives[:, 0])
    tasks = training.tasks[rows].copy()
    tasks[:, [v.name for v in problem.task_variables].index(field.name)] = field.low
    changed = training.evaluate(training.designs[rows], rows, {field.name: field.low})
    exact = problem.evaluate(training.designs[rows], tasks)
    np.testing.assert_array_equal(changed.constraints, exact.constraints)
    assert training.count == 6


@pytest.mark.parametrize(
    ("rows", "changed", "sentence"),
    [
        ([50], {}, "rows must be whole numbers from 0 to 49"),
        ([-1], {}, "rows must be whole numbers from 0 to 49"),
        ([0.5], {}, "rows must be whole numbers from 0 to 49"),
        ([1, 2], {}, "rows must be whole numbers from 0 to 49, one a design"),
        ([1], {"nothing": 1.0}, "unknown task field 'nothing'"),
    ],
)
def test_training_tasks_are_asked_for_properly(training, rows, changed, sentence):
    with pytest.raises(ValueError, match=sentence):
        training.evaluate(training.designs[:1], rows, changed)
    assert training.count == 0


def test_in_a_session_the_fields_of_training_tasks_stay_as_they_are(shipped, training):
    name = shipped[0].task_variables[0].name
    training.close()
    training.evaluate(training.designs[:1], [0])
    with pytest.raises(ValueError, match=f"fields \\({name}\\) can be changed while a method"):
        training.evaluate(training.designs[:1], [0], {name: 1.0})


@pytest.mark.parametrize("how", PAST)
def test_what_goes_past_the_door_is_not_ranked(shipped, own_methods, how):
    problem, _ = shipped
    body = PAST[how].replace("\n", "\n    ")
    log = logged(problem, own_methods(WHOLE.format(body)))
    assert (log.outside > 0).all()
    assert not ranked(standings([log]))


@pytest.mark.parametrize("place", ["import", "prepare"])
def test_what_is_evaluated_before_the_first_task_is_seen_too(shipped, own_methods, place):
    problem, _ = shipped
    line = f"p = family_problem({problem.name!r}); p.evaluate(p.low[None])\n"
    inner = "    " + line if place == "prepare" else ""
    head = line if place == "import" else ""
    search = f"{inner}    search = lambda session: session.evaluate(view.low)"
    log = logged(problem, own_methods(head + WHOLE.format(search)))
    assert log.outside.tolist() == [1, 1]


def test_what_is_learned_is_a_cost_before_the_first_task_or_of_each(shipped, own_methods):
    problem, _ = shipped
    name = own_methods("""
        @method(knowledge="transfer")
        def mine(view, training):
            training.evaluate(training.designs[:5], range(5))

            def search(session):
                training.evaluate(training.designs[:2], [0, 1])
                session.evaluate(training.designs[:3])

            return search
    """)
    log = logged(problem, name, pool=10)
    assert log.preparation.evaluations == 5
    assert log.learned.tolist() == [2, 2]
    assert log.outside.tolist() == [0, 0]
    (entry,) = standings([log])
    assert entry.cost.evaluations == entry.pool.evaluations + 5
    assert entry.learned == 2.0


@pytest.mark.parametrize("place", ["import", "prepare", "search"])
def test_a_method_loads_no_split_itself(shipped, own_methods, place):
    problem, _ = shipped
    line = f"load_split({problem.name!r}, 'train')"
    lines = {name: line if name == place else "0" for name in ("import", "prepare", "search")}
    name = own_methods(f"""
        {lines["import"]}

        @method()
        def mine(view, training):
            {lines["prepare"]}
            return lambda session: {lines["search"]}
    """)
    with pytest.raises(ValueError, match=f"{name}:mine loads the split train itself"):
        logged(problem, name)
    load_split(problem.name, "train")


def test_the_tally_counts_every_design(shipped):
    problem, split = shipped
    before = TALLY.designs
    problem.evaluate(split.designs[:7], split.tasks[:7])
    assert TALLY.designs - before == 7
    problem.pieces(split.designs[:7], split.tasks[:7])
    assert TALLY.designs - before == 14
