"""A leg for a gait against a model of its own on dense samples, and its optimum found again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize

import pkm_gym
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import polish, solve_tasks

from .stroke_leg_model import Model

MARGINS = ("dead_A_short", "dead_A_long", "dead_D_short", "dead_D_long")
UNDEFINED = ("thrust_rms", "thrust", "rate")
# lengths (mm) and angles (deg) of an optimum of the default task; l3, phi, th3 lie on a curve
OPTIMUM = (51.6747, 164.18, 347.9491, 125.969, 76.354, 26.7382, 224.7112)


@pytest.fixture(scope="module")
def gait() -> DesignProblem:
    return pkm_gym.make_problem("stroke_leg_gait")


def design_of(l1: float, l3: float, l6: float, *rest: float) -> np.ndarray:
    """A design of mm and degrees."""
    *angles, side = rest
    return np.array([1e-3 * l1, 1e-3 * l3, 1e-3 * l6, *np.radians(angles), 1e-3 * side])


@pytest.fixture(scope="module")
def drawn(gait: DesignProblem) -> Evaluation:
    """Designs all over the box, each with a task of the Family."""
    rng = np.random.default_rng(5)
    designs = gait.low + (gait.high - gait.low) * rng.random((20_000, len(gait.low)))
    return gait.evaluate(designs, gait.draw_tasks(len(designs), rng))


@dataclass(frozen=True)
class Dense:
    """What the foot's rectangle asks of a leg, sampled all over."""

    model: Model
    task: Any

    @classmethod
    def of(cls, design: np.ndarray, task: Any) -> Dense:
        l1, l3, l6, phi, th3, gamma, side = design.tolist()
        return cls(Model(l1, l3, l6, phi, th3, gamma, l1, side), task)

    def feet(self, across: np.ndarray, up: np.ndarray) -> np.ndarray:
        """Feet (n, k, 2), m, of shares of stride and lift."""
        x = self.task.x0 + self.task.stride * (across - 0.5)
        z = -self.task.hip_height + self.task.lift * up
        return np.stack(np.meshgrid(x, z, indexing="ij"), axis=-1)

    @property
    def all_over(self) -> np.ndarray:
        """Feet with the corners and the point nearest to the hip among them."""
        t = np.linspace(0.0, 1.0, 37)
        nearest = np.clip(0.5 - self.task.x0 / self.task.stride, 0.0, 1.0)
        return self.feet(np.sort(np.append(t, nearest)), t)

    def opening(self, feet: np.ndarray) -> np.ndarray:
        """theta and varphi (..., 2) of feet (..., 2), checked by the model."""
        radius = np.linalg.norm(feet, axis=-1)
        theta = np.arccos(radius / (4.0 * self.model.l))
        opening = np.stack([theta, np.arctan2(-feet[..., 0], -feet[..., 1])], axis=-1)
        np.testing.assert_allclose(self.model.foot(opening), feet, rtol=0.0, atol=1e-13)
        return opening

    def forces(self, opening: np.ndarray, count: int) -> np.ndarray:
        """Forces (..., 2, count) of the cylinders for unit forces all over the cone."""
        angles = np.linspace(-self.task.cone, self.task.cone, count)
        on_foot = np.stack([np.sin(angles), np.cos(angles)])
        return -np.swapaxes(self.model.jacobian(opening), -1, -2) @ on_foot

    def rates(self, opening: np.ndarray) -> np.ndarray:
        """Largest speeds (..., 2) of the pistons for a unit speed of the foot."""
        return np.linalg.norm(np.linalg.inv(self.model.jacobian(opening)), axis=-1)

    def thrust_rms(self, nodes: int) -> float:
        points, weights = np.polynomial.legendre.leggauss(nodes)
        share = 0.5 * (points + 1.0)
        vertical = self.model.jacobian(self.opening(self.feet(share, share)))[..., 1, :]
        mean = 0.25 * np.outer(weights, weights) * (vertical**2).sum(axis=-1)
        return float(np.sqrt(mean.sum()))


# Indices ------------------------------------------------------------------------------------------


