"""What Optuna is told of a design."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.declaration import Objective
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.trial import attribute_name, told_objective, trial_attributes, trial_values
from pkm_gym.core.units import converted, show


class Trial:
    """Suggests the given values and keeps what it is told."""

    def __init__(self, values: dict[str, float]) -> None:
        self.values = values
        self.ranges: dict[str, tuple[float, float]] = {}
        self.constraints: dict[str, float] = {}
        self.attributes: dict[str, Any] = {}

    def suggest_float(self, name: str, low: float, high: float) -> float:
        self.ranges[name] = (low, high)
        return self.values[name]

    def set_constraint(self, name: str, value: float) -> None:
        self.constraints[name] = value

    def set_user_attr(self, name: str, value: Any) -> None:
        self.attributes[name] = value


@pytest.mark.parametrize("objective", ["tau_G", ("tau_peak", "condition", "tau_rms")])
def test_every_infeasible_design_is_worse_than_every_feasible_one(
    objective: Any, rng: np.random.Generator
) -> None:
    problem = pkm_gym.make_problem("diamond", objective=objective)
    designs = problem.low - 0.5 + (problem.high - problem.low + 1.0) * rng.random((20000, 3))
    designs[:3] = [[np.nan] * 3, [np.inf] * 3, [-1.0] * 3]
    evaluation = problem.evaluate(designs, problem.draw_tasks(len(designs), rng))
    values, feasible = trial_values(evaluation), evaluation.feasible
    assert feasible.any()
    assert np.isfinite(values).all()
    np.testing.assert_array_equal(values[feasible], evaluation.objectives[feasible])
    assert (values[~feasible].min(axis=0) > values[feasible].max(axis=0)).all()


def test_a_smaller_violation_is_a_better_value() -> None:
    problem = pkm_gym.make_problem("diamond")
    start, end = problem.printed_design(), np.array([0.6, 2.56, 0.75])
    steps = np.linspace(0.2, 1.0, 50)[:, None]
    evaluation = problem.evaluate(start + steps * (end - start))
    assert not evaluation.feasible.any()
    assert (np.diff(trial_values(evaluation)[:, 0]) > 0.0).all()


@pytest.mark.parametrize("objective", ["tau_G", "tau_peak", "tau_rms", "condition"])
def test_no_feasible_design_reaches_the_worst_value(
    objective: str, rng: np.random.Generator
) -> None:
    problem = pkm_gym.make_problem("diamond", objective=objective, cycle_samples=101)
    extremes = {
        "b": 2.0, "delta": 0.5, "payload": 10.0, "sigma_low": 0.2, "sigma_high": 3.0,
        "lam_e_min": 0.0, "cycle_time_ratio": 0.5, "overlap": 0.0,
    }  # fmt: skip
    designs = problem.low + (problem.high - problem.low) * rng.random((20000, 3))
    evaluation = problem.evaluate(designs, problem.task_type.of(extremes))
    values = evaluation.objectives[evaluation.feasible, 0]
    assert len(values) > 1000
    assert values.max() < problem.objectives[0].worst


def test_a_trial_gets_its_value_constraints_and_attributes(
    problem: DesignProblem, design: np.ndarray
) -> None:
    trial = Trial(problem.named(design))
    value = problem.objective_for(None)(trial)
    evaluation = problem.evaluate(design[None])
    assert value == evaluation.objectives[0, 0]
    assert isinstance(value, float)
    assert list(trial.constraints) == list(problem.constraint_names)
    assert list(trial.constraints.values()) == list(evaluation.constraints[0])
    assert trial.attributes == trial_attributes(evaluation, 0)
    assert trial.ranges == {v.name: (v.low, v.high) for v in problem.variables}
    plain = (float, bool, str)
    assert all(type(v) in plain for v in (*trial.constraints.values(), *trial.attributes.values()))


def test_a_trial_is_evaluated_for_the_given_task() -> None:
    problem = pkm_gym.make_problem("diamond", objective=("tau_G", "condition"))
    trial = Trial(problem.named(problem.printed_design()))
    values = problem.objective_for({"payload": 1.0})(trial)
    expected = problem.evaluate(problem.printed_design()[None], {"payload": 1.0})  # type: ignore[arg-type]  # a mapping is a task
    assert values == tuple(expected.objectives[0])


def test_attributes_leave_undefined_indices_out(problem: DesignProblem) -> None:
    evaluation = problem.evaluate(np.full((1, len(problem.low)), np.nan))
    attributes = trial_attributes(evaluation, 0)
    assert set(attributes) - {"design"} == {"feasible", "log_merit"}
    assert attributes["feasible"] is False


def test_attributes_are_named_with_the_units_that_people_read(
    problem: DesignProblem, design: np.ndarray
) -> None:
    evaluation = problem.evaluate(design[None])
    attributes = trial_attributes(evaluation, 0)
    for name, values in evaluation.indices.items():
        value, unit = converted(float(values[0]), problem.unit(name))
        if np.isfinite(value):
            assert attributes[f"{name} [{unit}]" if unit else name] == value
    assert not any("[m]" in name or "[rad]" in name for name in attributes)
    for v, x in zip(problem.variables, design.tolist(), strict=True):
        if "design" in attributes:
            assert f"{v.name} = {show(x, v.unit)}" in attributes["design"]
        else:
            assert not v.unit


@pytest.mark.parametrize("unit", ["", "N m", "m", "rad"])
def test_an_objective_is_told_back_in_si(unit: str) -> None:
    objective = Objective("size", "minimise", unit=unit, worst=9.0)
    value, read = converted(0.37, unit)
    assert told_objective({attribute_name("size", unit): value}, objective) == pytest.approx(0.37)
    assert (f"[{read}]" in attribute_name("size", unit)) == bool(unit)
    assert np.isnan(told_objective({}, objective))  # type: ignore[arg-type]  # NaN, not None
    older = told_objective({"size": 0.37}, objective)
    assert older is None if unit else older == 0.37
