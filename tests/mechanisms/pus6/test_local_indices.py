"""The six indices at a pose against singular values: symmetries, units, singular slices."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import ortho_group

from pkm_gym.core.five import squared
from pkm_gym.mechanisms.pus6.influence import moving_slice, turning_slice
from pkm_gym.mechanisms.pus6.mechanism import NAMES, Pus6

from .conftest import Pair, pair
from .model import condition, lattice
from .test_positions import GOLDEN, turned_by_a_third

CONVENTIONS = ("influence", "symmetric")
FREE_OF_UNITS = ("eta_omega", "eta_v", "eta_alpha", "eta_a")
TURNED_ALIKE = ("eta_omega", "eta_v", "eta_F", "eta_I")
UPPER = np.triu_indices(5)


def test_the_golden_pose(printed: Pair) -> None:
    known = [0.32989326, 0.25369966, 0.05783582, 0.37048713, 0.01314154, 0.69165676]
    found = printed.machine.local_indices(GOLDEN)
    np.testing.assert_allclose([found[n] for n in NAMES], known, rtol=0.0, atol=6e-9)
    symmetric = printed.machine.local_indices(GOLDEN, convention="symmetric")
    assert symmetric["eta_alpha"] == pytest.approx(0.01967149, abs=6e-9)
    for name in set(NAMES) - {"eta_alpha"}:
        if name != "eta_I":  # its norm of H holds the skew part
            assert symmetric[name] == pytest.approx(found[name], rel=1e-14)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_indices_are_those_of_singular_values(
    pairs: list[Pair], rng: np.random.Generator, convention: str
) -> None:
    for one in pairs:
        poses, length = one.poses(rng, 200), float(10.0 ** rng.uniform(-3.0, 0.0))
        found = one.machine.local_indices(poses, length, convention)
        expected = one.model.local(poses, length, convention)
        for name in NAMES:
            least = 1e-10 if name in ("eta_alpha", "eta_a") else 0.0  # next to a crease
            np.testing.assert_allclose(
                found[name], expected[name], rtol=1e-11, atol=least, err_msg=name
            )
        np.testing.assert_allclose(found["det"], np.linalg.det(one.model.inverse(poses)), rtol=1e-9)


def test_the_pseudo_inverses_are_those_of_numpy(pairs: list[Pair], rng: np.random.Generator):
    for one in pairs[:6]:
        pose = one.poses(rng, 1)
        G, H = one.model.first(pose)[0], one.model.second(pose)[0]
        kappa = [np.linalg.norm(m) * np.linalg.norm(np.linalg.pinv(m)) for m in (G[:3], G[3:])]
        slices = [np.linalg.norm(m) * np.linalg.norm(np.linalg.pinv(m, 1e-10)) for m in H]
        found = one.machine.local_indices(pose[0])
        for k, names in enumerate((("eta_omega", "eta_alpha"), ("eta_v", "eta_a"))):
            bent = np.linalg.norm(slices[3 * k : 3 * k + 3])
            assert found[names[0]] == pytest.approx(1.0 / kappa[k], rel=1e-11)
            expected = 1.0 / (0.02 * kappa[k] + (0.02**2 + 2.0 * 0.02) * bent)  # eqs (2) and (3)
            assert found[names[1]] == pytest.approx(expected, rel=1e-8)


def test_no_index_exceeds_what_frobenius_norms_allow(printed: Pair) -> None:
    poses = lattice()[::11]
    found = printed.machine.local_indices(poses)
    reached = np.isfinite(found["eta_omega"])
    assert reached.sum() > 500
    for name, most in (("eta_omega", 1 / 3), ("eta_v", 1 / 3), ("eta_F", 1 / 6)):
        assert 0.0 < found[name][reached].max() <= most + 1e-15
    # 1/K = 1 can't be had: K = 0.02 K_omega + 0.0404 times at least sqrt(3) times 5
    assert found["eta_alpha"][reached].max() < 1.0 / (0.06 + 0.0404 * 5.0 * np.sqrt(3.0))


# Symmetries and units -----------------------------------------------------------------------------


def test_the_mirror_image_has_the_same_indices(pairs: list[Pair], rng: np.random.Generator) -> None:
    (mirror,) = pairs[0].machine.symmetries()
    for one in pairs:
        poses = one.poses(rng, 50)
        found, image = (one.machine.local_indices(p) for p in (poses, mirror.pose(poses)))
        for name in NAMES:
            np.testing.assert_allclose(image[name], found[name], rtol=1e-12, atol=1e-10)


def test_a_third_of_a_turn_leaves_four_indices(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs:
        poses = one.poses(rng, 50)
        found, turned = (one.machine.local_indices(p) for p in (poses, turned_by_a_third(poses)))
        for name in TURNED_ALIKE:
            np.testing.assert_allclose(turned[name], found[name], rtol=1e-11)
        for name in ("eta_alpha", "eta_a"):  # slices along x and y mix
            assert np.median(np.abs(turned[name] / found[name] - 1.0)) > 1e-3


def test_four_indices_have_no_unit_of_length(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs:
        poses = one.poses(rng, 50)
        larger = poses * np.repeat([10.0, 1.0], 3)
        model = one.model
        lengths = {name: 10.0 * getattr(model, name) for name in ("L", "R", "r_B", "tool")}
        scaled = pair(**lengths, phi_A=model.phi_A, phi_C=model.phi_C).machine
        found = one.machine.local_indices(poses)
        for name, value in scaled.local_indices(larger, 0.1).items():
            factor = 1e3 if name == "det" else 1.0
            np.testing.assert_allclose(value, factor * found[name], rtol=1e-11, atol=1e-12)
        other = one.machine.local_indices(poses, 0.1)
        for name in NAMES:
            same = np.allclose(other[name], found[name], rtol=1e-12, atol=0.0)
            assert same == (name in FREE_OF_UNITS), name


def test_z_does_not_matter(printed: Pair, rng: np.random.Generator) -> None:
    poses = printed.poses(rng, 20)
    lifted = printed.machine.local_indices(poses + 0.5 * np.eye(6)[2])
    for name, value in printed.machine.local_indices(poses).items():
        np.testing.assert_array_equal(lifted[name], value)


# Singular slices ----------------------------------------------------------------------------------


def on_the_mirror_plane(poses: np.ndarray) -> np.ndarray:
    return poses * [0.0, 1.0, 1.0, 1.0, 0.0, 0.0]


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("place", [on_the_mirror_plane, np.zeros_like], ids=["plane", "home"])
def test_slices_lose_rank_at_home_and_on_the_mirror_plane(
    pairs: list[Pair], rng: np.random.Generator, place: Callable, convention: str
) -> None:
    for one in pairs:
        poses = place(one.poses(rng, 20))
        least = np.linalg.svd(one.model.slices(poses, convention), compute_uv=False)
        for part in (least[:, :3], least[:, 3:]):
            assert (part[..., 4] / part[..., 0]).min(axis=1).max() < 1e-13
        found = one.machine.local_indices(poses, convention=convention)
        np.testing.assert_allclose([found["eta_alpha"], found["eta_a"]], 0.0, atol=1e-10)
        for name in TURNED_ALIKE:
            assert (found[name] > 0.0).all()


def slice_conditions(H: np.ndarray) -> np.ndarray:
    """1 / (|H_k| |H_k^+|) (6,) as ours has it, from slices (6, 5, 5)."""
    zero, one = (0.0,) * 5, (1.0, 0.0, 0.0, 0.0, 0.0)
    found = []
    for k, matrix in enumerate(H):
        entries = tuple((0.5 * (matrix + matrix.T))[UPPER].tolist())
        if k < 3:  # its skew part is of rank two: (a b^T - b a^T) / 2, b through the first axis
            a, b = skew_vectors(0.5 * (matrix - matrix.T))
            found.append(turning_slice(entries, a, b, 1.0))
        else:
            found.append(moving_slice(entries))
    assert squared(one)[0] == 1.0
    assert turning_slice(squared(one), zero, zero, 1.0)[1] == np.inf  # of rank one
    np.testing.assert_allclose([n for n, _ in found], (H**2).sum(axis=(1, 2)), rtol=1e-13)
    return np.array([k**-0.5 for _, k in found])


def skew_vectors(skew: np.ndarray) -> tuple[tuple, tuple]:
    """Vectors a and b of a skew matrix (a b^T - b a^T) / 2 of rank two."""
    u, s, v = np.linalg.svd(skew)
    a, b = 2.0 * s[0] * u[:, 0], v[0]
    np.testing.assert_allclose(0.5 * (np.outer(a, b) - np.outer(b, a)), skew, atol=1e-12 * s[0])
    return tuple(a.tolist()), tuple(b.tolist())


def rounding(H: np.ndarray) -> np.ndarray:
    """By how much cofactors may miss 1 / (|H| |H^+|) (n,): what rounding leaves of them."""
    sigma = np.linalg.svd(H, compute_uv=False)
    share = sigma[..., 1:4].prod(axis=-1) / sigma[..., 0] ** 3
    return 4e-15 / np.maximum(share, 1e-13)


def test_all_six_slices_of_a_pose(pairs: list[Pair], rng: np.random.Generator) -> None:
    for one in pairs[::2]:
        poses = one.poses(rng, 6)
        poses[3:] = (
            on_the_mirror_plane(poses[3:]) + 10.0 ** -rng.integers(3, 12, (3, 1)) * poses[3:]
        )
        for H in one.model.slices(poses):
            exact = 1.0 / condition(H)
            assert (np.abs(slice_conditions(H) - exact) <= rounding(H)).all()


@pytest.mark.parametrize("spread", [1e-1, 1e-4, 1e-8, 1e-12, 0.0])
@pytest.mark.parametrize("small", [1, 2])
def test_slices_of_any_rank(rng: np.random.Generator, spread: float, small: int) -> None:
    turns = ortho_group.rvs(5, size=60, random_state=1)
    for k in range(0, 60, 2):
        values = rng.uniform(0.2, 1.0, 5) * rng.choice([-1.0, 1.0], 5)
        values[:small] *= spread
        matrix = 10.0 ** rng.uniform(-3.0, 4.0) * (turns[k] * values) @ turns[k].T
        entries = tuple((0.5 * (matrix + matrix.T))[UPPER].tolist())
        norm, square = moving_slice(entries)
        assert norm == pytest.approx((matrix**2).sum(), rel=1e-13)
        with np.errstate(divide="ignore"):
            exact = 1.0 / condition(matrix)
        assert abs(square**-0.5 - exact) <= rounding(matrix)
        a, b = rng.normal(size=(2, 5)) * np.abs(matrix).max()
        bent = matrix + 0.5 * (np.outer(a, b) - np.outer(b, a))
        norm, square = turning_slice(entries, tuple(a.tolist()), tuple(b.tolist()), 1.0)
        assert norm == pytest.approx((bent**2).sum(), rel=1e-13)
        assert abs(square**-0.5 - 1.0 / condition(bent)) <= rounding(bent)


# Singular poses -----------------------------------------------------------------------------------


def next_to_singular(machine: Pus6, rng: np.random.Generator) -> np.ndarray:
    """Poses (n, 6) between which and the next number det G^-1 changes its sign."""

    def det(poses: np.ndarray) -> np.ndarray:
        return machine.local_indices(poses)["det"]

    wide = np.array([0.18, 0.2, 0.0, 0.9, 1.2, 1.0])
    here, there = wide * rng.uniform(-1.0, 1.0, (2, 6000, 6))
    kept = det(here) * det(there) < 0.0
    here, there = here[kept], there[kept]
    for _ in range(60):
        middle = 0.5 * (here + there)
        value = det(middle)
        same = (value * det(here) > 0.0)[:, None]
        here, there = np.where(same, middle, here), np.where(same, there, middle)
        kept = np.isfinite(value)
        here, there = here[kept], there[kept]
    assert len(here) > 50
    return here


def test_indices_vanish_at_a_direct_singularity(printed: Pair, rng: np.random.Generator) -> None:
    poses = next_to_singular(printed.machine, rng)
    found = printed.machine.local_indices(poses)
    for name in NAMES:
        assert (found[name] >= 0.0).all(), name
        assert found[name].max() < 1e-14, name


@pytest.mark.parametrize("away", 10.0 ** -np.arange(2.0, 13.0))
def test_indices_next_to_a_direct_singularity(
    printed: Pair, rng: np.random.Generator, away: float
) -> None:
    poses = next_to_singular(printed.machine, rng)
    poses += away * rng.normal(size=poses.shape) * [1, 1, 0, 1, 1, 1]
    poses = poses[np.isfinite(printed.model.sliders(poses)).all(axis=1)]
    found, expected = printed.machine.local_indices(poses), printed.model.local(poses)
    share = np.abs(printed.model.aspect(poses))
    for name in TURNED_ALIKE:  # to the digits that rounding leaves of det G^-1
        assert (np.abs(found[name] / expected[name] - 1.0) * share).max() < 1e-12, name
    for name in ("eta_alpha", "eta_a"):  # 0 where rounding hides the rank of slices
        np.testing.assert_allclose(found[name], expected[name], rtol=0.0, atol=3e-4)