def test_indices_on_dense_samples(drawn: Evaluation) -> None:
    clear = np.stack([drawn.indices[name] for name in MARGINS]).min(axis=0) > np.radians(5.0)
    kept = np.flatnonzero(clear & (drawn.indices["theta_min"] > np.radians(10.0)))[:60]
    for i in (*kept, *np.flatnonzero(drawn.feasible)[:20]):
        dense = Dense.of(drawn.designs[i], drawn.task(int(i)))
        found = {name: float(values[i]) for name, values in drawn.indices.items()}
        assert found["thrust_rms"] == pytest.approx(dense.thrust_rms(24), rel=1e-6)
        opening = dense.opening(dense.all_over)
        largest = np.abs(dense.forces(opening, 181)).max()
        assert found["thrust"] == pytest.approx(largest, rel=5e-5)
        fastest = dense.rates(opening).max()
        assert fastest * (1.0 - 1e-3) <= found["rate"] <= fastest * (1.0 + 1e-9)
        assert found["gap"] == pytest.approx(dense.model.gap(opening).min(), abs=5e-7)
        lengths = dense.model.lengths(opening).reshape(-1, 2)
        for k, name in enumerate(("2", "4")):
            shortest, longest = lengths[:, k].min(), lengths[:, k].max()
            assert found[f"l{name}_min"] == pytest.approx(shortest, abs=1e-13)
            assert found[f"l{name}_max"] == pytest.approx(longest, abs=1e-13)
            assert found[f"stroke{name}"] == pytest.approx(longest - shortest, abs=1e-13)
        assert found["theta_min"] == pytest.approx(opening[..., 0].min(), abs=1e-13)
        assert found["theta_max"] == pytest.approx(opening[..., 0].max(), abs=1e-13)
        assert found["mount"] == pytest.approx(dense.model.B[1], rel=1e-14)


def test_margins_lengths_and_gap_of_any_design_that_reaches(drawn: Evaluation) -> None:
    reached = np.flatnonzero(np.isfinite(drawn.indices["gap"]))[:100]
    across = 0
    for i in reached:
        dense = Dense.of(drawn.designs[i], drawn.task(int(i)))
        found = {name: float(values[i]) for name, values in drawn.indices.items()}
        opening = dense.opening(dense.all_over)
        a, d = (np.unwrap(part) for part in (dense.model.turned(opening).reshape(-1, 2).T))
        d = -d
        a = a + 2.0 * np.pi * np.round((0.5 * np.pi - a.mean()) / (2.0 * np.pi))
        d = d + 2.0 * np.pi * np.round((0.5 * np.pi - d.mean()) / (2.0 * np.pi))
        expected = (a.min(), np.pi - a.max(), d.min(), np.pi - d.max())
        for name, margin in zip(MARGINS, expected, strict=True):
            assert found[name] == pytest.approx(margin, abs=2e-4)
        across += int(min(expected) < 0.0)
        for name in UNDEFINED:
            assert np.isnan(found[name]) == (min(found[name] for name in MARGINS) <= 0.0)
        lengths = dense.model.lengths(opening).reshape(-1, 2)
        assert found["l2_min"] == pytest.approx(lengths[:, 0].min(), abs=1e-5)
        assert found["l4_max"] == pytest.approx(lengths[:, 1].max(), abs=1e-5)
    assert across > 5


def test_the_default_samples_find_mean_and_extremes_of_feasible_legs(drawn: Evaluation) -> None:
    for i in np.flatnonzero(drawn.feasible)[:30]:
        dense = Dense.of(drawn.designs[i], drawn.task(int(i)))
        assert dense.thrust_rms(10) == pytest.approx(drawn.indices["thrust_rms"][i], rel=1e-11)
        edge = np.linspace(0.0, 1.0, 13)
        every = dense.opening(dense.feet(edge, edge))
        sides = np.concatenate([every[0], every[-1], every[:, 0], every[:, -1]])
        assert dense.rates(sides).max() == pytest.approx(drawn.indices["rate"][i], rel=1e-11)
        largest = np.abs(dense.forces(sides, 2001)).max()
        assert drawn.indices["thrust"][i] == pytest.approx(largest, rel=1e-6)


def test_the_mechanism_shows_what_the_problem_measures(
    gait: DesignProblem, drawn: Evaluation
) -> None:
    for i in np.flatnonzero(drawn.feasible)[:20]:
        machine = gait.mechanism(drawn.designs[i], drawn.task(int(i)))
        maps = gait.index_maps(machine, machine.search_poses())
        found = {name: float(drawn.indices[name][i]) for name in maps}
        assert np.sqrt((maps["thrust_rms"].values ** 2).mean()) == pytest.approx(
            found["thrust_rms"], rel=1e-2
        )
        for name in ("thrust", "rate", "l2_max", "l4_max", "theta_max"):
            assert maps[name].values.max() == pytest.approx(found[name], rel=1e-3)
        for name in ("gap", "l2_min", "l4_min", "theta_min", *MARGINS):
            assert maps[name].values.min() == pytest.approx(found[name], rel=1e-3)


