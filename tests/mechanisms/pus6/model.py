"""A model of the 6-PUS that shares no formula with ours: 6x6 matrices, singular values, screws.

Rotations are SciPy's, G is a numerical inverse, H comes from the page's formula or from the screws
of the limbs, the indices from pseudo-inverses, the distances of rods from a search along their
edges. Poses are arrays (n, 6); lengths in any unit.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

COLUMNS = np.repeat([90.0, 210.0, 330.0], 2)
CORNERS = np.array([30.0, 150.0, 150.0, 270.0, 270.0, 30.0])
SIDES = np.array([-1.0, 1.0] * 3)
ACROSS = null_space(np.ones((1, 6)))  # of (1, ..., 1): five slider directions, any basis
PAIRS = tuple(itertools.combinations(range(6), 2))
A = B = 0.02


def around(degrees: np.ndarray, radius: float) -> np.ndarray:
    """Points (6, 3) of a circle."""
    angles = np.radians(degrees)
    return radius * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)


def turned(poses: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3) of poses."""
    return Rotation.from_euler("XYZ", poses[:, 3:]).as_matrix()


def condition(matrices: np.ndarray) -> np.ndarray:
    """Norm times norm of the pseudo-inverse (...) of matrices (..., r, c), all of full rank."""
    sigma = np.linalg.svd(matrices, compute_uv=False)
    with np.errstate(divide="ignore"):
        return np.sqrt((sigma**2).sum(axis=-1) * (sigma**-2.0).sum(axis=-1))


