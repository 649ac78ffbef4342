"""The numbers that the 6-PUS's paper prints: what is said to become of them does."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6 import influence, lattice
from pkm_gym.mechanisms.pus6.atlas import Atlas, lattice_atlas
from pkm_gym.mechanisms.pus6.claims import spread
from pkm_gym.mechanisms.pus6.kinematics import PER_LEG
from pkm_gym.mechanisms.pus6.mechanism import NAMES

Numbers = dict[str, float]
R = np.arange(10, 21)  # cm, of the grid


@pytest.fixture(scope="module")
def problem() -> DesignProblem:
    return pkm_gym.make_problem("pus6")


@pytest.fixture(scope="module")
def atlas() -> Atlas:
    return lattice_atlas()


# Numbers ------------------------------------------------------------------------------------------


def choice(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del problem
    return dict(zip(("L", "R"), atlas.designs[atlas.balanced.argmax()].tolist(), strict=False))


def maxmin(problem: DesignProblem, atlas: Atlas) -> Numbers:
    printed = np.isclose(atlas.designs[:, :2], problem.printed_design()).all(axis=1)
    return {"max_min": float(atlas.balanced[printed][0])}


def design(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del atlas
    return problem.named(problem.printed_design())


def azimuth(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del atlas
    machine: Any = problem.mechanism(problem.printed_design())
    legs = machine.layout.reshape(6, PER_LEG)
    joints, screws = (np.arctan2(xy[:, 1], xy[:, 0]) for xy in (legs[:, :2], legs[:, 3:]))
    named = {f"phi_P{k}": float(angle) for k, angle in enumerate(joints % (2.0 * np.pi), 1)}
    return named | {f"phi_B{k}": float(x) for k, x in enumerate(screws % (2.0 * np.pi), 1)}


def grid(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del atlas
    designs, numbers = problem.grid(), {}
    assert designs is not None
    for name, column in zip(("L", "R"), designs.T, strict=True):
        levels = np.unique(column)
        numbers |= {f"{name}_low": levels[0], f"{name}_high": levels[-1]}
        numbers |= {f"{name}_step": step_of(levels)}
    return numbers | {"designs": float(len(designs))}


def steps(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del problem, atlas
    return {
        "step": step_of(lattice.X, lattice.Y, lattice.Z),
        "step_angle": step_of(lattice.ALPHA, lattice.BETA, lattice.GAMMA),
    }


def step_of(*axes: Sequence[float] | FloatArray) -> float:
    """The step that all of these have."""
    steps = np.concatenate([np.diff(axis) for axis in axes])
    assert np.ptp(steps) < 1e-12
    return float(steps[0])


def error(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del problem, atlas
    return {"a": influence.A, "b": influence.B, "input_error": influence.A}


def largest(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del problem
    return {"eta_alpha_largest": float(atlas["eta_alpha"].max())}


def total(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del problem
    return {"poses": float(atlas.poses.sum())}


def index(problem: DesignProblem, atlas: Atlas) -> Numbers:
    del atlas
    found = problem.evaluate(problem.printed_design()[None]).indices
    return {name: float(values[0]) for name, values in found.items()}


KINDS: dict[str, Callable[[DesignProblem, Atlas], Numbers]] = {
    "choice": choice, "maxmin": maxmin, "design": design, "azimuth": azimuth, "grid": grid,
    "lattice": steps, "error": error, "largest": largest, "total": total, "index": index,
}  # fmt: skip


def test_each_kind_of_number_is_computed(problem: DesignProblem) -> None:
    assert {value.kind for value in problem.reference.values.values()} == set(KINDS)


@pytest.mark.parametrize("kind", KINDS)
def test_numbers_are_what_the_reference_says(
    problem: DesignProblem, atlas: Atlas, kind: str
) -> None:
    ours = KINDS[kind](problem, atlas)
    for value in problem.reference.values.values():
        if value.kind == kind:
            assert ours[value.name] == pytest.approx(value.ours, rel=value.tolerance), value.name


def error_of(verdict: str) -> float:
    """How far off a verdict says that a number may be."""
    within = re.search(r"within ([\d.]+) %", verdict)
    return 0.01 * float(within[1]) if within else 0.0


def test_each_number_is_as_near_as_its_verdict_says(problem: DesignProblem) -> None:
    for value in problem.reference.values.values():
        if value.printed is not None:
            most = error_of(value.verdict)
            if "half degree" in value.verdict:
                most = np.radians(0.5) / value.printed
            assert abs(value.ours / value.printed - 1.0) <= most + 1e-12, value.name


def test_table_1_is_as_near_as_its_verdict_says(problem: DesignProblem, atlas: Atlas) -> None:
    table = problem.reference.data["table1"]
    ours = np.array(table["ours"])
    np.testing.assert_array_equal(ours.ravel(), atlas.poses)
    worst = np.abs(ours / np.array(table["counts"]) - 1.0).max()
    assert error_of(table["verdict"]) - 1e-3 < worst < error_of(table["verdict"])


def test_table_2_is_as_near_as_its_verdicts_say(problem: DesignProblem, atlas: Atlas) -> None:
    table = problem.reference.data["table2"]
    printed, ours = np.array(table["rows"]), np.array(table["ours"])
    at = (11 * (printed[:, 0] - 45) + printed[:, 1] - 10).astype(int)
    np.testing.assert_array_equal(ours[:, :2], printed[:, :2])
    np.testing.assert_array_equal(ours[:, 2], atlas.poses[at])
    np.testing.assert_allclose(ours[:, 3:], atlas.means[at], rtol=1e-6)
    assert table["columns"][3:] == list(NAMES)
    worst = np.abs(ours / printed - 1.0).max(axis=0)
    for off, verdict in zip(worst[2:], table["verdicts"][2:], strict=True):
        assert error_of(verdict) - 1e-3 < off < error_of(verdict)


# Statements ---------------------------------------------------------------------------------------


def ranks(atlas: Atlas, name: str, lengths: range, radii: range) -> list[int]:
    """The ranks from 1 among the 121 designs of those of L and R in cm."""
    values = atlas[name].reshape(11, 11)
    return sorted(1 + int((values > values[i - 45, j - 10]).sum()) for i in lengths for j in radii)


def test_how_the_designs_rank_that_the_text_names(atlas: Atlas) -> None:
    assert ranks(atlas, "eta_v", range(45, 49), range(19, 20)) == [4, 6, 8, 11]
    for name, lengths, radii, last in (
        ("eta_alpha", range(45, 48), range(16, 21), 24),
        ("eta_a", range(45, 49), range(19, 21), 12),
        ("eta_I", range(45, 49), range(19, 21), 11),
    ):
        found = ranks(atlas, name, lengths, radii)
        assert (found[0], found[-1]) == (1, last), name
    assert ranks(atlas, "eta_F", range(46, 47), range(19, 20)) == [82]


def test_how_much_the_indices_depend_on_the_length(atlas: Atlas) -> None:
    omega, force = (spread(atlas[name].reshape(11, 11)) for name in ("eta_omega", "eta_F"))
    assert omega[[0, 10]] == pytest.approx([0.14, 0.02], abs=5e-4)
    assert force[[0, 3]] == pytest.approx([0.024, 0.073], abs=5e-4)
    assert R[omega < 0.05].tolist() == [15, 16, 17, 18, 19, 20]
    assert R[force < 0.05].tolist() == [10, 11]
    assert (np.diff(atlas["eta_I"].reshape(11, 11), axis=0) < 0.0).all()


def test_in_decimetres_the_printed_design_is_the_max_min_of_all_six(problem: DesignProblem) -> None:
    decimetres = lattice_atlas(characteristic_length=0.1)
    least = decimetres.normalised.min(axis=1)
    np.testing.assert_allclose(decimetres.designs[least.argmax(), :2], problem.printed_design())
    assert least.max() == pytest.approx(0.858, abs=5e-4)
