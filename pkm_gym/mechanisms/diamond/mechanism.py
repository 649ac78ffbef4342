"""The Diamond as a Mechanism: dimensions in SI and the kinematic verbs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from pkm_gym.core.compile import BatchKernel
from pkm_gym.core.mechanism import Mechanism, dimension
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
