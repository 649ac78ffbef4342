"""The paper's problem of the leg against a model of its own and independent solutions."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import Any

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.optimize import differential_evolution, minimize

import pkm_gym
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import Optimum, Reference
from pkm_gym.core.scalar import tolerance
from pkm_gym.core.solve import solve_tasks
from pkm_gym.mechanisms.stroke_leg.indices import reference_moments, tolerance_weights

from .stroke_leg_model import Model, grid, moments, of

REFERENCE = Reference.load("pkm_gym.mechanisms.stroke_leg")
DEAD = ("dead_A_short", "dead_A_long", "dead_D_short", "dead_D_long")
FIVE = ("l1", "l3", "l6", "phi", "th3")
SIX = (*FIVE, "gamma")
WIDE: dict[str, Any] = {"phi": tuple(np.radians([80.0, 160.0]).tolist())}
NO_RANGE = {"l_min": 0.05, "ratio": 20.0}
LOW, HIGH, SWING = np.radians([15.0, 75.0, 30.0]).tolist()
OTHER = (49, 180, 302, 120, 76)
OPTIMUM = (42.0705, 180, 307.924, 120, 75.6069)


def problem_of(**arguments: Any) -> DesignProblem:
    return pkm_gym.make_problem("stroke_leg", **arguments)


@pytest.fixture(scope="module")
def leg() -> DesignProblem:
    return problem_of()


@pytest.fixture(scope="module")
def on_grid(leg: DesignProblem) -> Evaluation:
    designs = leg.grid()
    assert designs is not None
    return leg.evaluate(designs)


def design_of(l1: float, l3: float, l6: float, phi: float, th3: float) -> np.ndarray:
    """A design of mm and degrees."""
    return np.array([1e-3 * l1, 1e-3 * l3, 1e-3 * l6, *np.radians([phi, th3])])


def indices_of(problem: DesignProblem, *design: float) -> dict[str, float]:
    indices = problem.evaluate(design_of(*design)[None]).indices
    return {name: float(values[0]) for name, values in indices.items()}


def spread(
    problem: DesignProblem, n: int, *, defined: bool = True, seed: int = 3
) -> tuple[Evaluation, list[int]]:
    """Designs all over the box, each with a task of the Family, and n of those with indices."""
    rng = np.random.default_rng(seed)
    designs = problem.low + (problem.high - problem.low) * rng.random((60 * n, len(problem.low)))
    evaluation = problem.evaluate(designs, problem.draw_tasks(60 * n, rng))
    kept = np.flatnonzero(np.isfinite(evaluation.indices["force"]) | (not defined))[:n]
    assert len(kept) == n
    return evaluation, kept.tolist()


def model_of(problem: DesignProblem, design: np.ndarray, task: Any) -> Model:
    machine: Any = problem.mechanism(design, task)
    return Model(*(getattr(machine, field.name) for field in fields(Model)))


def clearance(evaluation: Evaluation) -> np.ndarray:
    """The least margin to a dead point, deg."""
    margins = np.stack([evaluation.indices[name] for name in DEAD])
    return np.asarray(np.degrees(margins.min(axis=0)))


# Extremes over the rectangle ----------------------------------------------------------------------


EVERY_BOX = [{}, {"free": SIX, "bounds": WIDE}, {"free": "all", "bounds": WIDE}]


@pytest.mark.parametrize("arguments", EVERY_BOX, ids=["paper", "family", "all"])
def test_extremes_lie_where_they_are_looked_for(arguments: dict[str, Any]) -> None:
    problem = problem_of(**arguments)
    evaluation, kept = spread(problem, 50)
    for i in kept:
        task: Any = evaluation.task(i)
        model = model_of(problem, evaluation.designs[i], task)
        opening = grid(task.theta_min, task.theta_max, task.swing, 49)
        found = {name: values[i] for name, values in evaluation.indices.items()}
        largest, least = np.moveaxis(model.singular_values(opening), -1, 0)
        assert found["force"] == pytest.approx(largest.max(), rel=1e-9)
        assert found["eta_DL"] <= (largest / least).min() + 1e-9
        if found["eta_DL"] == 1.0:
            varphi = np.linspace(-task.swing, task.swing, 2001)
            middle = np.stack([0.0 * varphi + 0.25 * np.pi, varphi], axis=-1)
            assert model.condition(middle).min() < 1.001
        lengths = model.lengths(opening).reshape(-1, 2)
        for k, name in enumerate(("l2", "l4")):
            assert found[f"{name}_min"] == pytest.approx(lengths[:, k].min(), abs=1e-13)
            assert found[f"{name}_max"] == pytest.approx(lengths[:, k].max(), abs=1e-13)
        number = found["l2_max"] / found["l2_min"], found["l4_max"] / found["l4_min"]
        assert found["stroke2"] == found["l2_max"] - found["l2_min"]
        assert found["stroke4"] == found["l4_max"] - found["l4_min"]
        assert evaluation.quantity("extension")[i] == pytest.approx(max(number), rel=1e-14)


@pytest.mark.parametrize("arguments", EVERY_BOX, ids=["paper", "family", "all"])
def test_margins_and_gap_of_any_design(arguments: dict[str, Any]) -> None:
    problem = problem_of(**arguments)
    evaluation, kept = spread(problem, 60, defined=False)
    across = 0
    for i in kept:
        task: Any = evaluation.task(i)
        model = model_of(problem, evaluation.designs[i], task)
        opening = grid(task.theta_min, task.theta_max, task.swing, 41)
        found = {name: values[i] for name, values in evaluation.indices.items()}
        assert found["gap"] == pytest.approx(model.gap(opening).min(), abs=1e-13)
        turned = model.turned(opening).reshape(-1, 2)
        a, d = (np.unwrap(part) for part in (turned * [1.0, -1.0]).T)
        d = d + 2.0 * np.pi * np.round((0.5 * np.pi - d.mean()) / (2.0 * np.pi))
        expected = {
            "dead_A_short": a.min(),
            "dead_A_long": np.pi - a.max(),
            "dead_D_short": d.min(),
            "dead_D_long": np.pi - d.max(),
        }
        across += int(min(expected.values()) < 0.0)
        for name, margin in expected.items():
            assert found[name] == pytest.approx(margin, abs=1e-12)
        assert np.isnan(found["eta_P"]) == (min(expected.values()) < 0.0)
    assert across > 10


@pytest.mark.parametrize("gamma", [5.0, 100.0, 130.0, 140.0, 225.0, 300.0, 320.0, 355.0])
def test_margins_of_any_angle_of_the_second_crank(gamma: float) -> None:
    problem = problem_of(fixed={"gamma": float(np.radians(gamma))})
    indices = problem.evaluate(design_of(*OTHER)[None]).indices
    model, machine = of(*OTHER, gamma=gamma), problem.mechanism(design_of(*OTHER))
    opening = grid(LOW, HIGH, SWING, 31)
    turned = model.turned(opening)[..., 1]
    shown = machine.index_maps(model.foot(opening))
    above = 135.0 < gamma < 315.0  # D over OC in the middle of D's range
    d = turned if above else -turned
    d = 0.5 * np.pi - np.angle(np.exp(1j * (0.5 * np.pi - d)))  # about where OD is square to OC
    for name, margins in (("dead_D_short", d), ("dead_D_long", np.pi - d)):
        assert indices[name][0] == pytest.approx(margins.min(), abs=1e-12)
        np.testing.assert_allclose(shown[name].values, margins, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("arguments", EVERY_BOX[1:], ids=["family", "all"])
def test_the_smallest_condition_number_on_a_dense_grid(arguments: dict[str, Any]) -> None:
    problem = problem_of(**arguments)
    evaluation, kept = spread(problem, 300, seed=11)
    kept = [i for i in kept if evaluation.indices["eta_DL"][i] > 1.0][:25]
    assert len(kept) == 25
    for i in kept:
        machine: Any = problem.mechanism(evaluation.designs[i], evaluation.task(i))
        dense = grid(machine.theta_min, machine.theta_max, machine.swing, (1201, 101))
        eta = machine.local_indices(machine.foot(dense))["eta"].min()
        assert eta - 1e-3 <= evaluation.indices["eta_DL"][i] <= eta + 1e-6


def test_one_is_the_smallest_condition_number_of_the_whole_box(on_grid: Evaluation) -> None:
    defined = np.isfinite(on_grid.indices["eta_DL"])
    np.testing.assert_array_equal(on_grid.indices["eta_DL"][defined], 1.0)


# Means --------------------------------------------------------------------------------------------


def test_means_converge_to_those_of_a_known_design() -> None:
    uniform = indices_of(problem_of(nodes=64), *OTHER)
    assert uniform["eta_P"] == pytest.approx(2.052939, abs=5e-7)
    assert uniform["sigma"] == pytest.approx(0.915816, abs=5e-7)
    assert uniform["eta_DL"] == 1.0
    by_area = indices_of(problem_of(nodes=64, measure="area"), *OTHER)
    assert by_area["eta_P"] == pytest.approx(1.8954, abs=5e-5)
    assert by_area["sigma"] == pytest.approx(0.830658, abs=5e-7)
    assert 1e3 * uniform["l2_min"] == pytest.approx(263.989, abs=5e-4)
    assert 1e3 * uniform["l2_max"] == pytest.approx(346.033, abs=5e-4)
    assert 1e3 * uniform["l4_min"] == pytest.approx(260.718, abs=5e-4)
    assert 1e3 * uniform["l4_max"] == pytest.approx(345.305, abs=5e-4)
    assert 1e3 * uniform["gap"] == pytest.approx(69.5, abs=0.05)
    assert np.degrees(uniform["dead_A_short"]) == pytest.approx(10.95, abs=5e-3)


def test_an_even_sample_of_a_known_design() -> None:
    found = indices_of(problem_of(sampling="grid"), *OTHER)
    assert found["eta_P"] == pytest.approx(2.095792, abs=5e-7)
    assert found["sigma"] == pytest.approx(0.972215, abs=5e-7)
    assert found["lambda_paper"] == pytest.approx(8.268281, abs=5e-7)
    assert found["eta_FC"] == pytest.approx(0.972215 / 61.0, abs=1e-8)
    middles = indices_of(problem_of(sampling="midpoint"), *OTHER)
    assert middles["lambda_paper"] == pytest.approx(8.264338, abs=5e-7)
    eta = of(*OTHER).condition(grid(LOW, HIGH, SWING, 61))
    assert found["eta_P"] == pytest.approx(eta.mean(), rel=1e-12)
    assert found["sigma"] == pytest.approx(eta.std(), rel=1e-11)
    assert found["eta_DL"] == pytest.approx(eta.min(), rel=1e-12)
    coarse = indices_of(problem_of(sampling="grid", points=16), *OTHER)
    assert coarse["eta_DL"] > 1.05  # an even number of points misses theta = 45 deg


def test_means_by_adaptive_quadrature() -> None:
    model = of(*OTHER)
    found = indices_of(problem_of(nodes=64), *OTHER)
    area = (HIGH - LOW) * 2.0 * SWING
    halves = ((LOW, 0.25 * np.pi), (0.25 * np.pi, HIGH))
    for power, expected in (
        (1, found["eta_P"]),
        (2, found["sigma"] ** 2 + found["eta_P"] ** 2),
    ):
        total = sum(
            dblquad(
                lambda v, t, power=power: float(model.condition(np.array([t, v])) ** power),
                *ends, -SWING, SWING, epsabs=1e-4, epsrel=1e-4,
            )[0]
            for ends in halves
        )  # fmt: skip
        assert total / area == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize("measure", ["uniform", "area"])
def test_means_of_other_designs_by_a_fine_rule(measure: str) -> None:
    problem = problem_of(nodes=64, measure=measure, free="all", bounds=WIDE)
    evaluation, kept = spread(problem, 200, seed=17)
    kept = [i for i in kept if clearance(evaluation)[i] > 5.0][:12]
    assert len(kept) == 12
    for i in kept:
        task: Any = evaluation.task(i)
        model = model_of(problem, evaluation.designs[i], task)
        mean, deviation = moments(
            model, task.theta_min, task.theta_max, task.swing, by_area=measure == "area"
        )
        found = {name: values[i] for name, values in evaluation.indices.items()}
        assert found["eta_P"] == pytest.approx(mean, abs=2e-6)
        assert found["sigma"] == pytest.approx(deviation, abs=2e-6)
        assert found["eta_FC"] == pytest.approx(found["sigma"] / 61.0, rel=1e-14)
        weighted = [0.516 * mean, 20.8 * deviation / 61.0, 8.19 * found["eta_DL"]]
        assert found["lambda_paper"] == pytest.approx(np.linalg.norm(weighted), abs=1e-6)
        alike = reference_moments(task.theta_min, task.theta_max, measure == "area")
        expected = 0.5 * (mean / alike[0] + deviation / alike[1])
        assert found["dexterity"] == pytest.approx(expected, abs=4e-6)


def sampling_errors(box: dict[str, Any], n: int, names: tuple[str, ...]) -> dict[str, float]:
    """The largest errors of the default sample where the clearance is 5 to 10 deg."""
    coarse, fine = problem_of(**box), problem_of(**box, nodes=64)
    rng = np.random.default_rng(1)
    designs = coarse.low + (coarse.high - coarse.low) * rng.random((n, len(coarse.low)))
    tasks = coarse.draw_tasks(n, rng) if box else np.repeat(coarse.pack(None)[None], n, axis=0)
    found = coarse.evaluate(designs, tasks)
    near = (clearance(found) > 5.0) & (clearance(found) < 10.0)
    assert near.sum() > 500
    exact = fine.evaluate(designs[near], tasks[near]).indices
    return {name: np.abs(found.indices[name][near] - exact[name]).max() for name in names}


def test_sampling_errors_are_as_documented() -> None:
    names = ("eta_P", "sigma", "dexterity", "lambda_paper")
    errors = sampling_errors({}, 100_000, names)
    assert errors["eta_P"] < 7e-5
    assert 1e-4 < errors["sigma"] < 4e-4
    assert errors["dexterity"] < 3e-4
    assert errors["lambda_paper"] < 1e-5


def test_sampling_errors_over_the_family_are_as_documented() -> None:
    names = ("eta_P", "sigma", "dexterity", "lambda_paper")
    errors = sampling_errors({"free": SIX, "bounds": WIDE}, 30_000, names)
    assert errors["eta_P"] < 4e-4
    assert errors["sigma"] < 1e-3
    assert errors["dexterity"] < 6e-4
    assert errors["lambda_paper"] < 3e-5


@pytest.mark.parametrize("by_area", [False, True])
def test_what_equal_amplification_gives(by_area: bool) -> None:
    for low, high in ((15.0, 75.0), (12.0, 60.0), (2.0, 88.0), (40.0, 50.0)):
        theta, w = np.polynomial.legendre.leggauss(120)
        pieces = []
        for a, b in ((low, 45.0), (45.0, high)):
            t = np.radians(0.5 * (a + b) + 0.5 * (b - a) * theta)
            pieces.append((t, w * (b - a) * (np.sin(2.0 * t) if by_area else 1.0)))
        t, w = (np.concatenate(parts) for parts in zip(*pieces, strict=True))
        eta = np.maximum(np.tan(t), 1.0 / np.tan(t))
        mean = (w * eta).sum() / w.sum()
        deviation = np.sqrt((w * (eta - mean) ** 2).sum() / w.sum())
        found = reference_moments(np.radians(low), np.radians(high), by_area)
        assert found == pytest.approx((mean, deviation), rel=1e-9)
    printed = (1.7866, 0.671) if by_area else (1.9195, 0.7303)
    assert reference_moments(LOW, HIGH, by_area) == pytest.approx(printed, abs=5e-4)


# The paper's weights and its design ---------------------------------------------------------------


SWEPT = ((4.0544, 7.9328), (0.07151, 0.16766), (1.002, 1.701))


def test_the_printed_weights_mix_powers() -> None:
    mu = tolerance_weights(SWEPT)
    for found, printed, digits in zip(mu, (0.516, 20.8, 8.19), (5e-4, 5e-2, 5e-3), strict=True):
        assert found == pytest.approx(printed, abs=digits)
    as_printed = tolerance_weights(SWEPT, powers=(2, 2, 2))
    assert as_printed == pytest.approx((0.266, 432.7, 8.19), rel=2e-3)
    assert tolerance_weights(SWEPT, powers=(1, 1, 1))[2] == pytest.approx(2.861, abs=5e-4)
    with pytest.raises(ValueError, match=r"the range \(2, 1\) is empty: its maximum must be"):
        tolerance_weights(((2.0, 1.0),), powers=(1,))


def test_weights_are_options() -> None:
    mu = tolerance_weights(SWEPT, powers=(1, 1, 1))
    found, base = (indices_of(problem_of(**k), *OTHER) for k in ({"mu": mu}, {}))
    weighted = [m * base[name] for m, name in zip(mu, ("eta_P", "eta_FC", "eta_DL"), strict=True)]
    assert found["lambda_paper"] == pytest.approx(np.linalg.norm(weighted), rel=1e-12)
    assert found["eta_P"] == base["eta_P"]


def test_lambda_is_the_tolerance_weighted_length_of_three_indices_measured_from_zero(leg) -> None:
    designs = np.concatenate([leg.printed_design()[None], np.linspace(leg.low, leg.high, 7)])
    indices = leg.evaluate(designs).indices
    etas = np.column_stack([indices[name] for name in ("eta_P", "eta_FC", "eta_DL")])
    way = tolerance(etas, 1.0 / np.array(leg.options.mu), aims=np.zeros(3))
    np.testing.assert_allclose(way(etas), indices["lambda_paper"], rtol=1e-12)


def test_the_printed_design_crosses_a_dead_line_on_its_rectangle(leg: DesignProblem) -> None:
    evaluation = leg.evaluate(leg.printed_design()[None])
    assert not evaluation.feasible[0]
    found = {name: float(values[0]) for name, values in evaluation.indices.items()}
    assert np.degrees(found["dead_A_short"]) == pytest.approx(-13.67, abs=5e-3)
    for name in ("eta_P", "sigma", "eta_FC", "eta_DL", "lambda_paper", "dexterity", "force"):
        assert np.isnan(found[name])
    assert 1e3 * found["l2_min"] == pytest.approx(260.76, abs=5e-3)
    assert 1e3 * found["l2_max"] == pytest.approx(364.04, abs=5e-3)
    assert 1e3 * found["stroke2"] == pytest.approx(103.3, abs=0.05)
    assert 1e3 * found["gap"] == pytest.approx(94.0, abs=0.5)
    words = evaluation.explain(0)
    assert "dead_A_short: the smallest angle of OA to its dead line" in words
    assert "-13.67 deg at theta = 75.0 deg, varphi = 30.0 deg" in words
    turned = of(75, 240, 305, 135, 75).turned(grid(LOW, HIGH, SWING, 241))[..., 0]
    assert (turned < 0.0).mean() == pytest.approx(0.026, abs=1e-3)


def test_the_printed_design_at_half_the_swing(on_grid: Evaluation) -> None:
    half = problem_of(task={"swing": 0.5 * SWING})
    evaluation = half.evaluate(half.printed_design()[None])
    found = {name: float(values[0]) for name, values in evaluation.indices.items()}
    assert np.degrees(found["dead_A_short"]) == pytest.approx(1.33, abs=6e-3)
    assert 1e3 * found["l2_min"] == pytest.approx(260.785, abs=5e-4)  # printed 260
    assert 1e3 * found["l2_max"] == pytest.approx(345.734, abs=5e-4)  # printed 345
    assert 1e3 * found["stroke2"] == pytest.approx(84.949, abs=5e-4)  # printed 85
    assert 1e3 * found["l4_min"] == pytest.approx(257.5, abs=0.05)
    assert 1e3 * found["l4_max"] == pytest.approx(361.9, abs=0.05)
    assert found["lambda_paper"] == pytest.approx(8.650, abs=1e-3)
    broken = np.array(half.constraint_names)[evaluation.constraints[0] > 0.0].tolist()
    assert broken == ["dead_A_short", "cylinder2_long", "cylinder4_short", "cylinder4_long"]
    others = half.evaluate(on_grid.designs)
    clear = others.indices["dead_A_short"] > 0.0
    assert clear.mean() == pytest.approx(0.378, abs=5e-4)
    better = others.indices["lambda_paper"][clear] < found["lambda_paper"]
    assert better.mean() == pytest.approx(0.89, abs=5e-3)


# Our grid over the paper's ranges -----------------------------------------------------------------


def test_few_designs_of_the_grid_meet_all_limits(leg: DesignProblem, on_grid: Evaluation) -> None:
    assert len(on_grid) == 184_275
    assert on_grid.feasible.sum() == 4
    best = on_grid.best()
    np.testing.assert_allclose(on_grid.designs[best], design_of(45, 180, 300, 120, 75), rtol=1e-12)
    assert on_grid.indices["lambda_paper"][best] == pytest.approx(8.264666, abs=1e-5)
    assert on_grid.indices["dexterity"][best] == pytest.approx(1.171263, abs=1e-5)
    others = [k for k, name in enumerate(leg.constraint_names) if name != "gap"]
    assert (on_grid.constraints[:, others] <= 0.0).all(axis=1).sum() == 9


def test_the_printed_weights_cannot_rank_designs(on_grid: Evaluation) -> None:
    margin = np.degrees(on_grid.indices["dead_A_short"])
    clear = margin > 1e-6  # some stand on the dead line
    assert clear.mean() == pytest.approx(0.103, abs=5e-4)
    lam = on_grid.indices["lambda_paper"]
    least = lam[clear].min()
    assert (lam[clear] <= 1.01 * least).mean() > 0.995
    assert (lam[margin > 1.0] <= 1.01 * least).all()
    assert (lam[clear] <= 1.001 * least).mean() == pytest.approx(0.39, abs=5e-3)
    assert (lam[margin > 5.0] <= 1.001 * least).mean() == pytest.approx(0.83, abs=6e-3)
    assert least > 8.2534  # with |k2| = |k4| everywhere
    mean, deviation = reference_moments(LOW, HIGH, by_area=False)
    alike = np.linalg.norm([0.516 * mean, 20.8 * deviation / 61.0, 8.19])
    assert alike == pytest.approx(8.2534, abs=5e-5)
    assert np.linalg.norm([0.516 * mean, 8.19]) == pytest.approx(8.2497, abs=5e-5)


# Optima -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("optimum", REFERENCE.optima.values(), ids=lambda o: o.name)
def test_stored_optima_are_solutions(optimum: Optimum) -> None:
    problem = problem_of(objective=optimum.objective)
    solution = solve_tasks(problem, problem.pack(None)[None])
    assert solution.certified[0]
    assert solution.optima[0] == pytest.approx(optimum.value, rel=1e-7)
    assert tuple(np.array(problem.constraint_names)[solution.active[0]]) == optimum.active
    stored = problem.evaluate(problem.design(optimum.design)[None])
    assert stored.feasible[0]
    assert stored.objectives[0, 0] == pytest.approx(optimum.value, rel=1e-7)


def test_the_optimum_is_a_vertex_of_limits_and_bounds(leg: DesignProblem) -> None:
    solution = solve_tasks(leg, leg.pack(None)[None])
    design = solution.designs[0]
    np.testing.assert_allclose(design, design_of(*OPTIMUM), rtol=2e-6)
    np.testing.assert_allclose(design[[1, 3]], leg.low[[1, 3]], rtol=1e-9)
    model = model_of(leg, design, leg.task)
    opening = grid(LOW, HIGH, SWING, 61)
    lengths = model.lengths(opening).reshape(-1, 2)
    np.testing.assert_allclose(lengths.max(axis=0), 0.345, rtol=2e-6)
    assert model.gap(opening).min() == pytest.approx(0.06, rel=2e-6)
    assert (lengths.min(axis=0) > 0.26).all()
    assert np.degrees(model.turned(opening)[..., 0].min()) > 5.0
    mean, deviation = moments(model, LOW, HIGH, SWING)
    assert mean == pytest.approx(2.053139, abs=2e-6)
    assert deviation == pytest.approx(0.913426, abs=2e-6)
    assert 0.5 * (mean / 1.9195 + deviation / 0.7303) == pytest.approx(1.160197, abs=5e-5)
    lam = np.linalg.norm([0.516 * mean, 20.8 * deviation / 61.0, 8.19])
    assert lam == pytest.approx(8.264108, abs=1e-6)
    assert model.singular_values(opening).max() == pytest.approx(55.117, abs=5e-4)
    found = {name: float(v[0]) for name, v in leg.evaluate(design[None]).indices.items()}
    for name, value in (
        ("lambda_paper", 8.264108), ("dexterity", 1.160197), ("eta_P", 2.053139),
    ):  # fmt: skip
        assert found[name] == pytest.approx(value, abs=1.5e-5)  # the default sample
    converged = problem_of(nodes=64).evaluate(design[None]).indices
    assert converged["dexterity"][0] == pytest.approx(1.160197, abs=1.5e-6)


CASES: dict[str, tuple[dict[str, Any], float, float]] = {
    "lambda without the gap": (
        {"objective": "lambda_paper", "task": {"gap_min": 1e-3}}, 8.264091, 2e-6,
    ),
    "lambda without the cylinders' range": (
        {"objective": "lambda_paper", "task": NO_RANGE}, 8.260645, 2e-6,
    ),
    "dexterity, gamma": ({"free": SIX}, 1.152490, 1e-5),
    "dexterity, gamma and l5": ({"free": "all"}, 1.136734, 1e-5),
    "dexterity, phi wide": ({"bounds": WIDE}, 1.078040, 1e-5),
    "dexterity, phi wide and gamma": ({"free": SIX, "bounds": WIDE}, 1.076215, 1e-5),
    "dexterity, phi wide, gamma and l5": ({"free": "all", "bounds": WIDE}, 1.076215, 1e-5),
    "lambda, phi wide and gamma": (
        {"objective": "lambda_paper", "free": SIX, "bounds": WIDE}, 8.259458, 2e-6,
    ),
    "force": ({"objective": "force"}, 48.3153, 6e-4),
    "force, phi wide and gamma": (
        {"objective": "force", "free": SIX, "bounds": WIDE}, 23.2069, 3e-4,
    ),
    "force without the cylinders' range": (
        {"objective": "force", "task": NO_RANGE}, 12.745, 5e-4,
    ),
}  # fmt: skip


@pytest.mark.parametrize(("arguments", "value", "within"), CASES.values(), ids=CASES)
def test_optima_with_other_limits_and_variables(
    arguments: dict[str, Any], value: float, within: float
) -> None:
    problem = problem_of(**arguments)
    solution = solve_tasks(problem, problem.pack(None)[None])
    assert solution.certified[0]
    assert solution.optima[0] == pytest.approx(value, abs=within)


@pytest.mark.parametrize("objective", ["dexterity", "lambda_paper", "eta_P", "force"])
def test_a_gradient_method_finds_no_better_design(objective: str) -> None:
    problem = problem_of(objective=objective)
    span = problem.high - problem.low

    def evaluated(share: np.ndarray) -> Evaluation:
        return problem.evaluate((problem.low + share * span)[None])

    best = np.inf
    rng = np.random.default_rng(5)
    start = (problem.design(REFERENCE.optima[objective].design) - problem.low) / span
    scale = 1.0 / REFERENCE.optima[objective].value
    for _ in range(6):
        found = minimize(
            lambda x: float(evaluated(x).objectives[0, 0]) * scale,
            np.clip(start + 0.1 * rng.normal(size=5), 0.0, 1.0),
            method="SLSQP",
            bounds=[(0.0, 1.0)] * 5,
            constraints={"type": "ineq", "fun": lambda x: -evaluated(x).constraints[0]},
            options={"ftol": 1e-13, "maxiter": 200},
        )
        evaluation = evaluated(np.clip(found.x, 0.0, 1.0))
        if evaluation.constraints.max() < 1e-9:
            best = min(best, float(evaluation.objectives[0, 0]))
    assert best == pytest.approx(REFERENCE.optima[objective].value, rel=1e-6)


def test_differential_evolution_finds_no_better_design(leg: DesignProblem) -> None:
    found = differential_evolution(
        lambda x: leg.evaluate(x.T).log_merit,
        list(zip(leg.low, leg.high, strict=True)),
        seed=3, tol=1e-14, atol=1e-14, maxiter=600, popsize=20, polish=False,
        vectorized=True, updating="deferred",
    )  # fmt: skip
    assert np.exp(found.fun) == pytest.approx(1.0, abs=1e-5)
    np.testing.assert_allclose(found.x, design_of(*OPTIMUM), rtol=5e-6)


# Other designs ------------------------------------------------------------------------------------


def test_indices_do_not_depend_on_the_side_but_for_the_force() -> None:
    short, long = (problem_of(task={"l": side}) for side in (0.26, 0.39))
    one, other = (indices_of(problem, *OTHER) for problem in (short, long))
    for name, value in one.items():
        factor = 1.5 if name == "force" else 1.0
        assert other[name] == pytest.approx(factor * value, rel=1e-12)


def test_indices_do_not_depend_on_the_size_of_the_cranks_and_the_frame(leg: DesignProblem) -> None:
    one, other = indices_of(leg, *OTHER), indices_of(leg, 98, 360, 604, 120, 76)
    powers = {"force": -1, **dict.fromkeys(("stroke2", "stroke4", "gap"), 1)}
    powers |= dict.fromkeys(("l2_min", "l2_max", "l4_min", "l4_max"), 1)
    for name, value in one.items():
        assert other[name] == pytest.approx(2.0 ** powers.get(name, 0) * value, rel=1e-12)


def test_phi_enters_as_a_sum_with_the_angle_of_the_frame() -> None:
    problem, ob, theta_b, l6 = problem_of(bounds=WIDE), 0.28, np.radians(42.0), 0.31
    found = []
    for shift in (0.0, 0.06):
        bx, bz = ob * np.cos(theta_b + shift), ob * np.sin(theta_b + shift)
        frame = [np.hypot(l6 - bx, bz), l6, np.radians(110.0) - shift, np.arctan2(bz, l6 - bx)]
        found.append(problem.evaluate(np.array([[0.05, *frame]])).indices)
    assert np.isfinite(found[0]["eta_P"])
    for name, values in found[0].items():
        same = found[1][name] == pytest.approx(values, rel=1e-9)
        assert same == (name != "gap"), name


def test_the_twin_design_has_the_same_ranges_but_its_cylinders_cross(leg: DesignProblem) -> None:
    base = leg.evaluate(design_of(*OTHER)[None])
    twin = problem_of(fixed={"gamma": float(np.radians(225.0))})
    other = twin.evaluate(design_of(*OTHER)[None])
    for name in DEAD:
        assert other.indices[name][0] == pytest.approx(base.indices[name][0], abs=1e-12)
    assert other.indices["dead_D_short"][0] == pytest.approx(np.radians(30.0), abs=1e-12)
    for name in ("l2_min", "l2_max"):
        assert other.indices[name][0] == base.indices[name][0]
    assert other.indices["gap"][0] == 0.0
    assert np.isfinite(other.indices["eta_P"][0])
    machine: Any = twin.mechanism(design_of(*OTHER))
    np.testing.assert_array_equal(machine.home_mode, [1.0, 1.0])
    pose = machine.foot(np.radians([45.0, 0.0]))
    back = machine.forward_kinematics(machine.inverse_kinematics(pose))
    np.testing.assert_allclose(back, pose, rtol=0.0, atol=1e-12)
    assert machine.cylinder_forces(pose, np.array([0.0, 1.0]))[1] < 0.0  # pulled under the body


def test_both_cranks_are_alike_unless_the_second_is_named() -> None:
    free = problem_of(free=(*FIVE, "l5"))
    design = design_of(*OTHER)
    for l5 in (0.049, 0.07):
        found = free.evaluate(np.append(design, l5)[None]).indices
        held = problem_of(fixed={"l5": l5}).evaluate(design[None]).indices
        same = problem_of().evaluate(design[None]).indices
        for name, values in found.items():
            np.testing.assert_array_equal(values, held[name])
        assert (found["l4_max"] == same["l4_max"]) == (l5 == 0.049)
        assert found["l2_max"] == same["l2_max"]
    model = of(*OTHER, l5=70.0)
    lengths = model.lengths(grid(LOW, HIGH, SWING, 31))
    assert found["l4_max"][0] == pytest.approx(lengths[..., 1].max(), abs=1e-13)


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("l1", np.nan, "l1 = nan, l3 = 0.18, l6 = 0.302, l5 = nan m make no machine"),
        ("l3", np.inf, "l3 = inf"),
        ("l6", 0.0, "l6 = 0,"),
        ("l1", -0.05, "l1 = -0.05"),
        ("l6", 1e9, r"l6 = 1e\+09"),
        ("l5", 0.0, "l5 = 0 m make no machine: each must lie between 0.001 and 1000 m"),
        ("phi", 4.0, "phi = 229.183 deg makes no machine: it must lie between 0 and 180 deg"),
        ("phi", np.nan, "phi = nan deg makes no machine: it must lie between 0 and 180 deg"),
        ("th3", -1.0, "th3 = -57.2958 deg makes no machine: it must lie between 0 and 180 deg"),
        ("th3", 0.0, "th3 = 0 deg makes no machine"),
        ("gamma", 7.0, "gamma = 401.07 deg makes no machine: it must lie between 0 and 360 deg"),
    ],
)
def test_what_makes_no_machine_is_said(variable: str, value: float, words: str) -> None:
    problem = problem_of(free="all")
    design = np.append(design_of(*OTHER), [0.25 * np.pi, 0.049])
    design[problem.variable_names.index(variable)] = value
    if variable == "l1":
        design[problem.variable_names.index("l5")] = value
    evaluation = problem.evaluate(design[None])
    assert evaluation.constraints[0, 0] > 0.0
    assert not evaluation.feasible[0]
    assert re.search(words, evaluation.explain(0))
    assert all(np.isnan(values[0]) for values in evaluation.indices.values())


@pytest.mark.parametrize("arguments", EVERY_BOX, ids=["paper", "family", "all"])
def test_hostile_designs_are_answered_with_finite_numbers(arguments: dict[str, Any]) -> None:
    problem = problem_of(**arguments)
    hostile = [np.nan, np.inf, -np.inf, 0.0, -1.0, 1e-300, 1e300, 1e9, 3.2, 0.5, 1e-3]
    rng = np.random.default_rng(1)
    rows = rng.choice(hostile, (4000, len(problem.low)))
    mixed = problem.low + (problem.high - problem.low) * rng.random(rows.shape)
    mixed = np.where(rng.random(rows.shape) < 0.3, rows, mixed)
    wide = rng.uniform(0.0, 3.0, rows.shape)
    for designs in (rows, mixed, wide):
        evaluation = problem.evaluate(designs, problem.draw_tasks(len(designs), rng))
        assert np.isfinite(evaluation.constraints).all()
        assert np.isfinite(evaluation.log_merit).all()
        broken = ~np.isfinite(designs).all(axis=1) | (designs <= 0.0).any(axis=1)
        assert (evaluation.constraints[broken, 0] > 0.0).all()
        for i in range(0, len(designs), 400):
            assert evaluation.explain(i)


@pytest.mark.parametrize(
    "design",
    [(0.05, 0.3, 0.3, 2.0, 1e-9), (0.3, 0.18, 0.3, 2.0, 1.3), (0.05, 0.18, 1e-3, 2.0, 1.0)],
    ids=["B on O", "a crank as long as the frame", "C on O"],
)
def test_degenerate_machines_are_infeasible(leg: DesignProblem, design: tuple) -> None:
    evaluation = leg.evaluate(np.array([design]))
    assert np.isfinite(evaluation.constraints).all()
    assert np.isfinite(evaluation.log_merit).all()
    assert not evaluation.feasible[0]
    assert evaluation.explain(0)