@dataclass(frozen=True)
class Model:
    """Lengths in any unit, angles in deg."""

    L: float
    R: float
    r_B: float = 0.38
    phi_A: float = 15.0
    phi_C: float = 30.0
    tool: float = 0.0

    @cached_property
    def screws(self) -> np.ndarray:
        """Where the screws stand (6, 3), z = 0."""
        return around(COLUMNS + 0.5 * self.phi_A * SIDES, self.r_B)

    @cached_property
    def joints(self) -> np.ndarray:
        """The S joints (6, 3) in the platform, from the tool's tip."""
        points = around(CORNERS - 0.5 * self.phi_C * SIDES, self.R)
        return points + np.array([0.0, 0.0, self.tool])

    @cached_property
    def home(self) -> float:
        """How far a slider is above the tool's tip at home."""
        legs = self.legs(np.zeros((1, 6)))
        return float((legs[0][0, 0] - legs[1][0, 0])[2])

    # Positions ------------------------------------------------------------------------------------

    def legs(self, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Arms and rods (n, 6, 3); a rod is NaN out of reach."""
        arms = np.einsum("nij,kj->nki", turned(poses), self.joints)
        flat = poses[:, None, :2] + arms[..., :2] - self.screws[:, :2]
        with np.errstate(invalid="ignore"):
            drop = np.sqrt(self.L**2 - (flat**2).sum(axis=-1))
        return arms, np.concatenate([flat, -drop[..., None]], axis=-1)

    def sliders(self, poses: np.ndarray) -> np.ndarray:
        """Heights (n, 6) over those of home."""
        arms, rods = self.legs(poses)
        return poses[:, 2:3] + (arms - rods)[..., 2] - self.home

    # Influence coefficients -----------------------------------------------------------------------

    def inverse(self, poses: np.ndarray) -> np.ndarray:
        """G^-1 (n, 6, 6): the velocity of an S joint along its rod is the slider's."""
        arms, rods = self.legs(poses)
        rows = np.concatenate([np.cross(arms, rods), rods], axis=-1)
        return rows / rods[..., 2:]

    def first(self, poses: np.ndarray) -> np.ndarray:
        """G (n, 6, 6)."""
        return np.linalg.inv(self.inverse(poses))

    def second(self, poses: np.ndarray, convention: str = "influence") -> np.ndarray:
        """H (n, 6, 6, 6) from the constancy of the rods' lengths."""
        arms, rods = self.legs(poses)
        G = self.first(poses)
        w = G[:, :3]
        H = np.zeros((len(poses), 6, 6, 6))
        for i in range(6):
            c, rod = arms[:, i], rods[:, i]
            moved = G[:, 3:] - np.einsum("nij,njk->nik", cross_matrix(c), w)
            moved[:, 2, i] -= 1.0
            outer = np.einsum("ni,nj->nij", rod, c)
            middle = np.einsum("ni,ni->n", rod, c)[:, None, None] * np.eye(3)
            middle -= 0.5 * (outer + np.swapaxes(outer, 1, 2))
            Q = np.swapaxes(w, 1, 2) @ middle @ w - np.swapaxes(moved, 1, 2) @ moved
            H += (G[:, :, i] / rod[:, 2:])[..., None, None] * Q[:, None]
        if convention == "influence":
            for k, (a, b) in enumerate(((1, 2), (2, 0), (0, 1))):
                outer = np.einsum("ni,nj->nij", w[:, a], w[:, b])
                H[:, k] += 0.5 * (outer - np.swapaxes(outer, 1, 2))
        return H

    def by_screws(self, pose: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, ...]:
        """G (6, 6) and H (6, 6, 6) from the screws of the limbs P-U-S, any axes of U and S.

        Of joints i < j along a limb, moved at unit rates, the platform's angular acceleration is
        S_i x S_j, its centre's S_i x (S_j x r_j), and that also for j = i and j < i.
        """
        arms, rods = (part[0] for part in self.legs(pose[None]))
        inverse, forms = np.empty((6, 6)), np.empty((6, 6, 6))
        for limb, (c, rod) in enumerate(zip(arms, rods, strict=True)):
            hinge = np.append(unit(rng.normal(size=2)), 0.0)
            across = unit(np.cross(hinge, rod))
            axes = [hinge, across, *Rotation.random(rng=rng).as_matrix()]
            levers = [c - rod, c - rod, c, c, c]  # from the platform's centre to the joints
            coefficients = np.zeros((6, 6))
            coefficients[5, 0] = 1.0  # the slider
            second = np.zeros((6, 6, 6))
            for j, (axis, lever) in enumerate(zip(axes, levers, strict=True), 1):
                coefficients[:, j] = *axis, *np.cross(axis, -lever)
            for i, j in itertools.product(range(1, 6), repeat=2):
                near, far = axes[min(i, j) - 1], axes[max(i, j) - 1]
                second[3:, i, j] = np.cross(near, np.cross(far, -levers[max(i, j) - 1]))
                if i < j:
                    second[:3, i, j] = np.cross(near, far)
            rates = np.linalg.inv(coefficients)  # of the limb's joints for a twist
            inverse[limb] = rates[0]
            forms[limb] = rates.T @ np.tensordot(rates[0], second, 1) @ rates
        G = np.linalg.inv(inverse)
        return G, np.einsum("kr,ai,rab,bj->kij", G, G, forms, G)

    # Indices --------------------------------------------------------------------------------------

    def slices(self, poses: np.ndarray, convention: str = "influence") -> np.ndarray:
        """H (n, 6, 5, 5) in the five directions across (1, ..., 1), whose rank it is."""
        return ACROSS.T @ self.second(poses, convention) @ ACROSS

    def local(
        self, poses: np.ndarray, length: float = 0.01, convention: str = "influence"
    ) -> dict[str, np.ndarray]:
        """1/K (n,) of the six indices, by singular values."""
        G = self.first(poses)
        H = self.slices(poses, convention)
        K_w, K_v = condition(G[:, :3]), condition(G[:, 3:])
        slices = condition(H)
        H_w, H_v = (np.sqrt((part**2).sum(axis=1)) for part in (slices[:, :3], slices[:, 3:]))
        scaled = G * np.repeat([length, 1.0], 3)[:, None]
        norms = np.linalg.norm(H, axis=(-1, -2)) * np.repeat([length**2, length], 3)
        size = np.linalg.norm(scaled, axis=(1, 2))
        back = np.linalg.norm(np.linalg.inv(scaled), axis=(1, 2))
        return {
            "eta_omega": 1.0 / K_w,
            "eta_v": 1.0 / K_v,
            "eta_alpha": 1.0 / (B * K_w + (A * A + 2.0 * A) * H_w),
            "eta_a": 1.0 / (B * K_v + (A * A + 2.0 * A) * H_v),
            "eta_F": 1.0 / (size * back),
            "eta_I": 1.0 / (size + np.linalg.norm(norms, axis=1)),
        }

    # Limits ---------------------------------------------------------------------------------------

    def cones(self, poses: np.ndarray) -> np.ndarray:
        """Angles (n, 6) of the rods to their home directions, in the platform's frame."""
        rods = np.einsum("nji,nkj->nki", turned(poses), self.legs(poses)[1])
        cosine = np.einsum("nki,ki->nk", rods, self.legs(np.zeros((1, 6)))[1][0]) / self.L**2
        return np.arccos(np.minimum(1.0, cosine))

    def tilts(self, poses: np.ndarray) -> np.ndarray:
        """Angles (n, 6) of the rods to the vertical."""
        rods = self.legs(poses)[1]
        return np.arctan2(np.linalg.norm(rods[..., :2], axis=-1), -rods[..., 2])

    def clearance(self, poses: np.ndarray) -> np.ndarray:
        """Least distance (n,) of two rods as segments."""
        arms, rods = self.legs(poses)
        tops = arms - rods
        return np.min([
            segments_apart(tops[:, i], rods[:, i], tops[:, j], rods[:, j]) for i, j in PAIRS
        ], axis=0)  # fmt: skip

    def aspect(self, poses: np.ndarray) -> np.ndarray:
        """det G^-1 (n,) over that of home."""
        home = np.linalg.det(self.inverse(np.zeros((1, 6))))
        with np.errstate(invalid="ignore"):
            return np.linalg.det(self.inverse(poses)) / home

    def limits(self, poses: np.ndarray, z: float) -> dict[str, float]:
        """What the limits are about, the worst of poses in a box of half height z."""
        q = self.sliders(poses)
        rods = self.legs(poses)[1]
        return {
            "reach": float(np.linalg.norm(rods[..., :2], axis=-1).max() / self.L),
            "stroke": float(q.max() - q.min() + 2.0 * z),
            "rod_tilt": float(self.tilts(poses).max()),
            "s_cone": float(self.cones(poses).max()),
            "clearance": float(self.clearance(poses).min()),
            "spacing": float(np.linalg.norm(self.screws[0] - self.screws[1])),
            "aspect": float(self.aspect(poses).min()),
        }


def unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def cross_matrix(vectors: np.ndarray) -> np.ndarray:
    """Matrices (n, 3, 3) of c x, for vectors (n, 3)."""
    return -np.cross(vectors[:, None, :], np.eye(3))


def segments_apart(p: np.ndarray, u: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Least distance (n,) of the segments p + s u and q + t v, s and t in [0, 1].

    The least of the distances from each end to the other segment, or that of the lines where both
    feet of the common normal lie inside.
    """
    found = [
        point_apart(p, q, v), point_apart(p + u, q, v), point_apart(q, p, u),
        point_apart(q + v, p, u),
    ]  # fmt: skip
    normal = np.cross(u, v)
    size = (normal**2).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (np.cross(q - p, v) * normal).sum(axis=-1) / size
        t = (np.cross(q - p, u) * normal).sum(axis=-1) / size
        lines = np.abs(((q - p) * normal).sum(axis=-1)) / np.sqrt(size)
    inside = (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    return np.min([*found, np.where(inside, lines, np.inf)], axis=0)


def point_apart(points: np.ndarray, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Distance (n,) of points to the segments q + t v."""
    t = np.clip(((points - q) * v).sum(axis=-1) / (v * v).sum(axis=-1), 0.0, 1.0)
    return np.linalg.norm(points - q - t[:, None] * v, axis=-1)


# The box and the lattice --------------------------------------------------------------------------


def node_poses(xy: float, tilt: float, spin: float) -> np.ndarray:
    """The levels -, 0, + of x, y and the angles (243, 6)."""
    levels = itertools.product((-1.0, 0.0, 1.0), repeat=5)
    x, y, alpha, beta, gamma = np.array(list(levels)).T
    return np.stack([xy * x, xy * y, 0.0 * x, tilt * alpha, tilt * beta, spin * gamma], axis=-1)


def lattice() -> np.ndarray:
    """The paper's lattice without its levels of z (128,700, 6), m and rad."""
    return np.stack(np.meshgrid(
        np.arange(-18, 19, 4) * 1e-2, np.arange(-11, 22, 4) * 1e-2, [0.0],
        np.radians(np.arange(-54, 55, 12)), np.radians(np.arange(-72, 73, 12)),
        np.radians(np.arange(-60, 61, 12)), indexing="ij",
    ), axis=-1).reshape(-1, 6)  # fmt: skip


def levels_reached(model: Model, poses: np.ndarray) -> np.ndarray:
    """How many of the levels -4, 0, 4 cm (n,) keep all sliders within 17.5 cm down and 11.9 up."""
    q = model.sliders(poses)
    inside = [((q + z >= -0.175) & (q + z <= 0.119)).all(axis=1) for z in (-0.04, 0.0, 0.04)]
    return np.sum(inside, axis=0)
