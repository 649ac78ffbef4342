"""The paper's averages: its lattice as reconstructed, by brute force and against its tables."""

from __future__ import annotations

import itertools
from functools import cache

import numpy as np
import pytest

import pkm_gym
from pkm_gym.mechanisms.pus6.lattice import Averages, averages
from pkm_gym.mechanisms.pus6.mechanism import NAMES

from .conftest import pair
from .model import Model, lattice, levels_reached

GRID = tuple(itertools.product(range(45, 56), range(10, 21)))  # L and R, cm: the paper's numbering
FIVE = [0, 1, 2, 3, 5]  # force and torque aside
PRINTED_SUM = 4_138_306  # of Table 1

# Table 2 as printed, by number of design.
TABLE_2 = {
    1: (0.17276, 0.17442, 0.06236, 0.11315, 0.01521, 0.37454),
    2: (0.18248, 0.18171, 0.08075, 0.13276, 0.01456, 0.40421),
    3: (0.19128, 0.18836, 0.09932, 0.15184, 0.01396, 0.43136),
    4: (0.20087, 0.19545, 0.11897, 0.17225, 0.01348, 0.46030),
    59: (0.21105, 0.18995, 0.10050, 0.15604, 0.01304, 0.40233),
    60: (0.21915, 0.19537, 0.11308, 0.17355, 0.01257, 0.42606),
    61: (0.22717, 0.20041, 0.12312, 0.19230, 0.01216, 0.44929),
    119: (0.25779, 0.20680, 0.12265, 0.22596, 0.01064, 0.47030),
    120: (0.26786, 0.21185, 0.12116, 0.24139, 0.01041, 0.49500),
    121: (0.27714, 0.21610, 0.11399, 0.25527, 0.01017, 0.51745),
}


@cache
def ours(
    L: float, R: float, length: float = 0.01, skew: float = 1.0, same_aspect: bool = False
) -> Averages:
    """Averages of a design of cm."""
    machine = pair(0.01 * L, 0.01 * R).machine
    return averages(machine.layout, machine.L, length, skew, same_aspect)


def means(length: float = 0.01, *, same_aspect: bool = False) -> np.ndarray:
    """The means (121, 6) of the paper's designs."""
    return np.array([ours(L, R, length, 1.0, same_aspect).means for L, R in GRID])


def normalised(values: np.ndarray) -> np.ndarray:
    return (values - values.min(axis=0)) / (values.max(axis=0) - values.min(axis=0))


# Against brute force ------------------------------------------------------------------------------


@pytest.mark.parametrize(("L", "R"), [(46, 19), (45, 10), (55, 20)])
def test_counts_without_the_mirror(L: int, R: int) -> None:
    model, poses = Model(0.01 * L, 0.01 * R), lattice()
    levels = levels_reached(model, poses)
    found = ours(L, R)
    assert found.poses == levels.sum()
    assert found.different == (levels > 0).sum()
    side = model.aspect(poses[levels > 0])
    assert found.beyond == levels[levels > 0][side < 0.0].sum()
    assert np.abs(side).min() > 1e-5  # no pose is singular: none is left out for it


@pytest.mark.parametrize("convention", ["influence", "symmetric"])
@pytest.mark.parametrize("same_aspect", [False, True])
def test_means_by_singular_values(convention: str, same_aspect: bool) -> None:
    model, poses = Model(0.46, 0.19), lattice()
    levels = levels_reached(model, poses)
    poses, levels = poses[levels > 0], levels[levels > 0]
    if same_aspect:
        kept = model.aspect(poses) > 0.0
        poses, levels = poses[kept], levels[kept]
    found = ours(46, 19, 0.05, 1.0 if convention == "influence" else 0.0, same_aspect)
    assert (found.poses, found.different) == (levels.sum(), len(levels))
    for mean, (name, values) in zip(
        found.means, model.local(poses, 0.05, convention).items(), strict=True
    ):
        within = 5e-6 if name in ("eta_alpha", "eta_a") else 1e-13
        assert mean == pytest.approx((levels * values).sum() / levels.sum(), rel=within), name


@pytest.mark.slow
def test_counts_of_all_designs_without_the_mirror() -> None:
    poses = lattice()
    for L, R in GRID:
        levels = levels_reached(Model(0.01 * L, 0.01 * R), poses)
        assert ours(L, R).poses == levels.sum()
        assert ours(L, R).different == (levels > 0).sum()