@pytest.mark.parametrize("factor", [0.8, 1.3])
def test_how_a_leg_and_its_rectangle_scale(gait: DesignProblem, factor: float) -> None:
    design = design_of(*OPTIMUM)
    lengths = ("stride", "lift", "hip_height", "x0", "l_min", "mount", "gap")
    task: Any = gait.task
    task = replace(task, x0=0.03)
    larger = replace(task, **{name: factor * getattr(task, name) for name in lengths})
    scaled = np.where([name.startswith("l") for name in gait.variable_names], factor, 1.0) * design
    one, other = gait.evaluate(design[None], task), gait.evaluate(scaled[None], larger)
    for name, values in one.indices.items():
        power = float(gait.unit(name) == "m")
        assert other.indices[name] == pytest.approx(factor**power * values, rel=1e-12), name
    np.testing.assert_allclose(other.constraints[0, 1:], one.constraints[0, 1:], atol=1e-11)


def test_only_the_foot_and_the_side_scale_the_forces(gait: DesignProblem) -> None:
    design = design_of(*OPTIMUM)
    cranks = np.where([name in ("l1", "l3", "l6") for name in gait.variable_names], 1.1, 1.0)
    one, other = (gait.evaluate(d[None]).indices for d in (design, cranks * design))
    for name, power in (("thrust_rms", -1), ("thrust", -1), ("rate", 1), ("gap", 1), ("mount", 1)):
        assert other[name] == pytest.approx(1.1**power * one[name], rel=1e-12)
    for name in (*MARGINS, "theta_min", "theta_max"):
        assert other[name] == pytest.approx(one[name], rel=1e-12)


# Legs that don't work -----------------------------------------------------------------------------


def test_a_foot_out_of_reach(gait: DesignProblem, drawn: Evaluation) -> None:
    task: Any = gait.task
    far = np.hypot(0.5 * task.stride, task.hip_height)
    design = design_of(*OPTIMUM)
    for side, reached in ((0.25 * far / 0.999, True), (0.25 * far / 1.001, False)):
        design[-1] = side
        evaluation = gait.evaluate(design[None])
        assert np.isfinite(evaluation.indices["gap"][0]) == reached
        assert np.isfinite(evaluation.constraints).all()
        assert np.isfinite(evaluation.log_merit).all()
        assert not evaluation.feasible[0]
    assert evaluation.constraints[0, 1] == pytest.approx(1e-3 - 1e-6, abs=1e-12)
    assert np.isfinite(evaluation.indices["mount"][0])
    assert "the far corner of the foot's rectangle lies 741.0 mm from the hip" in (
        evaluation.explain(0)
    )
    missed = np.isnan(drawn.indices["gap"])
    assert 0.02 < missed.mean() < 0.2
    corner = [
        np.hypot(abs(t.x0) + 0.5 * t.stride, t.hip_height)
        for t in (drawn.task(int(i)) for i in np.flatnonzero(missed)[:200])
    ]
    ratio = corner / (4.0 * drawn.designs[missed, -1][:200])
    np.testing.assert_allclose(drawn.constraints[missed, 1][:200], ratio - 1.0 - 1e-6, atol=1e-12)


def test_a_crank_across_its_dead_line_leaves_lengths_and_gap(drawn: Evaluation) -> None:
    across = np.stack([drawn.indices[name] for name in MARGINS]).min(axis=0) < 0.0
    assert across.sum() > 500
    for name, values in drawn.indices.items():
        assert np.isnan(values[across]).all() if name in UNDEFINED else (
            np.isfinite(values[across]).all()
        )  # fmt: skip
    assert not drawn.feasible[across].any()
    assert np.isfinite(drawn.constraints).all()
    assert np.isfinite(drawn.log_merit).all()


def test_hostile_designs_are_answered_with_finite_numbers(gait: DesignProblem) -> None:
    hostile = [np.nan, np.inf, -np.inf, 0.0, -1.0, 1e-300, 1e300, 1e9, 3.2, 0.5, 1e-3]
    rng = np.random.default_rng(1)
    rows = rng.choice(hostile, (4000, len(gait.low)))
    mixed = gait.low + (gait.high - gait.low) * rng.random(rows.shape)
    mixed = np.where(rng.random(rows.shape) < 0.3, rows, mixed)
    for designs in (rows, mixed, rng.uniform(0.0, 3.0, rows.shape)):
        evaluation = gait.evaluate(designs, gait.draw_tasks(len(designs), rng))
        assert np.isfinite(evaluation.constraints).all()
        assert np.isfinite(evaluation.log_merit).all()
        broken = ~np.isfinite(designs).all(axis=1) | (designs <= 0.0).any(axis=1)
        assert (evaluation.constraints[broken, 0] > 0.0).all()
        for i in range(0, len(designs), 400):
            assert evaluation.explain(i)


