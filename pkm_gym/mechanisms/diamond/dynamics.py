"""Dynamics of the Diamond: eqs (9) and (12), with the 1/l1 that the paper lost."""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import cross2
from pkm_gym.core.planar import limb
from pkm_gym.core.trajectory import pick_and_place
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.kinematics import limb_hessian

GRAVITY = 9.81  # m/s^2

# Each symbol of the inertia tables, in the order of the row that the kernels take; see paper.toml.
INERTIA_NAMES = (
    "motor", "mu1", "mu2", "m_d", "m_p", "arm", "rod_elbow", "rod_platform", "m_arm", "m_rod"
)  # fmt: skip


@kernel
def lumped_inertia(
    l1: float, l2: float, payload: float, inertia: FloatArray
) -> tuple[float, float, float]:
    """Return I_A about the drive axis (kg m^2), moving mass m (kg), first moment m_A r_A (kg m).

    Tables 1 and 2: uniform arm of m_arm + mu1 l1 with its factor ``arm``, elbow mass m_d, and the
    mass m_rod + mu2 l2 of the rods shared between elbow and platform.
    """
    motor, mu1, mu2, m_d, m_p, arm, rod_elbow, rod_platform, m_arm, m_rod = inertia
    elbow = m_d + rod_elbow * mu2 * l2 + rod_elbow * m_rod
    I_A = motor + arm * mu1 * l1**3 + arm * m_arm * l1 * l1 + elbow * l1 * l1
    m = m_p + rod_platform * mu2 * l2 + rod_platform * m_rod + payload
    return I_A, m, 0.5 * mu1 * l1 * l1 + 0.5 * m_arm * l1 + elbow * l1


@formula
def inverse_dynamics(
    x: float,
    y: float,
    vx: float,
    vy: float,
    ax: float,
    ay: float,
    e: float,
    l1: float,
    l2: float,
    I_A: float,
    m: float,
    mr_A: float,
) -> tuple[float, float, float, float]:
    """Return drive torques (N m) and arm rates (rad/s) of a state: tau1, tau2, rate1, rate2.

    Corrected eq. (9): tau = I_A (J a + f(v)) + J^-T m (a + g e_2) + m_A r_A g cos(theta_1).
    """
    u1x, _, w1x, w1y, s1 = limb(x, y, 1.0, e, l1, l2)
    u2x, _, w2x, w2y, s2 = limb(x, y, -1.0, e, l1, l2)
    sin_alpha = cross2(w1x, w1y, w2x, w2y)
    force_x, force_y = m * ax, m * (ay + GRAVITY)
    rod1 = cross2(force_x, force_y, w2x, w2y) / sin_alpha
    rod2 = cross2(w1x, w1y, force_x, force_y) / sin_alpha
    k1xx, k1xy, k1yy = limb_hessian(x, y, 1.0, e, l1, l2)
    k2xx, k2xy, k2yy = limb_hessian(x, y, -1.0, e, l1, l2)
    f1 = k1xx * vx * vx + 2.0 * k1xy * vx * vy + k1yy * vy * vy
    f2 = k2xx * vx * vx + 2.0 * k2xy * vx * vy + k2yy * vy * vy
    arm1 = (w1x * ax + w1y * ay) / (l1 * s1) + f1
    arm2 = (w2x * ax + w2y * ay) / (l1 * s2) + f2
    tau1 = I_A * arm1 + l1 * s1 * rod1 + mr_A * GRAVITY * u1x
    tau2 = I_A * arm2 + l1 * s2 * rod2 + mr_A * GRAVITY * u2x
    return tau1, tau2, (w1x * vx + w1y * vy) / (l1 * s1), (w2x * vx + w2y * vy) / (l1 * s2)


@kernel
def cycle_indices(
    width: float,
    lift: float,
    time: float,
    overlap: float,
    floor: float,
    samples: int,
    e: float,
    l1: float,
    l2: float,
    I_A: float,
    m: float,
    mr_A: float,
) -> tuple[float, float, float, float]:
    """Return peak torque, rms torque of the worse limb (N m), peak power (W), peak rate (rad/s).

    One pick-and-place cycle along y = ``floor``, ``samples`` instants, rms by the trapezoid rule.
    """
    peak = power = speed = square1 = square2 = 0.0
    for k in range(samples):
        t = time * k / (samples - 1)
        x, y, vx, vy, ax, ay = pick_and_place(t, width, lift, time, overlap)
        tau1, tau2, rate1, rate2 = inverse_dynamics(
            x, y + floor, vx, vy, ax, ay, e, l1, l2, I_A, m, mr_A
        )
        weight = 0.5 if k in (0, samples - 1) else 1.0
        square1 += weight * tau1 * tau1
        square2 += weight * tau2 * tau2
        peak = max(peak, abs(tau1), abs(tau2))
        power = max(power, abs(tau1 * rate1), abs(tau2 * rate2))
        speed = max(speed, abs(rate1), abs(rate2))
    return peak, math.sqrt(max(square1, square2) / (samples - 1)), power, speed


@batch_kernel
def inverse_dynamics_batch(
    states: FloatArray,
    e: float,
    l1: float,
    l2: float,
    I_A: float,
    m: float,
    mr_A: float,
    torques: FloatArray,
) -> None:
    """Fill ``torques`` (n, 2), N m, from states (n, 6): pose, velocity, acceleration."""
    for i in numba.prange(states.shape[0]):
        x, y, vx, vy, ax, ay = states[i]
        tau1, tau2, _, _ = inverse_dynamics(x, y, vx, vy, ax, ay, e, l1, l2, I_A, m, mr_A)
        torques[i, 0], torques[i, 1] = tau1, tau2