def test_a_design_that_reaches_nothing_has_no_averages() -> None:
    nothing = ours(15, 19)
    assert (nothing.poses, nothing.different, nothing.beyond) == (0, 0, 0)
    assert np.isnan(nothing.means).all()
    problem = pkm_gym.make_problem("pus6", workspace="paper")
    evaluation = problem.evaluate(np.array([[0.15, 0.19]]))
    assert np.isfinite(evaluation.constraints).all()
    assert not evaluation.feasible[0]


# Against the paper --------------------------------------------------------------------------------


def test_counts_of_the_grid() -> None:
    counts = np.array([ours(L, R).poses for L, R in GRID])
    assert counts.sum() == 4_138_504
    assert counts.sum() == pytest.approx(PRINTED_SUM, rel=5e-5)
    assert sum(ours(L, R).different for L, R in GRID) == 2_288_092
    assert (ours(46, 19).poses, ours(46, 19).different) == (11_308, 7_114)
    for number, printed in ((1, 30962), (11, 8490), (20, 13376), (61, 32446), (121, 19828)):
        assert counts[number - 1] == pytest.approx(printed, rel=0.021)


@pytest.mark.parametrize(
    ("L", "R", "known"),
    [
        (45, 10, (0.17227, 0.17443, 0.06282, 0.11087, 0.015154, 0.37381)),
        (50, 13, (0.21122, 0.19003, 0.09760, 0.15467, 0.013052, 0.40028)),
        (55, 20, (0.27968, 0.21766, 0.11264, 0.26036, 0.010268, 0.52321)),
        (46, 19, (0.26477, 0.23535, 0.15490, 0.29395, 0.011697, 0.61667)),
    ],
)
def test_known_averages(L: int, R: int, known: tuple[float, ...]) -> None:
    np.testing.assert_allclose(ours(L, R).means, known, rtol=0.0, atol=6e-6)


def test_averages_are_those_of_table_2() -> None:
    def missed(skew: float) -> np.ndarray:
        return np.array([
            ours(*GRID[number - 1], 0.01, skew).means / row - 1.0 for number, row in TABLE_2.items()
        ])  # fmt: skip

    worst = np.abs(missed(1.0)).max(axis=0)
    assert (worst < [0.0095, 0.0075, 0.029, 0.026, 0.0105, 0.0115]).all()
    assert (worst > [0.008, 0.006, 0.028, 0.025, 0.009, 0.0105]).all()
    means = 100.0 * missed(1.0).mean(axis=0)
    np.testing.assert_allclose(means, [0.3, 0.2, -0.8, -0.6, 0.2, 0.1], atol=0.06)
    symmetric = np.abs(missed(0.0)).max(axis=0)
    assert symmetric[2] == pytest.approx(0.14, abs=0.005)  # eta_alpha needs the other convention
    for k in (0, 1, 3, 4):
        assert symmetric[k] == pytest.approx(worst[k], rel=1e-9)


def test_inertia_is_contradicted_by_table_2_itself() -> None:
    for R, shorter, longer, values in ((13, 45, 50, (0.460, 0.400)), (19, 45, 55, (0.632, 0.499))):
        found = [ours(L, R).means[5] for L in (shorter, longer)]
        assert found == pytest.approx(values, abs=1e-3)
    assert TABLE_2[4][5] > TABLE_2[59][5]  # R = 13: L from 45 to 50 cm


def test_the_printed_design_is_the_max_min_of_the_papers_averages() -> None:
    table = normalised(means()[:, FIVE])
    order = np.argsort(-table.min(axis=1))
    assert [GRID[k] for k in order[:2]] == [(46, 19), (45, 19)]
    assert table.min(axis=1)[order[:2]] == pytest.approx([0.8584, 0.841], abs=5e-5)
    by_sum = np.argsort(-table.sum(axis=1))
    assert GRID[by_sum[0]] == (45, 20)
    assert GRID[by_sum[5]] == (46, 19)
    better = ((table[:, None] >= table[None]).all(-1) & (table[:, None] > table[None]).any(-1)).any(
        0
    )
    assert (~better).sum() == 11
    assert not better[GRID.index((46, 19))]
    by_share = means()[:, FIVE] / means()[:, FIVE].max(axis=0)
    assert GRID[int(by_share.min(axis=1).argmax())] == (45, 19)
    largest = means()[:, 2].argmax()
    assert means()[largest, 2] == pytest.approx(0.16834, abs=5e-6)  # printed 0.16399
    spread = np.ptp([ours(L, 19).means[0] for L in range(45, 56)]) / ours(45, 19).means[0]
    assert spread == pytest.approx(0.027, abs=1e-3)  # no best L of 46.5 to 49.5 cm


