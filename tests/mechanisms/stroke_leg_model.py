"""A model of the stroke-amplification leg that shares no formula with ours: loops that close.

Ten equations say that the double rhombus and both cylinders' loops close. Newton's method with
complex steps solves them; derivatives follow from the same equations, indices from numpy on dense
samples.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

STEP = 1e-30  # of a complex step
DIRECTIONS = ("beta", "alpha", "fj", "eh", "ji", "hi", "ab", "cd")  # of links, rad
UNKNOWNS = (*DIRECTIONS, "l2", "l4")


def along(angle: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 2), x and z, of angles (...), complex ones too."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def complex_step(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Derivative (..., out, in) of a function of (..., in)."""
    units = np.eye(at.shape[-1])
    return np.stack([function(at + 1j * STEP * e).imag / STEP for e in units], axis=-1)


def size(vector: np.ndarray) -> np.ndarray:
    """Length (...) of vectors (..., 2), analytic."""
    return np.sqrt((vector * vector).sum(axis=-1))


def splined(points: np.ndarray, weights: np.ndarray, *ends: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of a Gauss rule on (-1, 1) put on every piece between ``ends``."""
    pieces = list(itertools.pairwise(ends))
    nodes = [0.5 * (a + b) + 0.5 * (b - a) * points for a, b in pieces]
    return np.concatenate(nodes), np.concatenate([0.5 * (b - a) * weights for a, b in pieces])


@dataclass(frozen=True)
class Model:
    """Lengths in any unit, angles in rad."""

    l1: float
    l3: float
    l6: float
    phi: float
    th3: float
    gamma: float
    l5: float
    l: float  # noqa: E741 (the paper's symbol)

    @property
    def C(self) -> np.ndarray:  # noqa: N802 (the point)
        return np.array([self.l6, 0.0])

    @property
    def B(self) -> np.ndarray:  # noqa: N802 (the point)
        return self.C + self.l3 * along(np.array(np.pi - self.th3))

    # Loops ----------------------------------------------------------------------------------------

    def gaps(self, unknowns: np.ndarray, foot: np.ndarray) -> np.ndarray:
        """By how much (..., 10) the loops fail to close."""
        q = dict(zip(UNKNOWNS, np.moveaxis(unknowns, -1, 0), strict=True))
        u = {name: along(q[name]) for name in DIRECTIONS}
        F, E = self.l * u["beta"], self.l * u["alpha"]
        J, H = F + 2.0 * self.l * u["fj"], E + 2.0 * self.l * u["eh"]
        A, D = self.l1 * along(q["beta"] - self.phi), self.l5 * along(q["alpha"] - self.gamma)
        return np.concatenate(
            [
                F + self.l * u["fj"] - E - self.l * u["eh"],  # both bars' hinge G
                J + self.l * u["ji"] - foot,
                H + self.l * u["hi"] - foot,
                A + q["l2"][..., None] * u["ab"] - self.B,
                D + q["l4"][..., None] * u["cd"] - self.C,
            ],
            axis=-1,
        )

    def home(self) -> tuple[np.ndarray, np.ndarray]:
        """Unknowns (10,) and foot (2,) with all rhombi square and the leg straight down."""
        left, right = 1.25 * np.pi, 1.75 * np.pi  # of links that point down, to -x and to x
        A, D = (
            self.l1 * along(np.array(left - self.phi)),
            self.l5 * along(np.array(right - self.gamma)),
        )
        rods = [self.B - A, self.C - D]
        directions = [left, right, right, left, left, right]
        directions += [np.arctan2(z, x) for x, z in rods]
        foot = np.array([0.0, -4.0 * self.l * np.sqrt(0.5)])
        return np.array([*directions, *(size(rod) for rod in rods)]), foot

    def solve(self, foot: np.ndarray, steps: int = 6) -> np.ndarray:
        """Unknowns (n, 10) at feet (n, 2), followed from home."""
        start, home = self.home()
        unknowns = np.broadcast_to(start, (len(foot), 10))
        for t in np.linspace(0.0, 1.0, steps + 1)[1:]:
            goal = home + t * (foot - home)
            for _ in range(4 if t < 1.0 else 8):
                slopes = complex_step(lambda q, goal=goal: self.gaps(q, goal), unknowns)
                missed = self.gaps(unknowns, goal)
                unknowns = unknowns - np.linalg.solve(slopes, missed[..., None])[..., 0]
        assert np.abs(self.gaps(unknowns, foot)).max() < 1e-13
        return unknowns

    def slopes(self, unknowns: np.ndarray, foot: np.ndarray) -> np.ndarray:
        """Derivative (n, 10, 2) of the unknowns by the foot."""
        by_unknowns = complex_step(lambda q: self.gaps(q, foot), unknowns)
        by_foot = complex_step(lambda p: self.gaps(unknowns + 0j, p), foot)
        return -np.linalg.solve(by_unknowns, by_foot)

    def rates(self, foot: np.ndarray) -> np.ndarray:
        """The inverse Jacobian (n, 2, 2): the cylinders' lengths by the foot."""
        return self.slopes(self.solve(foot), foot)[:, 8:]

    def feet(self, lengths: np.ndarray) -> list[np.ndarray]:
        """All feet (2,) of two cylinder lengths with the rhombi not folded through."""
        turn = np.linspace(-np.pi, np.pi, 721) + 1e-4

        def angles(crank: float, pivot: np.ndarray, length: float) -> list[float]:
            def missed(angle: float) -> float:
                return float(np.linalg.norm(crank * along(np.array(angle)) - pivot) - length)

            values = [missed(angle) for angle in turn]
            signs = np.flatnonzero(np.diff(np.sign(values)))
            return [brentq(missed, turn[k], turn[k + 1], xtol=1e-15) for k in signs]

        found = []
        for theta1 in angles(self.l1, self.B, lengths[0]):
            for theta5 in angles(self.l5, self.C, lengths[1]):
                F, E = (
                    self.l * along(np.array(a)) for a in (theta1 + self.phi, theta5 + self.gamma)
                )
                if F[0] * E[1] - F[1] * E[0] > 0.0:  # E counter-clockwise of F
                    found.append(2.0 * (F + E))
        return found

    # Dense samples: theta and varphi (..., 2) -----------------------------------------------------

    def foot(self, opening: np.ndarray) -> np.ndarray:
        F, E = self._upper(opening)
        return 2.0 * self.l * (along(F) + along(E))

    def cranks(self, opening: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A and D (..., 2)."""
        beta, alpha = self._upper(opening)
        return self.l1 * along(beta - self.phi), self.l5 * along(alpha - self.gamma)

    def lengths(self, opening: np.ndarray) -> np.ndarray:
        A, D = self.cranks(opening)
        return np.stack([size(A - self.B), size(D - self.C)], axis=-1)

    def jacobian(self, opening: np.ndarray) -> np.ndarray:
        """J (..., 2, 2) by complex steps in theta and varphi."""
        return complex_step(self.foot, opening) @ np.linalg.inv(complex_step(self.lengths, opening))

    def singular_values(self, opening: np.ndarray) -> np.ndarray:
        return np.linalg.svd(self.jacobian(opening), compute_uv=False)

    def condition(self, opening: np.ndarray) -> np.ndarray:
        largest, least = np.moveaxis(self.singular_values(opening), -1, 0)
        return largest / least

    def turned(self, opening: np.ndarray) -> np.ndarray:
        """Angles (..., 2), rad, by which OA leads OB and OD leads OC, in (-pi, pi]."""
        A, D = self.cranks(opening)
        return np.stack([
            np.arctan2(
                pivot[0] * crank[..., 1] - pivot[1] * crank[..., 0], crank @ pivot
            ) for crank, pivot in ((A, self.B), (D, self.C))
        ], axis=-1)  # fmt: skip

    def gap(self, opening: np.ndarray, points: int = 0) -> np.ndarray:
        """Distance (...) of the segments AB and CD, by clipped least squares along each side.

        With ``points``: the least distance of so many points on either, by brute force.
        """
        A, D = self.cranks(opening)
        if points:
            t = np.linspace(0.0, 1.0, points)[:, None]
            ab = A[..., None, :] + t * (self.B - A)[..., None, :]
            cd = D[..., None, :] + t * (self.C - D)[..., None, :]
            return np.linalg.norm(ab[..., :, None, :] - cd[..., None, :, :], axis=-1).min((-1, -2))
        least = np.full(A.shape[:-1], np.inf)
        ends = ((A, self.B + 0 * A), (self.C + 0 * D, D))
        for (p, q), others in ((ends[0], ends[1]), (ends[1], ends[0])):
            for point in others:
                side = q - p
                t = np.clip(((point - p) * side).sum(-1) / (side * side).sum(-1), 0.0, 1.0)
                least = np.minimum(least, np.linalg.norm(point - p - t[..., None] * side, axis=-1))
        across = np.linalg.solve(
            np.stack([self.B - A, self.C - D], axis=-1), (self.C - A)[..., None]
        )[..., 0]  # where the lines meet, in shares of AB and CD
        return np.where(((across >= 0.0) & (across <= 1.0)).all(axis=-1), 0.0, least)

    def _upper(self, opening: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Angles of OF and OE: both off the axis by theta, which swings by varphi to -x."""
        theta, varphi = np.moveaxis(opening, -1, 0)
        axis = -0.5 * np.pi - varphi
        return axis - theta, axis + theta


def of(
    l1: float, l3: float, l6: float, phi: float, th3: float, gamma: float = 45.0, l5: float = 0.0
) -> Model:
    """A leg of mm and degrees, l5 = l1 unless it is given, l 260 mm."""
    angles = np.radians([phi, th3, gamma]).tolist()
    return Model(1e-3 * l1, 1e-3 * l3, 1e-3 * l6, *angles, 1e-3 * (l5 or l1), 0.26)


def grid(low: float, high: float, swing: float, points: int | tuple[int, int]) -> np.ndarray:
    """Openings (points of theta, points of varphi, 2), rad, corners among them."""
    rows, columns = (points, points) if isinstance(points, int) else points
    axes = np.linspace(low, high, rows), np.linspace(-swing, swing, columns)
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)


def moments(
    model: Model, low: float, high: float, swing: float, *, by_area: bool = False, nodes: int = 100
) -> tuple[float, float]:
    """Mean and standard deviation of the condition number, by Gauss nodes on four parts."""
    rule = np.polynomial.legendre.leggauss(nodes)
    theta, w = splined(*rule, low, 0.25 * np.pi, high)
    varphi, v = splined(*rule, -swing, 0.0, swing)
    opening = np.stack(np.meshgrid(theta, varphi, indexing="ij"), axis=-1)
    weights = np.outer(w * np.sin(2.0 * theta) if by_area else w, v)
    weights /= weights.sum()
    eta = model.condition(opening)
    mean = (weights * eta).sum()
    return float(mean), float(np.sqrt((weights * (eta - mean) ** 2).sum()))
