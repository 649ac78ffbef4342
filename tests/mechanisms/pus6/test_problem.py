"""Both design problems: means over the box, the printed design, sampling errors, hostile rows."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.merit import TOLERANCE
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms.pus6.indices import unit_poses
from pkm_gym.mechanisms.pus6.mechanism import NAMES

from .model import Model

PROBLEMS = ("pus6", "pus6_layout")
CREASED = ("eta_alpha", "eta_a")
FULL = ("L", "R", "r_B", "phi_A", "phi_C")
PRINTED = np.array([0.46, 0.19, 0.38, *np.radians([15.0, 30.0])])


def whole(name: str = "pus6", **arguments: Any) -> DesignProblem:
    return pkm_gym.make_problem(name, free="all", **arguments)


def designs_of(problem: DesignProblem, n: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return problem.low + (problem.high - problem.low) * rng.random((n, len(problem.low)))


# Means over the box -------------------------------------------------------------------------------


@pytest.mark.parametrize("convention", ["influence", "symmetric"])
@pytest.mark.parametrize("name", PROBLEMS)
def test_indices_are_means_over_the_half_box(name: str, convention: str) -> None:
    problem = whole(name, sampling="coarse", convention=convention)
    unit = unit_poses(512)
    assert unit[:, 0].min() >= 0.0
    rng = np.random.default_rng(1)
    designs, tasks = designs_of(problem, 200, 1), problem.draw_tasks(200, rng)
    tasks[:, problem.task_type.names().index("characteristic_length")] = rng.uniform(
        0.005, 0.3, 200
    )
    found = problem.evaluate(designs, tasks)
    default = np.insert(unit * [0.05, 0.05, *np.radians([10.0] * 3)], 2, 0.0, axis=1)
    for i in np.flatnonzero(found.indices["aspect"] > 0.3)[:8]:
        task: Any = found.task(i)
        L, R, r_B, phi_A, phi_C = designs[i].tolist()
        model = Model(L, R, r_B, *np.degrees([phi_A, phi_C]).tolist(), tool=task.tool)
        half = [task.xy, task.xy, task.tilt, task.tilt, task.spin]
        poses, length = np.insert(unit * half, 2, 0.0, axis=1), task.characteristic_length
        means, printed = (
            {name: values.mean() for name, values in m.local(p, length, convention).items()}
            for m, p in ((model, poses), (Model(0.46, 0.19), default))
        )
        for name_, mean in means.items():
            assert found.indices[name_][i] == pytest.approx(mean, rel=1e-8), name_
        ratios = {name: means[name] / printed[name] for name in NAMES}
        four = [ratios[name] for name in ("eta_omega", "eta_v", "eta_a", "eta_I")]
        assert found.indices["balanced"][i] == pytest.approx(np.prod(four) ** 0.25, rel=1e-8)
        five = np.prod([*four, ratios["eta_alpha"]]) ** 0.2
        assert found.indices["balanced5"][i] == pytest.approx(five, rel=1e-8)


def test_the_half_box_stands_for_the_whole_one() -> None:
    unit = np.insert(unit_poses(256), 2, 0.0, axis=1) * [0.05, 0.05, 0, *np.radians([10.0] * 3)]
    signs, model = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0]), Model(0.42, 0.13)
    one, other = model.local(unit), model.local(unit * signs)
    for name in NAMES:
        np.testing.assert_allclose(one[name], other[name], rtol=1e-9, atol=1e-11)


@pytest.mark.parametrize(
    "options",
    [
        {}, {"convention": "symmetric"}, {"sampling": "coarse"},
        {"task": {"characteristic_length": 0.1}},
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", PROBLEMS)
def test_the_printed_design_is_one_exactly(name: str, options: dict[str, Any]) -> None:
    indices = whole(name, **options).evaluate(PRINTED[None]).indices
    assert indices["balanced"][0] == 1.0
    assert indices["balanced5"][0] == 1.0


def test_the_printed_design_over_many_poses() -> None:
    evaluation = pkm_gym.make_problem("pus6", sampling="fine").evaluate(np.array([[0.46, 0.19]]))
    found = {name: values[0] for name, values in evaluation.indices.items()}
    known = {"eta_omega": 0.3298, "eta_v": 0.2508, "eta_alpha": 0.0991, "eta_a": 0.4973}
    for name, value in (known | {"eta_I": 0.6912}).items():
        assert found[name] == pytest.approx(value, abs=1.5e-4), name
    assert evaluation.feasible[0]
    for name, value in (("stroke", 0.2878), ("clearance", 0.098), ("spacing", 0.0992)):
        assert found[name] == pytest.approx(value, abs=5e-4)
    assert np.degrees(found["rod_tilt"]) == pytest.approx(52.1, abs=0.05)
    assert np.degrees(found["s_cone"]) == pytest.approx(33.3, abs=0.05)


@pytest.fixture(scope="module")
def many() -> tuple[np.ndarray, Any]:
    """Designs of the box with their indices over 65,536 poses."""
    fine = pkm_gym.make_problem("pus6", sampling="fine")
    designs = designs_of(fine, 150, 7)
    return designs, fine.evaluate(designs).indices


@pytest.mark.parametrize(
    ("sampling", "worst", "rms", "others", "balanced"),
    [("coarse", 3e-2, 1.05e-2, 2e-4, 1e-2), ("default", 1.6e-2, 5.5e-3, 2.5e-5, 4e-3)],
)
def test_sampling_errors_are_as_documented(
    many: tuple[np.ndarray, Any],
    sampling: str,
    worst: float,
    rms: float,
    others: float,
    balanced: float,
) -> None:
    designs, exact = many
    found = pkm_gym.make_problem("pus6", sampling=sampling).evaluate(designs).indices
    missed = {name: found[name] / exact[name] - 1.0 for name in found if name in exact}
    for name in NAMES:
        most, mean = np.abs(missed[name]).max(), np.sqrt((missed[name] ** 2).mean())
        if name in CREASED:
            assert 0.5 * worst < most < worst, name
            assert 0.5 * rms < mean < rms, name
        else:
            assert most < others, name
    for name in ("balanced", "balanced5"):
        assert np.abs(missed[name]).max() < balanced, name


@pytest.mark.parametrize("name", PROBLEMS)
def test_only_the_stroke_depends_on_the_height_of_the_box(name: str) -> None:
    problem = pkm_gym.make_problem(name, sampling="coarse")
    designs = designs_of(problem, 20)
    low, high = (problem.evaluate(designs, problem.task.replace(z=z)) for z in (0.01, 0.06))
    for key, values in low.indices.items():
        moved = 0.1 if key == "stroke" else 0.0
        np.testing.assert_allclose(high.indices[key], values + moved, rtol=1e-13)


def test_spacing_is_the_distance_of_the_screws_of_a_column() -> None:
    problem = whole(sampling="coarse")
    designs = designs_of(problem, 30)
    found = problem.evaluate(designs)
    for i, (L, R, r_B, phi_A, phi_C) in enumerate(designs.tolist()):
        model = Model(L, R, r_B, *np.degrees([phi_A, phi_C]).tolist())
        near = [np.linalg.norm(model.screws[k] - model.screws[k + 1]) for k in (0, 2, 4)]
        np.testing.assert_allclose(found.indices["spacing"][i], near, rtol=1e-12)


def test_a_tool_is_measured_at_its_tip() -> None:
    problem = pkm_gym.make_problem("pus6_layout", task={"tool": 0.06}, sampling="coarse")
    machine: Any = problem.mechanism(problem.printed_design())
    assert machine.tool == 0.06
    centre = machine.points(np.array([0.01, 0.02, 0.0, 0.2, 0.1, 0.3]))["C"].mean(axis=0)
    axis = machine.rotation(np.array([0.0, 0.0, 0.0, 0.2, 0.1, 0.3]))[:, 2]
    np.testing.assert_allclose(centre, [0.01, 0.02, 0.0] + 0.06 * axis, atol=1e-15)
    short = pkm_gym.make_problem("pus6_layout", sampling="coarse")
    one, other = (p.evaluate(p.printed_design()[None]).indices for p in (short, problem))
    assert np.abs(other["eta_v"][0] / one["eta_v"][0] - 1.0) > 0.05
    assert np.abs(other["eta_omega"][0] / one["eta_omega"][0] - 1.0) > 1e-3  # other places


def test_maps_are_of_the_problems_convention_and_the_tasks_unit(rng: np.random.Generator) -> None:
    problem = pkm_gym.make_problem("pus6", convention="symmetric")
    task = problem.task.replace(characteristic_length=0.2)
    machine: Any = problem.mechanism(np.array([0.43, 0.15]), task)
    poses = rng.uniform(-0.05, 0.05, (20, 6))
    maps = problem.index_maps(machine, poses)
    expected = Model(0.43, 0.15).local(poses, 0.2, "symmetric")
    for name in NAMES:
        np.testing.assert_allclose(maps[name].values, expected[name], rtol=1e-8, atol=1e-10)


# What can't be had --------------------------------------------------------------------------------


def test_indices_are_defined_where_a_limit_is_merely_broken() -> None:
    problem = whole("pus6_layout", sampling="coarse")
    rng = np.random.default_rng(3)
    designs, tasks = designs_of(problem, 3000), problem.draw_tasks(3000, rng)
    found = problem.evaluate(designs, tasks)
    reached = found.quantity("reach") < 1.0
    assert 50 < (~reached).sum() < 2000
    for name, values in found.indices.items():
        assert np.isfinite(values[reached]).all(), name
        if name not in ("rod_tilt", "spacing"):
            assert np.isnan(values[~reached]).all(), name
    assert (
        (found.constraints[reached] > 0.0).any(axis=0)[2:].all()
    )  # each limit is broken somewhere
    assert np.isfinite(found.constraints).all()
    beyond = found.quantity("reach")[~reached] - 1.0
    np.testing.assert_allclose(found.unreached[~reached], beyond, rtol=0.0, atol=2e-9)


@pytest.mark.parametrize(
    ("phi_A", "phi_C"), [(60.0, 60.0), (15.0, 105.0), (4.0, 116.0), (90.0, 30.0)]
)
def test_legs_that_are_radial_at_home_make_it_singular(phi_A: float, phi_C: float) -> None:
    problem = whole(sampling="coarse")
    design = PRINTED.copy()
    design[3:] = np.radians([phi_A, phi_C])
    home = np.zeros((1, 6))
    assert abs(np.linalg.det(Model(0.46, 0.19, 0.38, phi_A, phi_C).inverse(home))[0]) < 1e-15
    for workspace in ("box", "paper"):
        evaluation = whole(sampling="coarse", workspace=workspace).evaluate(design[None])
        assert not evaluation.feasible[0]
        assert np.isfinite(evaluation.constraints).all()
        assert np.isfinite(evaluation.log_merit).all()
        assert evaluation.indices["aspect"][0] == 0.0
        assert "aspect: the least det G^-1 over its value at home is 0" in evaluation.explain(0)
        for name in (*NAMES, "balanced", "balanced5"):
            assert np.isnan(evaluation.indices[name][0]), name
    for by in (-0.5, 0.5):  # next to it: it works on neither side, but is defined
        beside = design.copy()
        beside[4] += np.radians(by)
        evaluation = problem.evaluate(beside[None])
        assert np.isfinite(evaluation.indices["balanced"][0])
        assert evaluation.indices["aspect"][0] < 0.0
        assert not evaluation.feasible[0]


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("L", np.nan, "dimensions: L = nan, R = 0.19, r_B = 0.38 m make no machine"),
        ("L", np.inf, "dimensions: L = inf"),
        ("L", 0.0, "dimensions: L = 0,"),
        ("R", -0.19, "dimensions: L = 0.46, R = -0.19"),
        ("r_B", 1e9, "each must lie between 0.001 and 1000 m"),
        ("phi_A", 0.0, "dimensions: phi_A = 0 deg makes no machine: it must lie between 0 and 120"),
        ("phi_A", np.nan, "dimensions: phi_A = nan deg makes no machine"),
        ("phi_C", 2.2, "dimensions: phi_C = 126.051 deg makes no machine"),
        ("phi_C", -1.0, "dimensions: phi_C = -57.2958 deg makes no machine"),
    ],
)
def test_what_makes_no_machine_is_said(variable: str, value: float, words: str) -> None:
    problem = whole(sampling="coarse")
    design = PRINTED.copy()
    design[FULL.index(variable)] = value
    evaluation = problem.evaluate(np.stack([design, PRINTED]))
    assert evaluation.constraints[0, 0] > 0.0
    assert words in evaluation.explain(0)
    assert all(np.isnan(values[0]) for values in evaluation.indices.values())
    assert evaluation.feasible.tolist() == [False, True]
    assert evaluation.indices["balanced"][1] == 1.0  # its neighbour is untouched


def test_rods_that_are_too_short_are_told_by_how_much() -> None:
    problem = pkm_gym.make_problem("pus6", sampling="coarse")
    lengths = np.linspace(0.05, 0.36, 60)
    evaluation = problem.evaluate(np.stack([lengths, 0.0 * lengths + 0.19], axis=-1))
    out = evaluation.quantity("reach") >= 1.0
    assert out.sum() > 40
    assert (np.diff(evaluation.log_merit[out]) < 0.0).all()
    assert (evaluation.log_merit[out] > 6.0).all()
    for i in np.flatnonzero(out)[::10]:
        words = evaluation.explain(i)
        assert "reach: the largest horizontal part of a rod over its length is" in words
        assert "s_cone" not in words
    missing = 1.0 + evaluation.unreached[out] - TOLERANCE
    for name in ("stroke", "s_cone", "clearance", "aspect"):
        column = problem.constraint_names.index(name)
        np.testing.assert_array_equal(evaluation.constraints[out, column], missing)


@pytest.mark.parametrize("workspace", ["box", "paper"])
@pytest.mark.parametrize("name", PROBLEMS)
def test_hostile_designs_are_answered_with_finite_numbers(name: str, workspace: str) -> None:
    problem = whole(name, sampling="coarse", workspace=workspace)
    n = 1500 if workspace == "box" else 60
    rng = np.random.default_rng(1)
    hostile = [np.nan, np.inf, -np.inf, 0.0, -1.0, 1e-300, 1e300, 1e9, 2.0, 0.5, 1e-3, 1e3]
    rows = rng.choice(hostile, (n, 5))
    mixed = np.where(rng.random((n, 5)) < 0.3, rows, designs_of(problem, n))
    wide = rng.uniform(0.0, 2.2, (n, 5))
    for designs in (rows, mixed, wide):
        evaluation = problem.evaluate(designs, problem.draw_tasks(n, rng))
        assert np.isfinite(evaluation.constraints).all()
        assert np.isfinite(evaluation.log_merit).all()
        broken = ~np.isfinite(designs).all(axis=1) | (designs <= 0.0).any(axis=1)
        assert (evaluation.constraints[broken, 0] > 0.0).all()
        assert not evaluation.feasible[broken].any()
        for i in range(0, n, n // 20):
            assert evaluation.feasible[i] == ("feasible" in evaluation.explain(i))


def test_hostile_poses_are_answered() -> None:
    machine: Any = pkm_gym.make_problem("pus6").mechanism(PRINTED[:2])
    poses = np.zeros((5, 6))
    poses[0, 0], poses[1, 3], poses[2, 1], poses[3, 5] = np.nan, np.inf, 1e300, -np.inf
    for verb in (machine.inverse_kinematics, machine.jacobian, machine.hessian):
        found = verb(poses).reshape(5, -1)
        assert np.isnan(found[:4]).any(axis=1).all()
        assert np.isfinite(found[4]).all()
    for values in (machine.local_indices(poses), machine.local_limits(poses)):
        assert all(np.isfinite(v[4]) for v in values.values())
    assert np.isnan(machine.local_indices(poses)["eta_omega"][:4]).all()
    back = machine.forward_kinematics(np.zeros((5, 6)), near=poses)
    assert np.isnan(back[:4]).all()
    np.testing.assert_allclose(back[4], 0.0, atol=1e-14)
