"""The numbers that the leg's paper prints: what is said to become of them does."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms.stroke_leg.indices import tolerance_weights
from pkm_gym.mechanisms.stroke_leg.step import Step

NARROW = {"swing": np.radians(15.0)}  # theta + varphi over 90 deg
RANGED = ("eta_P", "eta_FC", "eta_DL")
Numbers = dict[str, float]


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return pkm_gym.make_problem("stroke_leg")


def optimum(problem: DesignProblem) -> Numbers:
    return dict(problem.reference.optima["dexterity"].design)


def index(problem: DesignProblem) -> Numbers:
    found = problem.evaluate(problem.printed_design()[None]).indices
    return {name: float(values[0]) for name, values in found.items()}


def window(problem: DesignProblem) -> Numbers:
    narrow = index(pkm_gym.make_problem(problem.name, task=NARROW))
    return {f"{name}_90": value for name, value in narrow.items()}


def crown(problem: DesignProblem) -> Numbers:
    outline = problem.mechanism(problem.printed_design()).workspace()
    x, z = np.ptp(outline, axis=0)
    return {"extent_x": x, "extent_z": z, "height": -outline[:, 1].min()}


def sweep(problem: DesignProblem) -> Numbers:
    narrow = pkm_gym.make_problem(problem.name, task=NARROW)
    rows = []
    for k, v in enumerate(narrow.variables):
        values = np.arange(v.low, v.high + 0.5 * v.step, v.step)
        rows.append(np.repeat(narrow.printed_design()[None], len(values), axis=0))
        rows[-1][:, k] = values
    found = narrow.evaluate(np.concatenate(rows)).indices
    least = {f"{name}_least": float(np.nanmin(found[name])) for name in RANGED}
    return least | {f"{name}_largest": float(np.nanmax(found[name])) for name in RANGED}


def weight(problem: DesignProblem) -> Numbers:
    ranges = tuple(
        (problem.reference[f"{name}_least"].printed, problem.reference[f"{name}_largest"].printed)
        for name in RANGED
    )
    return dict(zip(("mu1", "mu2", "mu3"), tolerance_weights(ranges), strict=True))


def task(problem: DesignProblem) -> Numbers:
    return {field.name: field.default for field in problem.task_variables}


def bound(problem: DesignProblem) -> Numbers:
    low = {f"{v.name}_low": v.low for v in problem.variables}
    return low | {f"{v.name}_high": v.high for v in problem.variables}


def sample(problem: DesignProblem) -> Numbers:
    del problem
    return {"duration": Step().period}


KINDS = (optimum, index, window, crown, sweep, weight, task, bound, sample)


def test_each_kind_of_number_is_computed(problem: DesignProblem) -> None:
    kinds = {value.kind for value in problem.reference.values.values()}
    assert kinds == {kind.__name__ for kind in KINDS}


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_numbers_are_what_the_reference_says(
    problem: DesignProblem, kind: Callable[[DesignProblem], Numbers]
) -> None:
    ours = kind(problem)
    for value in problem.reference.values.values():
        if value.kind == kind.__name__:
            assert ours[value.name] == pytest.approx(value.ours, rel=value.tolerance), value.name


def test_what_is_reproduced_is_near_what_is_printed(problem: DesignProblem) -> None:
    for value in problem.reference.values.values():
        if value.printed is not None:
            near = abs(value.ours / value.printed - 1.0) < 4e-3
            said = value.verdict.startswith("reproduced")
            assert near == said or value.name in ("th3", "height"), value.name


def test_the_printed_design_is_infeasible_as_printed(problem: DesignProblem) -> None:
    evaluation = problem.evaluate(problem.printed_design()[None])
    assert not evaluation.feasible[0]
    assert np.isnan(evaluation.indices["eta_P"][0])
