"""The paper's atlas: its two tables, the max-min design, Pareto sets, and what averages hide."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import pkm_gym
from pkm_gym.mechanisms.pus6.atlas import FIVE, Atlas, lattice_atlas, pareto
from pkm_gym.mechanisms.pus6.mechanism import NAMES, Pus6
from pkm_gym.studies.grid.atlas import atlas as dataset_of
from pkm_gym.studies.grid.grid import evaluate_grid

PRINTED = 9 + 11  # the number of (46, 19) in the grid, less one
SHAPE = (11, 11)  # rows L, columns R
HEIGHTS = (-0.04, 0.0, 0.04)  # m, the levels of z


@cache
def atlas(**setting: float | str) -> Atlas:
    return lattice_atlas(**setting)


@pytest.fixture(scope="module")
def problem():
    return pkm_gym.make_problem("pus6")


@pytest.fixture(scope="module")
def box(problem):
    """The means (121, 6) over the default box."""
    indices = problem.evaluate(problem.grid()).indices
    return np.stack([indices[name] for name in NAMES], axis=-1)


def place(at):
    """L and R of a number of the grid, cm."""
    return tuple(np.round(100.0 * atlas().designs[at, :2]).astype(int).tolist())


# The lattice --------------------------------------------------------------------------------------


def lattice_poses():
    """The lattice's poses (n, 5), both sides of the mirror plane, m and rad."""
    axes = (
        np.arange(-0.18, 0.181, 0.04), np.arange(-0.11, 0.211, 0.04),
        *(np.radians(np.arange(-end, end + 1.0, 12.0)) for end in (54.0, 72.0, 60.0)),
    )  # fmt: skip
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 5)


def inverse_of_G(machine, poses):  # noqa: N802
    """G^-1 (n, 6, 6) and sliders (n, 6) from rods and arms, NaN out of reach."""
    points = machine.layout.reshape(6, 5)
    turned = Rotation.from_euler("XYZ", poses[:, 2:]).as_matrix()
    arms = np.einsum("nij,kj->nki", turned, points[:, :3])
    flat = poses[:, None, :2] + arms[..., :2] - points[:, 3:]
    drop = np.sqrt(machine.L**2 - (flat**2).sum(axis=-1))
    rods = np.concatenate([flat, -drop[..., None]], axis=-1)
    jacobian = np.concatenate([np.cross(arms, rods), rods], axis=-1)
    return jacobian / rods[..., 2:], arms[..., 2] + drop


@pytest.mark.parametrize(("L", "R"), [(0.45, 0.10), (0.46, 0.19)])
def test_counts_and_means_are_those_of_a_plain_loop_over_the_lattice(L, R):
    machine, poses = Pus6(L=L, R=R), lattice_poses()
    with np.errstate(invalid="ignore"):
        inverse, sliders = inverse_of_G(machine, poses)
    low, high = sliders.min(axis=1) - machine.home, sliders.max(axis=1) - machine.home
    levels = np.zeros(len(poses))
    for z in HEIGHTS:
        levels += (low + z >= -0.175) & (high + z <= 0.119)
    inside = levels > 0.0
    levels, inverse = levels[inside], inverse[inside]
    home = np.linalg.det(inverse_of_G(machine, np.zeros((1, 5)))[0])
    beyond = np.linalg.det(inverse) * home < 0.0
    G = np.linalg.inv(inverse)
    at = int(round(100 * L) - 45) * 11 + int(round(100 * R) - 10)
    assert atlas().poses[at] == levels.sum()
    assert atlas().different[at] == inside.sum()
    assert atlas().beyond[at] == pytest.approx(levels[beyond].sum() / levels.sum(), rel=1e-12)
    for name, rows in (("eta_omega", G[:, :3]), ("eta_v", G[:, 3:])):
        values = np.linalg.svd(rows, compute_uv=False)
        local = 1.0 / np.sqrt((values**2).sum(axis=1) * (values**-2.0).sum(axis=1))
        assert atlas()[name][at] == pytest.approx(local @ levels / levels.sum(), rel=1e-8)
        kept = local[~beyond] @ levels[~beyond] / levels[~beyond].sum()
        assert atlas(same_aspect=True)[name][at] == pytest.approx(kept, rel=1e-8)


def test_all_averages_are_defined():
    assert np.isfinite(atlas().means).all()
    assert np.isfinite(atlas(same_aspect=True).means).all()


def test_counts_are_those_of_table_1(problem):
    printed = np.array(problem.reference.data["table1"]["counts"], dtype=float)
    assert printed.shape == SHAPE
    assert printed.sum() == 4_138_306
    ours = atlas().poses.reshape(SHAPE)
    assert ours.sum() == 4_138_504
    off = ours / printed - 1.0
    assert np.sqrt((off**2).mean()) < 0.006
    assert np.abs(off).max() < 0.021


def test_averages_are_those_of_table_2(problem):
    table = problem.reference.data["table2"]
    rows = np.array(table["rows"])
    at = (11 * (rows[:, 0] - 45) + rows[:, 1] - 10).astype(int)
    assert table["columns"][3:] == list(NAMES)
    assert [place(k) for k in at] == [tuple(row) for row in rows[:, :2].astype(int).tolist()]
    counts = np.array(problem.reference.data["table1"]["counts"]).ravel()
    np.testing.assert_array_equal(counts[at], rows[:, 2])
    off = np.abs(atlas().means[at] / rows[:, 3:] - 1.0).max(axis=0)
    np.testing.assert_array_less(off, [0.0095, 0.0075, 0.0295, 0.0265, 0.0105, 0.0115])
    symmetric = atlas(convention="symmetric").means[at] / rows[:, 3:] - 1.0
    assert np.abs(symmetric[:, 2]).max() > 0.1  # eta_alpha needs the other convention


