"""What merit must know of a problem: measured, against what is declared and what is known."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import declaration
from pkm_gym.studies.search.calibrating import Calibration, calibrate
from pkm_gym.studies.search.polish import verified_optimum
from pkm_gym.studies.verbs.calibrate import keep


def far_and_near(problem: DesignProblem, n: int) -> FloatArray:
    """Return n random designs, and n that draw near the verified optimum."""
    generator = np.random.default_rng(2)
    far = generator.uniform(problem.low, problem.high, (n, len(problem.low)))
    optimum = verified_optimum(problem)
    assert optimum is not None
    best = problem.design(optimum.design)
    return np.concatenate([far, best + 10.0 ** generator.uniform(-4.0, 0.0, (n, 1)) * (far - best)])


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if declaration(name).starts else [])
        for name in pkm_gym.problems()
    ],
)
def test_what_is_declared_is_what_is_measured(name: str) -> None:
    problem = pkm_gym.make_problem(name, **declaration(name).coarse)
    declared = problem.objectives[0]
    measured = calibrate(problem, 6 if problem.declared.searches > 1 else 3, seed=1)
    assert measured.objective == declared.name
    assert 0.0 < measured.multiplier < problem.declared.penalty_weight
    evaluation = problem.evaluate(far_and_near(problem, 20_000))
    values = evaluation.objectives[evaluation.feasible, 0]
    assert len(values) > 1000
    for worst in (declared.worst, measured.worst):
        assert (declared.sign * (worst - values) > 0.0).all()
    merits = np.array(measured.extremes)
    assert (merits > 0.0).all()
    assert merits[0] <= 1.0 <= merits[1]  # 1 at the default task's optimum


def known(**values: float) -> Calibration:
    """A calibration of an index "size"."""
    said = {"scale": 0.7, "worst": 4.0, "multiplier": 1.26} | values
    return Calibration(
        objective="size", powers={"b": 0.9}, rates={"payload": 0.1}, within=1.0,
        extremes=(0.9, 1.1), tasks=8, solvable=8, **said,
    )  # fmt: skip


def test_the_weight_exceeds_the_multiplier_by_far_in_two_digits() -> None:
    assert known().penalty_weight == 2.6
    assert known(multiplier=51.2).penalty_weight == 110.0
    assert known(multiplier=0.0).penalty_weight == 1.0


def test_what_is_kept_of_other_problems_stays(tmp_path: Path) -> None:
    file = tmp_path / "calibration.toml"
    keep(file, "one", [known()], "pkm-gym calibrate one")
    keep(file, "two", [known(scale=3.0), known(multiplier=5.0)], "pkm-gym calibrate two")
    keep(file, "two", [known(scale=2.0)], "pkm-gym calibrate two -n 8")
    content = tomllib.loads(file.read_text())
    assert content["one"]["objectives"]["size"] == {
        "worst": 4.0, "scale": 0.7, "powers": {"b": 0.9}, "rates": {"payload": 0.1},
    }  # fmt: skip
    assert content["two"]["objectives"]["size"]["scale"] == 2.0
    assert content["two"]["penalty_weight"] == 2.6
    assert content["two"]["command"] == "pkm-gym calibrate two -n 8"


def test_a_file_that_is_no_toml_stays_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "calibration.toml"
    file.write_text("mine = ", encoding="utf-8")
    with pytest.raises(ValueError, match="is no TOML"):
        keep(file, "one", [known()], "pkm-gym calibrate one")
    assert file.read_text() == "mine = "