@pytest.mark.parametrize(
    ("variable", "value", "words"),
    [
        ("l1", np.nan, "l1 = nan, l3 = 0.16418, l6 = 0.347949, l = 0.224711 m make no machine"),
        ("l", 0.0, "l = 0 m make no machine: each must lie between 0.001 and 1000 m"),
        ("gamma", -0.1, "gamma = -5.72958 deg makes no machine: it must lie between 0 and 360 deg"),
    ],
)
def test_what_makes_no_machine_is_said(
    gait: DesignProblem, variable: str, value: float, words: str
) -> None:
    design = design_of(*OPTIMUM)
    design[gait.variable_names.index(variable)] = value
    evaluation = gait.evaluate(design[None])
    assert words in evaluation.explain(0)
    assert all(np.isnan(values[0]) for values in evaluation.indices.values())


# The optimum of the default task ------------------------------------------------------------------


def check_optimum(gait: DesignProblem, design: np.ndarray) -> None:
    evaluation = gait.evaluate(design[None])
    assert evaluation.feasible[0]
    found = {name: float(values[0]) for name, values in evaluation.indices.items()}
    assert found["thrust_rms"] == pytest.approx(8.48464, abs=1.5e-5)
    assert found["thrust"] == pytest.approx(9.5993, abs=3e-4)
    for name in ("l2", "l4"):
        assert 1e3 * found[f"{name}_min"] == pytest.approx(320.738, abs=2e-3)
        assert 1e3 * found[f"{name}_max"] == pytest.approx(357.0, abs=1e-3)
    named = dict(zip(gait.variable_names, design, strict=True))
    assert 1e3 * named["l1"] == pytest.approx(51.6747, abs=2e-3)
    assert 1e3 * named["l6"] == pytest.approx(347.9491, abs=1e-2)
    assert 1e3 * named["l"] == pytest.approx(224.7112, abs=2e-3)
    assert np.degrees(named["gamma"]) == pytest.approx(26.7382, abs=5e-3)
    active = np.array(gait.constraint_names)[evaluation.constraints[0] > -1e-5]
    assert active.tolist() == ["cylinder2_long", "cylinder4_long", "rate"]


def test_the_known_optimum(gait: DesignProblem) -> None:
    found = gait.evaluate(design_of(*OPTIMUM)[None]).indices
    assert found["thrust_rms"][0] == pytest.approx(8.48463, abs=5e-6)
    assert found["thrust"][0] == pytest.approx(9.5993, abs=2e-4)
    assert 1e3 * found["gap"][0] == pytest.approx(100.9, abs=0.05)
    check_optimum(gait, polish(gait, design_of(*OPTIMUM)[None], radius=2e-3)[0])


def test_a_gradient_method_on_the_other_model_finds_the_same_optimum(gait: DesignProblem) -> None:
    task: Any = gait.task
    span = gait.high - gait.low
    edge = np.linspace(0.0, 1.0, 13)

    def sampled(share: np.ndarray) -> tuple[Dense, np.ndarray]:
        dense = Dense.of(gait.low + share * span, task)
        every = dense.opening(dense.feet(edge, edge))
        return dense, np.concatenate([every[0], every[-1], every[1:-1, 0], every[1:-1, -1]])

    def room(share: np.ndarray) -> np.ndarray:
        dense, sides = sampled(share)
        lengths = dense.model.lengths(sides).ravel() / task.l_min
        rates = dense.rates(sides).ravel() / task.rate
        mount = dense.model.B[1] / task.mount
        return np.concatenate([task.ratio - lengths, lengths - 1.0, 1.0 - rates, [1.0 - mount]])

    start = (design_of(*OPTIMUM) - gait.low) / span
    rng = np.random.default_rng(4)
    for _ in range(2):
        found = minimize(
            lambda share: sampled(share)[0].thrust_rms(10),
            np.clip(start + 0.05 * rng.normal(size=len(start)), 0.0, 1.0),
            method="SLSQP",
            bounds=[(0.0, 1.0)] * len(start),
            constraints={"type": "ineq", "fun": room},
            options={"ftol": 1e-10, "maxiter": 300},
        )
        assert found.fun == pytest.approx(8.48464, abs=1e-5)
        check_optimum(gait, gait.low + found.x * span)


@pytest.mark.slow
def test_a_search_finds_the_same_optimum(gait: DesignProblem) -> None:
    solution = solve_tasks(gait, gait.pack(None)[None])
    assert solution.certified[0]
    check_optimum(gait, solution.designs[0])
