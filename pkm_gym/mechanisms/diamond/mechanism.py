"""The Diamond as a Mechanism: dimensions in SI and the kinematic verbs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pkm_gym.core.compile import BatchKernel
from pkm_gym.core.mechanism import IndexMap, Link, Mechanism, Symmetry, dimension
from pkm_gym.core.sampling import rectangle
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.dynamics import inverse_dynamics_batch
from pkm_gym.mechanisms.diamond.indices import local_indices_batch
from pkm_gym.mechanisms.diamond.kinematics import (
    forward_kinematics_batch,
    hessian_batch,
    inverse_jacobian_batch,
    inverse_kinematics_batch,
)

LOCAL_INDICES = ("sigma_max", "sigma_min", "sin_alpha", "sin_beta", "tau")


@dataclass(frozen=True, slots=True)
class Diamond(Mechanism):
    """A Diamond with its workspace and lumped inertia.

    Pose: (x, y) of the platform, m, y < 0 below the drive axes. Joints: arm angles from +x,
    counter-clockwise, rad. The twist is the platform's velocity, m/s.
    """

    e: float = dimension("m", "half the drives' distance less half the platform's", low=0.0)
    l1: float = dimension("m", "proximal arm")
    l2: float = dimension("m", "distal rod")
    H: float = dimension("m", "from the drives' axes down to the workspace's top edge")
    b: float = dimension("m", "width of the workspace")
    h: float = dimension("m", "height of the workspace")
    I_A: float = dimension("kg m^2", "inertia of arm, elbow and rod share about the drive axis")
    m: float = dimension("kg", "moving mass: platform, rod share, payload")
    mr_A: float = dimension("kg m", "first moment of arm, elbow and rod share")  # noqa: N815 (symbol m_A r_A)

    pose_names = ("x", "y")
    twist_names = ("vx", "vy")
    joint_names = ("theta_1", "theta_2")
    twin_module = "pkm_gym.mechanisms.diamond.twin"

    @property
    def lam_H(self) -> float:  # noqa: N802 (symbol of the paper)
        """H over l1."""
        return self.H / self.l1

    def inverse_kinematics(self, pose: FloatArray) -> FloatArray:
        """Return the arm angles (..., 2), rad, elbows outwards; NaN out of reach. Eq. (2)."""
        return self._batch(inverse_kinematics_batch, pose, (2,))

    def forward_kinematics(self, joints: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Return the pose (..., 2), m, of the lower assembly mode; NaN where the rods do not meet.

        ``near`` is not needed: the mode fixes the pose.
        """
        del near
        return self._batch(forward_kinematics_batch, joints, (2,))

    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return J of eq. (4), (..., 2, 2), 1/m: arm rates = J @ velocity."""
        return self._batch(inverse_jacobian_batch, pose, (2, 2))

    def jacobian(self, pose: FloatArray) -> FloatArray:
        """Return (..., 2, 2), m: velocity = jacobian @ arm rates."""
        inverse = self.inverse_jacobian(pose)
        swapped = inverse[..., ::-1, ::-1].swapaxes(-1, -2) * np.array([[1.0, -1.0], [-1.0, 1.0]])
        determinant = (
            inverse[..., 0, 0] * inverse[..., 1, 1] - inverse[..., 0, 1] * inverse[..., 1, 0]
        )
        return np.asarray(swapped / determinant[..., None, None])

    def twist(self, pose: FloatArray, pose_rate: FloatArray) -> FloatArray:
        """Return the velocity, which is the rate of the pose."""
        del pose
        return np.array(pose_rate, dtype=float)

    def symmetries(self) -> tuple[Symmetry, ...]:
        """Return the mirror between the drives."""
        return (
            Symmetry(
                "mirrored in x = 0",
                lambda pose: np.asarray(pose, dtype=float) * [-1.0, 1.0],
                lambda joints: np.pi - np.asarray(joints, dtype=float)[..., ::-1],
            ),
        )

    def hessian(self, pose: FloatArray) -> FloatArray:
        """Return K (..., 2, 2, 2), 1/m^2: arm acceleration_i = J_i a + v^T K_i v. Eq. (7)."""
        return self._batch(hessian_batch, pose, (2, 2, 2))

    def inverse_dynamics(
        self, pose: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        """Return the drive torques (..., 2), N m, with gravity and velocity terms. Eq. (9)."""
        parts = np.broadcast_arrays(*map(np.asarray, (pose, velocity, acceleration)))
        states = np.concatenate(parts, axis=-1)
        inertia = (self.I_A, self.m, self.mr_A)
        return self._batch(inverse_dynamics_batch, states, (2,), inertia, length=6)

    def local_indices(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return sigma_max, sigma_min, sin_alpha, sin_beta, tau at poses (..., 2): name -> (...).

        ``tau`` is the larger drive torque per unit acceleration, N m per m/s^2, eq. (12).
        """
        table = self._batch(local_indices_batch, pose, (5,), (self.I_A, self.m))
        return {name: table[..., k] for k, name in enumerate(LOCAL_INDICES)}

    def links(self, pose: FloatArray) -> tuple[Link, ...]:
        """Return base, arms and rods, and the platform as a point, at a pose (2,)."""
        x, y = np.asarray(pose, dtype=float)
        drives = np.array([[self.e, 0.0], [-self.e, 0.0]])
        platform = np.array([x, y])
        angles = self.inverse_kinematics(platform)
        elbows = drives + self.l1 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return (
            Link("base", drives[::-1]),
            *(Link("rod", np.stack([elbow, platform])) for elbow in elbows),
            *(Link("arm", np.stack(ends)) for ends in zip(drives, elbows, strict=True)),
            Link("platform", platform[None]),
        )

    def workspace(self) -> FloatArray:
        """Return the rectangle's outline (5, 2), m."""
        right, top, bottom = 0.5 * self.b, -self.H, -self.H - self.h
        corners = [(-right, bottom), (right, bottom), (right, top), (-right, top), (-right, bottom)]
        return np.array(corners)

    def search_poses(self) -> FloatArray:
        """Return poses (n, 2), m, all over the workspace."""
        return self.workspace_grid(161, 41).reshape(-1, 2)

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, 2), m, from the bottom left corner to the top right one."""
        low, high = (-0.5 * self.b, -self.H - self.h), (0.5 * self.b, -self.H)
        return rectangle(low, high, columns, rows)

    def sample_poses(self) -> FloatArray:
        """Return the middle of the workspace and two opposite corners (3, 2), m."""
        right, top, bottom = 0.5 * self.b, -self.H, -self.H - self.h
        return np.array([(0.0, 0.5 * (top + bottom)), (-right, bottom), (right, top)])

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return torque, singular values, condition and transmission angles at poses (..., 2)."""
        local = self.local_indices(pose)
        larger, smaller = local["sigma_max"], local["sigma_min"]
        alpha, beta = (_angle(local[name]) for name in ("sin_alpha", "sin_beta"))
        return {
            "tau_G": IndexMap("tau", "N m/(m/s^2)", "max", local["tau"]),
            "sigma_max": IndexMap("sigma_max", "", "max", larger),
            "sigma_min": IndexMap("sigma_min", "", "min", smaller),
            "condition": IndexMap("condition", "", "max", larger / smaller),
            "alpha_min": IndexMap("alpha", "rad", "min", alpha),
            "beta_min": IndexMap("beta", "rad", "min", beta),
            "sin_alpha": IndexMap("sin_alpha", "", "min", local["sin_alpha"]),
        }

    def _batch(
        self,
        kernel: BatchKernel | Callable[..., None],
        rows: FloatArray,
        shape: tuple[int, ...],
        more: tuple[Any, ...] = (),
        length: int = 2,
    ) -> FloatArray:
        rows = np.asarray(rows, dtype=float)
        if rows.ndim == 0 or rows.shape[-1] != length:
            raise ValueError(f"expected an array of shape (..., {length}), got {rows.shape}")
        flat = np.ascontiguousarray(rows.reshape(-1, length))
        out = np.empty((len(flat), *shape))
        kernel(0.05 * len(flat), flat, self.e, self.l1, self.l2, *more, out)
        return out.reshape(rows.shape[:-1] + shape)


def _angle(sine: FloatArray) -> FloatArray:
    return np.arcsin(np.clip(sine, -1.0, 1.0))