def test_poses_beyond_the_singularity_are_counted_and_can_be_left_out() -> None:
    shares = np.array([ours(L, R).beyond / ours(L, R).poses for L, R in GRID])
    assert shares[GRID.index((46, 19))] == pytest.approx(0.086, abs=5e-4)
    assert shares[GRID.index((45, 10))] == pytest.approx(0.266, abs=5e-4)
    assert (shares.min(), shares.max()) == pytest.approx((0.041, 0.266), abs=5e-4)
    for L, R in ((46, 19), (45, 10)):
        kept = ours(L, R, 0.01, 1.0, True)
        assert kept.poses == ours(L, R).poses - ours(L, R).beyond
        assert (kept.means[[0, 1, 3]] > ours(L, R).means[[0, 1, 3]]).all()
    table = normalised(means(same_aspect=True)[:, FIVE])
    assert GRID[int(table.min(axis=1).argmax())] == (45, 19)


def test_what_is_best_for_forces_depends_on_the_unit_of_length() -> None:
    known = {
        0.01: ((46, 10), 0.01519, None),
        0.05: ((51, 10), 0.05783, None),
        0.10: ((45, 20), 0.09152, (0.08955, 5)),
        0.20: ((45, 20), 0.11184, (0.10553, 11)),
    }
    for length, (best, value, printed) in known.items():
        eta_F = means(length)[:, 4]
        order = np.argsort(-eta_F)
        assert GRID[order[0]] == best
        assert eta_F[order[0]] == pytest.approx(value, abs=6e-6)
        at = GRID.index((46, 19))
        rank = int(np.flatnonzero(order == at)[0]) + 1
        if printed:
            assert (eta_F[at], rank) == (pytest.approx(printed[0], abs=6e-6), printed[1])
        else:
            assert rank > 60
    for name in (0, 1, 2, 3):
        np.testing.assert_array_equal(means(0.2)[:, name], means(0.01)[:, name])


def test_the_averages_are_over_different_workspaces() -> None:
    counts = [ours(45, R).poses for R in range(10, 21)]
    assert (np.diff(counts) < 0).all()
    assert (counts[0], counts[-1]) == (31_034, 8_486)  # printed 30,962 and 8,490
    rising = [ours(46, R).means[0] for R in range(10, 21)]
    assert (np.diff(rising) > 0.0).all()
    designs = np.array([[0.46, 0.01 * R] for R in range(10, 21)])
    box = pkm_gym.make_problem("pus6", task=dict.fromkeys(("tilt", "spin"), np.radians(15.0)))
    same = box.evaluate(designs).indices
    assert ((same["eta_omega"] > 0.31) & (same["eta_omega"] < 0.33)).all()
    np.testing.assert_allclose(
        same["eta_alpha"][[3, 4, 9, 10]], [0.23, 0.23, 0.12, 0.08], atol=4e-3
    )
    default = pkm_gym.make_problem("pus6").evaluate(designs).indices["eta_alpha"]
    np.testing.assert_allclose(default[[3, 9, 10]], [0.206, 0.099, 0.069], atol=6e-4)


# As an option -------------------------------------------------------------------------------------


@pytest.mark.parametrize("same_aspect", [False, True])
def test_the_lattice_as_a_workspace(same_aspect: bool) -> None:
    problem = pkm_gym.make_problem("pus6", workspace="paper", same_aspect=same_aspect)
    designs = np.array([[0.46, 0.19], [0.45, 0.10], [0.55, 0.20]])
    found = problem.evaluate(designs)
    for i, (L, R) in enumerate(100.0 * designs):
        expected = ours(round(L), round(R), 0.01, 1.0, same_aspect).means
        np.testing.assert_allclose([found.indices[n][i] for n in NAMES], expected, rtol=1e-12)
    assert found.indices["balanced"][0] == 1.0
    ratios = [
        found.indices[n] / found.indices[n][0] for n in ("eta_omega", "eta_v", "eta_a", "eta_I")
    ]
    np.testing.assert_allclose(
        found.indices["balanced"], np.prod(ratios, axis=0) ** 0.25, rtol=1e-14
    )
    box = pkm_gym.make_problem("pus6").evaluate(designs)  # the limits are those of the box
    np.testing.assert_array_equal(found.constraints, box.constraints)
