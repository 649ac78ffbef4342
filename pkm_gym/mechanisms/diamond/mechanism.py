"""The Diamond as a Mechanism: its inertia beside the planar machine's dimensions, its dynamics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pkm_gym.core.mechanism import IndexMap, dimension
from pkm_gym.core.planar import PlanarMachine
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.dynamics import inverse_dynamics_batch
from pkm_gym.mechanisms.diamond.indices import torque_index_batch
from pkm_gym.mechanisms.diamond.kinematics import hessian_batch

ABSENT = -1e-12  # the bound of what may be 0


@dataclass(frozen=True, slots=True)
class Diamond(PlanarMachine):
    """A Diamond with its workspace and lumped inertia: see ``PlanarMachine``, eqs (2) and (4)."""

    I_A: float = dimension("kg m^2", "inertia of arm, elbow and rod share about the drive axis")
    m: float = dimension("kg", "moving mass: platform, rod share, payload")
    mr_A: float = dimension("kg m", "first moment of arm, elbow and rod share")  # noqa: N815 (symbol m_A r_A)
    rod: float = dimension("kg", "mass of one of a limb's two rods", low=ABSENT, default=0.0)
    rod_elbow: float = dimension(
        "kg", "what I_A and mr_A count of it at the elbow", low=ABSENT, default=0.0
    )
    rod_platform: float = dimension("kg", "what m counts of it", low=ABSENT, default=0.0)
    drive_inertia: float = dimension(
        "kg m^2", "what I_A counts of motor and gear", low=ABSENT, default=0.0
    )

    twin_module = "pkm_gym.mechanisms.diamond.twin"

    @property
    def lam_H(self) -> float:  # noqa: N802 (symbol of the paper)
        """H over l1."""
        return self.H / self.l1

    def hessian(self, pose: FloatArray) -> FloatArray:
        """Return K (..., 2, 2, 2), 1/m^2: arm acceleration_i = J_i a + v^T K_i v. Eq. (7)."""
        return self._batch(hessian_batch, pose, (2, 2, 2), *self.lengths)

    def inverse_dynamics(
        self, pose: FloatArray, velocity: FloatArray, acceleration: FloatArray
    ) -> FloatArray:
        """Return the drive torques (..., 2), N m, with gravity and velocity terms. Eq. (9)."""
        parts = np.broadcast_arrays(*map(np.asarray, (pose, velocity, acceleration)))
        states = np.concatenate(parts, axis=-1)
        inertia = (self.I_A, self.m, self.mr_A)
        return self._batch(inverse_dynamics_batch, states, (2,), *self.lengths, *inertia, length=6)

    def torque_rows(self, pose: FloatArray) -> FloatArray:
        """Return (..., 2, 2), N m per m/s^2: inertial torque_i = row_i @ acceleration.

        Eq. (11), (I_A/l1) G_i = I_A J_i + m J^-T_i, at poses (..., 2); rows limb by limb.
        """
        force = self.jacobian(pose).swapaxes(-1, -2)
        return np.asarray(self.I_A * self.inverse_jacobian(pose) + self.m * force)

    def local_indices(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return sigma_max, sigma_min, sin_alpha, sin_beta, tau at poses (..., 2): name -> (...).

        ``tau`` is the larger drive torque per unit acceleration, N m per m/s^2, eq. (12).
        """
        tau = self._batch(torque_index_batch, pose, (), *self.lengths, self.I_A, self.m)
        return {**PlanarMachine.local_indices(self, pose), "tau": tau}

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return torque, singular values, condition and transmission angles at poses (..., 2)."""
        local = self.local_indices(pose)
        doc = "larger drive torque per unit of platform acceleration"
        torque = IndexMap("tau", "N m/(m/s^2)", "max", local["tau"], doc=doc)
        return {"tau_G": torque, **self.limb_maps(local)}
