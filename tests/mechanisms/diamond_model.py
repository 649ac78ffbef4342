"""A model of the Diamond that shares no formula with ours: loops that close, Lagrange multipliers.

Four equations say that the two limbs' loops close; Newton's method solves them, with complex poses
too. Rates follow from complex steps through the same equations, torques from the equations of
motion of two arms and a point mass with one multiplier a constraint, indices from numpy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

STEP = 1e-30  # of a complex step
SIDES = np.array([1.0, -1.0])


def along(angles: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 2) of angles (...), complex ones too."""
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def across(angles: np.ndarray) -> np.ndarray:
    """Their derivatives (..., 2)."""
    return np.stack([-np.sin(angles), np.cos(angles)], axis=-1)


@dataclass(frozen=True)
class Model:
    """Lengths in m, inertia in kg m^2, mass in kg, first moment in kg m."""

    e: float
    l1: float
    l2: float
    I_A: float
    m: float
    mr_A: float  # noqa: N815 (symbol m_A r_A)
    gravity: float = 9.81

    @property
    def drives(self) -> np.ndarray:
        return np.stack([SIDES * self.e, 0.0 * SIDES], axis=-1)

    # Geometry -------------------------------------------------------------------------------------

    def closure(self, angles: np.ndarray, poses: np.ndarray) -> np.ndarray:
        """By how much the loops (n, limb, 2) of angles (n, limb, arm and rod) don't close."""
        tips = self.drives + self.l1 * along(angles[..., 0]) + self.l2 * along(angles[..., 1])
        return tips - poses[:, None, :]

    def slopes(self, angles: np.ndarray) -> np.ndarray:
        """Derivative (n, limb, 2, arm and rod) of the closure."""
        lengths = np.array([self.l1, self.l2])
        return np.moveaxis(lengths[:, None] * across(angles), -1, -2)

    def angles(self, poses: np.ndarray) -> np.ndarray:
        """Angles (n, limb, arm and rod) at poses (n, 2), the elbows on the outer sides."""
        found = self._start(poses.real) + 0.0 * poses[:, None, :1]
        for _ in range(15):
            missing = self.closure(found, poses)[..., None]
            found = found - np.linalg.solve(self.slopes(found), missing)[..., 0]
        return found

    def _start(self, poses: np.ndarray) -> np.ndarray:
        """The best of 181 arm angles on the outer side of the line from drive to platform."""
        lines = poses[:, None, :] - self.drives
        direct = np.arctan2(lines[..., 1], lines[..., 0])
        arms = direct[..., None] + SIDES[:, None] * np.linspace(1e-3, np.pi - 1e-3, 181)
        rods = lines[..., None, :] - self.l1 * along(arms)
        best = np.abs(np.linalg.norm(rods, axis=-1) - self.l2).argmin(axis=-1)[..., None]
        arm = np.take_along_axis(arms, best, axis=-1)[..., 0]
        rod = lines - self.l1 * along(arm)
        return np.stack([arm, np.arctan2(rod[..., 1], rod[..., 0])], axis=-1)

    def jacobian(self, poses: np.ndarray) -> np.ndarray:
        """Derivative (n, limb, 2) of the arm angles by the pose."""
        steps = [self.angles(poses + 1j * STEP * d)[..., 0].imag / STEP for d in np.eye(2)]
        return np.stack(steps, axis=-1)

    def motion(
        self, poses: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles, their rates and accelerations (n, limb, arm and rod)."""
        angles = self.angles(poses)
        slopes = self.slopes(angles)
        rates = np.linalg.solve(slopes, self._limbs(velocities))[..., 0]
        bend = self.slopes(angles + 1j * STEP * rates).imag / STEP @ rates[..., None]
        return angles, rates, np.linalg.solve(slopes, self._limbs(accelerations) - bend)[..., 0]

    @staticmethod
    def _limbs(vectors: np.ndarray) -> np.ndarray:
        return np.repeat(vectors[:, None, :, None], 2, axis=1)

    # Dynamics -------------------------------------------------------------------------------------

    def torques(
        self, poses: np.ndarray, velocities: np.ndarray, accelerations: np.ndarray
    ) -> np.ndarray:
        """Drive torques (n, limb) of M q'' + dV/dq = S tau + C^T lambda.

        q is arm and rod of limb 1, of limb 2, x, y; the rods have no mass; C (n, 4, 6).
        """
        angles, _, bends = self.motion(poses, velocities, accelerations)
        n, masses = len(poses), np.array([self.I_A, 0.0, self.I_A, 0.0, self.m, self.m])
        moved = masses * np.concatenate([bends.reshape(n, 4), accelerations], axis=1)
        weights = np.zeros((n, 6))
        weights[:, [0, 2]] = self.mr_A * self.gravity * np.cos(angles[..., 0])
        weights[:, 5] = self.m * self.gravity
        constraints = np.zeros((n, 4, 6))
        constraints[:, :2, :2], constraints[:, 2:, 2:4] = np.moveaxis(self.slopes(angles), 1, 0)
        constraints[:, :, 4:] = -np.tile(np.eye(2), (2, 1))
        unknown = np.zeros((n, 6, 6))
        unknown[:, 0, 0] = unknown[:, 2, 1] = 1.0
        unknown[:, :, 2:] = constraints.swapaxes(1, 2)
        return np.linalg.solve(unknown, (moved + weights)[..., None])[:, :2, 0]

    def torque_rows(self, poses: np.ndarray) -> np.ndarray:
        """What unit accelerations add to the torques at rest (n, limb, 2)."""
        still = np.zeros_like(poses)
        holding = self.torques(poses, still, still)
        return np.stack(
            [self.torques(poses, still, still + d) - holding for d in np.eye(2)], axis=-1
        )

    # Indices --------------------------------------------------------------------------------------

    def local(self, poses: np.ndarray) -> dict[str, np.ndarray]:
        """Name -> index (n,) at poses (n, 2)."""
        arms, rods = np.moveaxis(self.angles(poses), -1, 0)
        sigma = np.linalg.svd(self.l1 * self.jacobian(poses), compute_uv=False)
        return {
            "sigma_max": sigma[:, 0],
            "sigma_min": sigma[:, 1],
            "condition": sigma[:, 0] / sigma[:, 1],
            "sin_alpha": np.sin(rods[:, 1] - rods[:, 0]),
            "sin_beta": np.abs(np.sin(rods - arms)).min(axis=1),
            "tau": np.linalg.norm(self.torque_rows(poses), axis=-1).max(axis=1),
        }

    def largest(self, name: str, corners: np.ndarray) -> float:
        """The largest local index over a rectangle given by two corners (2, 2), refined.

        By a descent from each edge's best sample and from the inside's.
        """
        low, high = corners
        x, y = np.meshgrid(np.linspace(low[0], high[0], 81), np.linspace(low[1], high[1], 5))
        grid = np.stack([x, y], axis=-1)
        values = self.local(grid.reshape(-1, 2))[name].reshape(x.shape)
        starts = [part[np.unravel_index(v.argmax(), v.shape)] for part, v in _parts(grid, values)]
        found = [
            minimize(
                lambda p: -float(self.local(np.array([p]))[name][0]), start,
                bounds=list(zip(low, high, strict=True)), method="Nelder-Mead",
                options={"xatol": 1e-8, "fatol": 1e-12},
            ).fun
            for start in starts
        ]  # fmt: skip
        return -float(min(found))


def _parts(grid: np.ndarray, values: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    edges = [(grid[0], values[0]), (grid[-1], values[-1])]
    return [*edges, (grid[1:-1].reshape(-1, 2), values[1:-1].ravel())]
