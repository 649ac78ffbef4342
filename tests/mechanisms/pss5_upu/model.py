"""A second model of the 5-PSS/UPU: limb screws, numpy's inverses and singular values, one pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Model:
    """Lengths in m, azimuths of platform ``q`` and base ``b`` joints (5,) and theta in degrees."""

    r: float
    R: float
    L: float
    theta: float
    q: np.ndarray
    b: np.ndarray
    upu: bool

    @property
    def feet(self) -> np.ndarray:
        angles = np.radians(self.b)
        return self.R * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)

    @property
    def rails(self) -> np.ndarray:
        """W_i = Rz(18 + b) Rx(theta): the rail is its y axis."""
        turns = [Rotation.from_euler("ZX", [b + 90.0, self.theta], degrees=True) for b in self.b]
        return np.array([turn.apply([0.0, 1.0, 0.0]) for turn in turns])

    def alpha(self, pose: np.ndarray) -> float:
        """The yaw whose middle U axes are parallel: s . (p x u) = 0 by bisection."""
        if not self.upu:
            return 0.0

        def twist(a: float) -> float:
            u = Rotation.from_euler("ZYX", [a, pose[3], 0.0]).apply([1.0, 0.0, 0.0])
            return float(np.cross(pose[:3], u)[0])

        low, high = -0.5 * np.pi, 0.5 * np.pi
        rising = twist(high) > twist(low)
        for _ in range(80):
            middle = 0.5 * (low + high)
            if (twist(middle) > 0.0) == rising:
                high = middle
            else:
                low = middle
        return 0.5 * (low + high)

    def rotation(self, pose: np.ndarray) -> np.ndarray:
        angles = [self.alpha(pose), pose[3], pose[4]]
        return np.asarray(Rotation.from_euler("ZYX", angles).as_matrix())

    def arms(self, pose: np.ndarray) -> np.ndarray:
        angles = np.radians(self.q)
        joints = self.r * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)
        return joints @ self.rotation(pose).T

    def sliders(self, pose: np.ndarray) -> np.ndarray:
        """The smaller root of |p + R a - B - l e| = L."""
        d = pose[:3] + self.arms(pose) - self.feet
        found = []
        for one, rail in zip(d, self.rails, strict=True):
            roots = np.roots([1.0, -2.0 * one @ rail, one @ one - self.L**2])
            found.append(np.nan if np.iscomplex(roots).any() else float(roots.real.min()))
        return np.array(found)

    def rods(self, pose: np.ndarray) -> np.ndarray:
        """Unit vectors from the sliders to the S joints."""
        d = pose[:3] + self.arms(pose) - self.feet
        return (d - self.sliders(pose)[:, None] * self.rails) / self.L

    def constraint(self, pose: np.ndarray) -> np.ndarray:
        """The wrench (force, moment about p) of the UPU limb, or what holds alpha at 0."""
        if not self.upu:
            return np.array([0.0, 0.0, 0.0, np.sin(pose[3]), 0.0, np.cos(pose[3])])
        s, u = np.array([1.0, 0.0, 0.0]), self.rotation(pose)[:, 0]
        return np.concatenate([np.cross(u, s), np.cross(u, np.cross(s, pose[:3]))])

    def screws(self, pose: np.ndarray) -> np.ndarray:
        """[G; c] (6, 6) of (v, omega)."""
        f = self.rods(pose)
        rods = np.concatenate([f, np.cross(self.arms(pose), f)], axis=1)
        return np.concatenate([rods, self.constraint(pose)[None]])

    def cosines(self, pose: np.ndarray) -> np.ndarray:
        return np.einsum("ij,ij->i", self.rods(pose), self.rails)

    def jacobian(self, pose: np.ndarray) -> np.ndarray:
        """(v, omega) per slider rate (6, 5)."""
        return np.linalg.inv(self.screws(pose))[:, :5] * self.cosines(pose)

    def rates(self, pose: np.ndarray) -> np.ndarray:
        """(vx, vy, vz, gamma', beta') per slider rate (5, 5): the page's rates of any alpha."""
        J, a = self.jacobian(pose), self.alpha(pose)
        beta = -np.sin(a) * J[3] + np.cos(a) * J[4]
        gamma = (np.cos(a) * J[3] + np.sin(a) * J[4]) / np.cos(pose[3])
        return np.stack([*J[:3], gamma, beta])

    def local(self, pose: np.ndarray) -> np.ndarray:
        """K_v, K_w, K_lambda, K_eta."""
        rates = self.rates(pose)
        v, w = (np.linalg.svd(part, compute_uv=False) for part in (rates[:3], rates[3:]))
        f, arms = self.rods(pose), self.arms(pose)
        eta = []
        for i, twist in enumerate(np.linalg.inv(self.screws(pose)).T[:5]):
            speed = twist[:3] + np.cross(twist[3:], arms[i])
            eta.append(abs(f[i] @ speed) / np.linalg.norm(speed))
        return np.array([v[2] / v[0], w[1] / w[0], self.cosines(pose).min(), min(eta)])

    def singular_values(self, pose: np.ndarray) -> np.ndarray:
        """Of the limbs' system in (v, r omega), the constraint scaled to a unit couple."""
        system = self.screws(pose) / np.array([1.0] * 3 + [self.r] * 3)
        system[5] /= np.linalg.norm(system[5, 3:])
        return np.asarray(np.linalg.svd(system, compute_uv=False))

    def lines(self, pose: np.ndarray) -> np.ndarray:
        """The ends (5, 2, 3) of the rods."""
        a = pose[:3] + self.arms(pose)
        return np.stack([a - self.L * self.rods(pose), a], axis=1)
