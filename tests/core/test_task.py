"""Variables, tasks and options: what they accept, what they refuse, and the packed row."""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import Task, quantity


@dataclasses.dataclass(frozen=True)
class Lifting(Task):
    mass: float = quantity(1.0, "kg", "what is lifted", legal=(0.0, 10.0), family=(0.5, 2.0))
    height: float = quantity(0.3, "m", "how far", legal=(0.1, 1.0))


def test_defaults_are_the_papers_task() -> None:
    assert Lifting.of(None) == Lifting() == Lifting.of({})
    assert Lifting.of({"mass": 2}) == Lifting(mass=2.0) == Lifting().replace(mass=2.0)
    assert Lifting.of(Lifting(height=0.5)).height == 0.5


def test_variables_carry_unit_ranges_and_default() -> None:
    mass, height = Lifting.variables()
    assert (mass.name, mass.unit, mass.default, mass.doc) == ("mass", "kg", 1.0, "what is lifted")
    assert (mass.low, mass.high, mass.legal_low, mass.legal_high) == (0.5, 2.0, 0.0, 10.0)
    assert mass.drawn
    assert (height.low, height.high) == (0.3, 0.3)
    assert not height.drawn


@pytest.mark.parametrize("value", [-0.1, 10.1, float("nan"), float("inf"), "1", None, True, [1.0]])
def test_an_illegal_value_is_refused_with_the_range(value: object) -> None:
    with pytest.raises(ValueError, match=r"task\.mass is .*must be a number from 0 to 10 kg"):
        Lifting(mass=value)  # type: ignore[arg-type]  # on purpose


@pytest.mark.parametrize("make", [Lifting.of, lambda fields: Lifting().replace(**fields)])
def test_an_unknown_field_is_answered_with_the_closest(make: object) -> None:
    with pytest.raises(ValueError, match=r"unknown task field 'heigth'; did you mean 'height'\?"):
        make({"heigth": 0.5})  # type: ignore[operator]  # either of two callables


@pytest.mark.parametrize("task", [3.0, "mass", [("mass", 1.0)]])
def test_what_is_no_task_is_refused(task: object) -> None:
    with pytest.raises(TypeError, match="must be a Lifting or a mapping"):
        Lifting.of(task)  # type: ignore[arg-type]  # on purpose


def test_a_task_cannot_be_changed() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        Lifting().mass = 2.0  # type: ignore[misc]  # on purpose


@given(mass=st.floats(0.0, 10.0), height=st.floats(0.1, 1.0))
def test_pack_and_unpack_are_inverse(mass: float, height: float) -> None:
    task = Lifting(mass=mass, height=height)
    np.testing.assert_array_equal(task.pack(), [mass, height])
    assert Lifting.unpack(task.pack()) == task
    assert pickle.loads(pickle.dumps(task)) == task


@given(st.lists(st.tuples(st.floats(-5.0, 15.0), st.floats(0.0, 1.5)), min_size=1, max_size=5))
def test_rows_are_checked_like_tasks(rows: list[tuple[float, float]]) -> None:
    legal = all(0.0 <= mass <= 10.0 and 0.1 <= height <= 1.0 for mass, height in rows)
    if legal:
        Lifting.check_rows(np.array(rows))
    else:
        with pytest.raises(ValueError, match=r"task row \d: (mass|height) is .*it must be from"):
            Lifting.check_rows(np.array(rows))


def test_a_row_with_nan_is_refused() -> None:
    with pytest.raises(ValueError, match="task row 1: height is"):
        Lifting.check_rows(np.array([[1.0, 0.3], [1.0, np.nan]]))


def test_family_draws_lie_in_its_range_and_repeat(problem: DesignProblem) -> None:
    tasks = problem.draw_tasks(500, np.random.default_rng(1))
    np.testing.assert_array_equal(tasks, problem.draw_tasks(500, np.random.default_rng(1)))
    for column, variable in zip(tasks.T, problem.task_variables, strict=True):
        assert variable.legal_low <= variable.low <= variable.default <= variable.legal_high
        assert (column >= variable.low).all()
        assert (column <= variable.high).all()
        share = (column.max() - column.min()) / ((variable.high - variable.low) or np.inf)
        assert share > 0.95 if variable.drawn else (column == variable.default).all()


def test_what_is_not_drawn_keeps_the_problems_value() -> None:
    problem = pkm_gym.make_problem("diamond", task={"overlap": 0.7})
    column = problem.task_type.names().index("overlap")
    assert (problem.draw_tasks(5, np.random.default_rng(0))[:, column] == 0.7).all()