# The choice ---------------------------------------------------------------------------------------


def test_46_19_is_the_max_min_of_the_five_normalised_indices():
    five = atlas().means[:, [NAMES.index(name) for name in FIVE]]
    least = ((five - five.min(axis=0)) / np.ptp(five, axis=0)).min(axis=1)
    np.testing.assert_allclose(atlas().balanced, least, rtol=1e-12)
    first, second = np.argsort(-atlas().balanced)[:2]
    assert first == PRINTED
    assert place(first) == (46, 19)
    assert atlas().balanced[first] == pytest.approx(0.8584, abs=5e-5)
    assert place(second) == (45, 19)
    assert atlas().balanced[second] == pytest.approx(0.841, abs=5e-4)


def test_on_the_home_side_of_the_singularity_it_is_45_19():
    kept = atlas(same_aspect=True)
    assert place(kept.balanced.argmax()) == (45, 19)
    np.testing.assert_allclose(kept.poses, atlas().poses * (1.0 - atlas().beyond), rtol=1e-12)
    np.testing.assert_allclose(kept.beyond, atlas().beyond, rtol=1e-12)
    assert atlas().beyond.min() == pytest.approx(0.0415, abs=5e-4)
    assert atlas().beyond[0] == atlas().beyond.max() == pytest.approx(0.266, abs=5e-4)


def test_a_row_is_in_the_pareto_set_unless_another_dominates_it(rng):
    values = rng.random((60, 3)).round(1)
    values[7] = np.nan
    expected = [
        k != 7 and not any((row >= values[k]).all() and (row > values[k]).any() for row in values)
        for k in range(60)
    ]
    np.testing.assert_array_equal(pareto(values), expected)


def test_62_designs_of_six_indices_and_11_of_five_are_not_dominated():
    assert atlas().pareto(NAMES).sum() == 62
    assert atlas().pareto().sum() == 11
    assert atlas().pareto()[PRINTED]


# What the averages hide ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("length", "best", "largest", "printed", "rank"),
    [(0.01, (46, 10), 0.01520, 0.01170, 82), (0.05, (51, 10), 0.05783, 0.05441, 66),
     (0.1, (45, 20), 0.09152, 0.08955, 5), (0.2, (45, 20), 0.11184, 0.10553, 11)],
)  # fmt: skip
def test_the_ranking_by_force_flips_with_the_unit_of_length(length, best, largest, printed, rank):
    values = atlas(characteristic_length=length)["eta_F"]
    assert place(values.argmax()) == best
    assert 1 + (values > values[PRINTED]).sum() == rank
    assert values.max() == pytest.approx(largest, rel=5e-4)
    assert values[PRINTED] == pytest.approx(printed, rel=5e-4)
    for name in NAMES[:4]:  # eta_F and eta_I alone depend on it
        assert atlas(characteristic_length=length)[name] == pytest.approx(atlas()[name], rel=1e-9)


def test_over_one_box_the_trends_in_R_turn(box):  # noqa: N802
    lattice = atlas().means.reshape(*SHAPE, 6)[1]  # L = 46 cm
    same = box.reshape(*SHAPE, 6)[1]
    for name in ("eta_v", "eta_I"):
        k = NAMES.index(name)
        assert (np.diff(lattice[:, k]) > 0.0).all()
        assert (np.diff(same[:, k]) < 0.0).all()
    omega, alpha = NAMES.index("eta_omega"), NAMES.index("eta_alpha")
    assert lattice[-1, omega] / lattice[0, omega] > 1.5
    assert np.ptp(same[:, omega]) < 0.013
    assert same[9, alpha] < 0.5 * same[4, alpha]  # R = 19 and 14 cm
    assert lattice[9, alpha] > 1.15 * lattice[4, alpha]
    assert (np.diff(atlas().poses.reshape(SHAPE), axis=1) < 0.0).all()


# In the house's atlas -----------------------------------------------------------------------------


def test_the_grid_is_the_papers(problem):
    assert problem.grid().shape == (121, 2)
    assert np.round(100.0 * problem.grid()[[0, 1, 58, 120]]).tolist() == [
        [45, 10], [45, 11], [50, 13], [55, 20]
    ]  # fmt: skip
    assert pkm_gym.make_problem("pus6_layout").grid() is None


def test_the_atlas_of_the_grid_holds_counts_and_the_balance():
    seen = []
    paper = pkm_gym.make_problem("pus6", workspace="paper")
    evaluation = evaluate_grid(paper, progress=seen.append)
    assert sum(seen) == 121
    assert len(seen) > 10
    found = dataset_of(evaluation)
    best = found.balanced_atlas.isel(found.balanced_atlas.argmax(...))
    assert (float(best.L), float(best.R)) == (0.46, 0.19)
    np.testing.assert_array_equal(found.poses.values.ravel(), atlas().poses)
    assert int(found.pareto_5.sum()) == 11
    assert int(found.pareto_6.sum()) == 62
    for name in NAMES:
        np.testing.assert_allclose(found[name].values.ravel(), atlas()[name], rtol=1e-12)
    assert "balanced_atlas" not in dataset_of(pkm_gym.make_problem("pus6").evaluate(paper.grid()))


def test_part_of_the_grid_is_normalised_by_all_of_it():
    cut = pkm_gym.make_problem("pus6", workspace="paper", fixed={"L": 0.46})
    found = dataset_of(evaluate_grid(cut))
    np.testing.assert_allclose(
        found.balanced_atlas.values, atlas().balanced.reshape(SHAPE)[1], rtol=1e-12
    )
