"""A model of the 3-SPR that shares no formula with ours: a body in SE(3) that six residuals hold.

The platform has a position and a rotation vector; three legs have their lengths and stand square to
the revolute axes. Newton's method with complex steps solves that from the level pose, with no word
of zero torsion; velocities are complex steps of the solution. Azimuths are those of the paper's
eqs (1) to (3), the axes' too.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

STEP = 1e-30  # of a complex step
PHI = np.array([2.0 * np.pi / 3.0, -2.0 * np.pi / 3.0, 0.0])
THETA = np.array([np.pi / 6.0, 5.0 * np.pi / 6.0, np.pi / 2.0])


def flat(angles: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) at azimuths (n,)."""
    return np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=-1)


def dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Product (...) of vectors (..., 3), analytic."""
    return (one * other).sum(axis=-1)


def unit(vector: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) of length 1, analytic."""
    return vector / np.sqrt(dot(vector, vector))[..., None]


def skew(vector: np.ndarray) -> np.ndarray:
    """The matrix (3, 3) that crosses with a vector (3,)."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def turned(vector: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) of a rotation vector (3,), analytic."""
    square = dot(vector, vector)
    if abs(square) < 1e-12:
        sine, cosine = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        angle = np.sqrt(square)
        sine, cosine = np.sin(angle) / angle, (1.0 - np.cos(angle)) / square
    cross = skew(vector)
    return np.eye(3) + sine * cross + cosine * cross @ cross


def complex_step(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Derivative (..., in) of a function of (in,)."""
    units = np.eye(len(at))
    return np.stack([function(at + 1j * STEP * e).imag / STEP for e in units], axis=-1)


def spin_of(rate: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Angular velocity (3,) of a rotation (3, 3) that changes at a rate (3, 3)."""
    cross = rate @ rotation.T
    return np.array([cross[2, 1], cross[0, 2], cross[1, 0]])


@dataclass(frozen=True)
class Model:
    """Lengths in m; a state is r and the rotation vector, (6,)."""

    a: float
    b: float

    @property
    def B(self) -> np.ndarray:  # noqa: N802 (the points)
        return self.b * flat(PHI)

    def parts(self, state: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """r (3,), R (3, 3), A_i - B_i (3, 3) and c_i (3, 3), limb by limb."""
        r, R = state[:3], turned(state[3:])
        return r, R, r + self.a * flat(PHI) @ R.T - self.B, flat(THETA) @ R.T

    def residuals(self, state: np.ndarray, joints: np.ndarray) -> np.ndarray:
        """By how much (6,) the limbs fail to close."""
        _, _, legs, axes = self.parts(state)
        return np.concatenate([dot(legs, legs) - joints * joints, dot(legs, axes)])

    def solved(self, joints: np.ndarray) -> np.ndarray:
        """The state (6,) of legs (3,), in eight steps from the level pose."""
        mean = float(joints.mean())
        state = np.array([0.0, 0.0, np.sqrt(mean**2 - (self.b - self.a) ** 2), 0.0, 0.0, 0.0])
        for share in np.linspace(0.0, 1.0, 9)[1:]:
            goal = mean + share * (joints - mean)
            for _ in range(8):
                slopes = complex_step(lambda x, q=goal: self.residuals(x, q), state)
                state = state - np.linalg.solve(slopes, self.residuals(state, goal))
        assert np.abs(self.residuals(state, joints)).max() < 1e-14
        return state

    def states_rate(self, state: np.ndarray, joints: np.ndarray) -> np.ndarray:
        """How the state changes (6, 3) with the legs."""
        by_state = complex_step(lambda x: self.residuals(x, joints + 0j), state)
        by_joints = complex_step(lambda q: self.residuals(state + 0j, q), joints)
        return -np.linalg.solve(by_state, by_joints)

    def frame(self, limb: int, state: np.ndarray) -> np.ndarray:
        """A limb's axes x along c_i, y, z from B_i to A_i, as columns (3, 3)."""
        _, _, legs, axes = self.parts(state)
        z = unit(legs)[limb]
        return np.stack([axes[limb], np.cross(z, axes[limb]), z], axis=-1)

    def moved(self, joints: np.ndarray, rates: np.ndarray) -> Moved:
        """The machine with legs (3,) that change at rates (3,)."""
        state = self.solved(joints)
        ahead = state + 1j * STEP * (self.states_rate(state, joints) @ rates)
        r, R, legs, axes = self.parts(state)
        omega = spin_of(self.parts(ahead)[1].imag / STEP, R)
        limbs = [spin_of(self.frame(i, ahead).imag / STEP, self.frame(i, state)) for i in range(3)]
        feet, tips = (self.parts(ahead)[k].imag / STEP for k in (2, 3))
        velocity = ahead[:3].imag / STEP
        return Moved(r, R, legs, axes, velocity, omega, np.array(limbs), feet, tips)

    def jacobian(self, joints: np.ndarray) -> np.ndarray:
        """J (3, 3): leg rates = J @ velocity of O_A."""
        state = self.solved(joints)
        return np.linalg.inv(self.states_rate(state, joints)[:3])


@dataclass(frozen=True)
class Moved:
    """Where the machine is and how it moves: positions in m, velocities in m/s and rad/s.

    ``feet`` are the velocities of the A_i, ``tips`` the rates of the c_i, limb by limb.
    """

    r: np.ndarray
    R: np.ndarray
    legs: np.ndarray
    axes: np.ndarray
    v: np.ndarray
    omega: np.ndarray
    limbs: np.ndarray
    feet: np.ndarray
    tips: np.ndarray

    @property
    def along(self) -> np.ndarray:
        """The legs' directions w_i (3, 3)."""
        return unit(self.legs)
