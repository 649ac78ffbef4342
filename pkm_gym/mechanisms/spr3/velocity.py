"""Velocities of the 3-SPR, compiled: equations (12)-(20) of the paper, with (20) corrected.

In the platform's frame everything is sparse: B_i = P_i e_i + N_i w, the revolute axis c_i = t_i is
tangential, the leg lies in the plane of e_i and w.
"""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import solve3
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.kinematics import COS, SIN, anchor, turned


@formula
def angular_velocity(
    hx: float, hy: float, s: float, b: float
) -> tuple[float, float, float, float, float, float]:
    """Return omega for a unit velocity of O_A along u, then along v, both as (u, v, w) parts, 1/m.

    Eq. (12): the constraint along t_i through B_i is t_i . v + (P_i w - N_i e_i) . omega = 0. A
    velocity along w turns nothing.
    """
    p1, n1 = anchor(hx, hy, s, b, COS[0], SIN[0])
    p2, n2 = anchor(hx, hy, s, b, COS[1], SIN[1])
    p3, n3 = anchor(hx, hy, s, b, COS[2], SIN[2])
    ux, uy, uz, _ = solve3(
        -n1 * COS[0], -n1 * SIN[0], p1, -n2 * COS[1], -n2 * SIN[1], p2, -n3 * COS[2], 0.0, p3,
        SIN[0], SIN[1], SIN[2],
    )  # fmt: skip
    vx, vy, vz, _ = solve3(
        -n1 * COS[0], -n1 * SIN[0], p1, -n2 * COS[1], -n2 * SIN[1], p2, -n3 * COS[2], 0.0, p3,
        -COS[0], -COS[1], -COS[2],
    )  # fmt: skip
    return ux, uy, uz, vx, vy, vz


@formula
def leg_direction(
    hx: float, hy: float, s: float, a: float, b: float, cos: float, sin: float
) -> tuple[float, float, float]:
    """Return w_i from B_i to A_i, radially and along w, and q_i (m)."""
    radial, normal = anchor(hx, hy, s, b, cos, sin)
    length = math.sqrt((radial - a) ** 2 + normal * normal)
    return (a - radial) / length, -normal / length, length


@formula
def jacobian_row(
    hx: float, hy: float, s: float, a: float, b: float, cos: float, sin: float,
    ux: float, uy: float, vx: float, vy: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Return row i of J in the platform's frame, dimensionless: leg rate = row . velocity of O_A.

    Eq. (14), w_i . (v + omega x a_i); ``ux`` ... ``vy`` are omega's in-plane parts.
    """
    along, up, _ = leg_direction(hx, hy, s, a, b, cos, sin)
    turn = a * up
    return (
        along * cos + turn * (sin * ux - cos * uy),
        along * sin + turn * (sin * vx - cos * vy),
        up,
    )


@kernel
def twist_of(
    hx: float, hy: float, s: float, dhx: float, dhy: float, ds: float, b: float
) -> tuple[float, float, float]:
    """Return the velocity of O_A (m/s) in the fixed frame of a pose that changes."""
    h, dh = complex(hx, hy), complex(dhx, dhy)
    m = 1.0 + hx * hx + hy * hy
    dm = 2.0 * (hx * dhx + hy * dhy)
    k = h.conjugate()
    rho = (
        b * (2.0 * k * dh.conjugate() - 4.0 * h**3 * dh) / m**2
        - 2.0 * b * (k**2 - h**4) * dm / m**3
        + 2.0 * (s * dh + ds * h) / m
        - 2.0 * s * h * dm / m**2
    )
    cubic, slope = (h**3).real, (h**2 * dh).real
    z = b * (4.0 * cubic * dm / m - 6.0 * slope) / m**2 - 2.0 * s * dm / m**2 + ds * (2.0 - m) / m
    return rho.real, rho.imag, z


@kernel
def velocity_matrices(
    hx: float, hy: float, s: float, a: float, b: float, matrices: FloatArray
) -> None:
    """Fill ``matrices`` (5, 3, 3) in the fixed frame: J, J_c and the three limbs' J_d.

    Leg rates = J v, omega = J_c v (1/m), omega_i = J_d[i] v (1/m), v the velocity of O_A. Eq. (20),
    corrected: q_i J_d = [w_i x] + ((w_i . a_i) E - a_i w_i^T + q_i w_i w_i^T) J_c.
    """
    J, J_c, J_d = matrices[0], matrices[1], matrices[2:]
    ux, uy, uz, vx, vy, vz = angular_velocity(hx, hy, s, b)
    J_c[0, 0], J_c[1, 0], J_c[2, 0] = ux, uy, uz
    J_c[0, 1], J_c[1, 1], J_c[2, 1] = vx, vy, vz
    J_c[:, 2] = 0.0
    for i in range(3):
        cos, sin = COS[i], SIN[i]
        x, y, z = jacobian_row(hx, hy, s, a, b, cos, sin, ux, uy, vx, vy)
        J[i, 0], J[i, 1], J[i, 2] = turned(hx, hy, x, y, z)
        along, up, length = leg_direction(hx, hy, s, a, b, cos, sin)
        wx, wy, lever = along * cos, along * sin, a * along
        for j in range(3):
            spin = wx * J_c[0, j] + wy * J_c[1, j] + up * J_c[2, j]
            J_d[i, 0, j] = (lever * J_c[0, j] - a * cos * spin) / length + wx * spin
            J_d[i, 1, j] = (lever * J_c[1, j] - a * sin * spin) / length + wy * spin
            J_d[i, 2, j] = lever * J_c[2, j] / length + up * spin
        J_d[i, 1, 0] += up / length
        J_d[i, 2, 0] -= wy / length
        J_d[i, 0, 1] -= up / length
        J_d[i, 2, 1] += wx / length
        J_d[i, 0, 2] += wy / length
        J_d[i, 1, 2] -= wx / length
        _turn_matrix(hx, hy, J_d[i])
    _turn_matrix(hx, hy, J_c)


@formula
def _turn_matrix(hx: float, hy: float, matrix: FloatArray) -> None:
    for j in range(3):
        x, y, z = turned(hx, hy, matrix[0, j], matrix[1, j], matrix[2, j])
        matrix[0, j], matrix[1, j], matrix[2, j] = x, y, z
    for i in range(3):
        x, y, z = turned(hx, hy, matrix[i, 0], matrix[i, 1], matrix[i, 2])
        matrix[i, 0], matrix[i, 1], matrix[i, 2] = x, y, z


@batch_kernel
def velocity_batch(poses: FloatArray, a: float, b: float, matrices: FloatArray) -> None:
    """Fill ``matrices`` (n, 5, 3, 3) from ``poses`` (n, 3): see ``velocity_matrices``."""
    for k in numba.prange(poses.shape[0]):
        hx, hy, s = poses[k]
        velocity_matrices(hx, hy, s, a, b, matrices[k])


@batch_kernel
def twist_batch(poses: FloatArray, rates: FloatArray, b: float, twists: FloatArray) -> None:
    """Fill ``twists`` (n, 3), m/s, from poses (n, 3) and their rates (n, 3)."""
    for k in numba.prange(poses.shape[0]):
        hx, hy, s = poses[k]
        dhx, dhy, ds = rates[k]
        twists[k, 0], twists[k, 1], twists[k, 2] = twist_of(hx, hy, s, dhx, dhy, ds, b)
