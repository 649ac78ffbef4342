"""The leg's kinematics in its plane: one pose at a time, compiled.

Frame: O is the hip, x from O to C along the frame, z up; angles run counter-clockwise from x. The
body AOF has the crank OA at theta_1 and the upper link OF at beta = theta_1 + phi, the body DOE the
crank OD at theta_5 and OE at alpha = theta_5 + gamma. The rhombi open by 2 theta about an axis that
swings by varphi from -z towards -x. Only the sums s = theta + varphi and d = theta - varphi matter
to the cranks:

    theta_1 = 3 pi/2 - s - phi,    theta_5 = 3 pi/2 + d - gamma.    # eq. (7), corrected

The cylinder AB shuts the triangle OAB, CD the triangle OCD: a crank, a side of the frame, and the
angle between them.
"""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.types import FloatArray

# Lengths (m) and angles (rad): OA, OB and the angle of OB, OD, OC, phi, gamma.
Links = tuple[float, float, float, float, float, float, float]


@formula
def frame_side(l3: float, l6: float, th3: float) -> tuple[float, float]:
    """Return the length |OB| (m) and the angle of OB (rad): B = (l6 - l3 cos th3, l3 sin th3)."""
    bx, bz = l6 - l3 * math.cos(th3), l3 * math.sin(th3)
    return math.hypot(bx, bz), math.atan2(bz, bx)


@formula
def cylinder(crank: float, frame: float, cosine: float, sine: float) -> tuple[float, float]:
    """Return a cylinder's length l (m) and k = dl/d(angle) (m), the angle from frame to crank.

    Eqs (4), (5) by the law of cosines; eqs (10), (12) with k = crank sin(crank to cylinder).
    """
    length = math.sqrt(crank * crank + frame * frame - 2.0 * crank * frame * cosine)
    return length, crank * frame * sine / length


@formula
def cylinders(s: float, d: float, links: Links) -> tuple[float, float, float, float]:
    """Return l2, k2 = dl2/dtheta_1, l4 and k4 = dl4/dtheta_5, m."""
    l1, ob, theta_b, l5, l6, phi, gamma = links
    a, theta5 = crank_angles(s, d, theta_b, phi, gamma)
    l2, k2 = cylinder(l1, ob, math.cos(a), math.sin(a))
    l4, k4 = cylinder(l5, l6, math.cos(theta5), math.sin(theta5))
    return l2, k2, l4, k4


@formula
def crank_angles(
    s: float, d: float, theta_b: float, phi: float, gamma: float
) -> tuple[float, float]:
    """Return the angles from OB to OA and from OC to OD, rad."""
    return 1.5 * math.pi - s - phi - theta_b, 1.5 * math.pi + d - gamma


@kernel
def opening(x: float, z: float, side: float) -> tuple[float, float]:
    """Return theta and varphi (rad) of the foot at (x, z): eq. (3); NaN out of reach.

    0 < theta < pi/2: at the ends the rhombi are stretched or flat.
    """
    cosine = math.hypot(x, z) / (4.0 * side)
    if not 0.0 < cosine < 1.0:
        return math.nan, math.nan
    return math.acos(cosine), math.atan2(-x, -z)


@formula
def foot(theta: float, varphi: float, side: float) -> tuple[float, float]:
    """Return the foot's x, z, m. Eq. (3)."""
    radius = 4.0 * side * math.cos(theta)
    return -radius * math.sin(varphi), -radius * math.cos(varphi)


@kernel
def foot_of(
    l2: float, l4: float, above: float, right: float, side: float, links: Links
) -> tuple[float, float]:
    """Return the foot's x, z (m) of the cylinders' lengths in one assembly mode.

    ``above`` is the sign of sin(theta_1 - theta_B), ``right`` that of sin theta_5: on which side of
    its dead line each crank is. NaN where a triangle doesn't close, or the rhombi are folded
    through (theta beyond 90 deg).
    """
    l1, ob, theta_b, l5, l6, phi, gamma = links
    a = above * math.acos((l1 * l1 + ob * ob - l2 * l2) / (2.0 * l1 * ob))
    theta5 = right * math.acos((l5 * l5 + l6 * l6 - l4 * l4) / (2.0 * l5 * l6))
    alpha, beta = theta5 + gamma, theta_b + a + phi
    if not math.sin(alpha - beta) > 0.0:
        return math.nan, math.nan
    return (
        2.0 * side * (math.cos(alpha) + math.cos(beta)),
        2.0 * side * (math.sin(alpha) + math.sin(beta)),
    )


@formula
def side_of_D(gamma: float) -> float:  # noqa: N802 (the point D)
    """Return -1 where D lies below OC at mid pose, as with the default gamma, else +1."""
    return 1.0 if math.cos(gamma - 0.25 * math.pi) < 0.0 else -1.0


@kernel
def dead_point_margins(
    s_min: float, s_max: float, d_min: float, d_max: float, links: Links
) -> tuple[float, float, float, float]:
    """Return the smallest angles (rad) of OA and OD to their dead lines, < 0 across them.

    Of A on the side of the short and of the long cylinder AB, of D likewise.
    """
    _, _, theta_b, _, _, phi, gamma = links
    A_short = 1.5 * math.pi - s_max - phi - theta_b
    A_long = -0.5 * math.pi + s_min + phi + theta_b
    below = side_of_D(gamma) < 0.0
    from_mid = gamma - (0.25 if below else 1.25) * math.pi
    from_mid -= 2.0 * math.pi * math.floor(0.5 * from_mid / math.pi + 0.5)
    least, most = 0.25 * math.pi + d_min - from_mid, 0.75 * math.pi - d_max + from_mid
    return A_short, A_long, most if below else least, least if below else most


@kernel
def cylinder_range(crank: float, frame: float, low: float, high: float) -> tuple[float, float]:
    """Return a cylinder's shortest and longest length (m) while its crank turns from low to high.

    Angles from the frame's side to the crank, rad.
    """
    at_low, at_high = math.cos(low), math.cos(high)
    most, least = max(at_low, at_high), min(at_low, at_high)
    turn = 2.0 * math.pi
    if math.ceil(low / turn) * turn <= high:
        most = 1.0
    if (math.ceil(low / turn - 0.5) + 0.5) * turn <= high:
        least = -1.0
    squared = crank * crank + frame * frame
    twice = 2.0 * crank * frame
    return math.sqrt(max(0.0, squared - twice * most)), math.sqrt(squared - twice * least)


@formula
def cylinder_gap(s: float, d: float, links: Links) -> float:
    """Return the distance of the segments AB and CD, the cylinders' axes, m; 0 where they cross."""
    _, ob, theta_b, _, _, phi, gamma = links
    bx, bz = ob * math.cos(theta_b), ob * math.sin(theta_b)
    outer, inner = s + phi, d - gamma
    return gap_of(math.sin(outer), math.cos(outer), math.sin(inner), math.cos(inner), bx, bz, links)


@formula
def gap_of(
    sin_a: float, cos_a: float, sin_d: float, cos_d: float, bx: float, bz: float, links: Links
) -> float:
    """Return ``cylinder_gap`` from sines and cosines of s + phi and d - gamma, and from B."""
    l1, _, _, l5, cx, _, _ = links
    ax, az = -l1 * sin_a, -l1 * cos_a
    dx, dz = l5 * sin_d, -l5 * cos_d
    cz = 0.0
    if crosses(ax, az, bx, bz, cx, cz, dx, dz) and crosses(cx, cz, dx, dz, ax, az, bx, bz):
        return 0.0
    return math.sqrt(
        min(
            squared_distance(ax, az, cx, cz, dx, dz),
            squared_distance(bx, bz, cx, cz, dx, dz),
            squared_distance(cx, cz, ax, az, bx, bz),
            squared_distance(dx, dz, ax, az, bx, bz),
        )
    )


@formula
def squared_distance(px: float, pz: float, ax: float, az: float, bx: float, bz: float) -> float:
    """Return the squared distance of P from the segment AB, m^2."""
    ux, uz, wx, wz = bx - ax, bz - az, px - ax, pz - az
    t = min(1.0, max(0.0, (wx * ux + wz * uz) / (ux * ux + uz * uz)))
    across, along = wx - t * ux, wz - t * uz
    return across * across + along * along


@formula
def crosses(
    ax: float, az: float, bx: float, bz: float, cx: float, cz: float, dx: float, dz: float
) -> bool:
    """Return whether C and D lie on different sides of the line AB."""
    ux, uz = bx - ax, bz - az
    to_c = ux * (cz - az) - uz * (cx - ax)
    to_d = ux * (dz - az) - uz * (dx - ax)
    return (to_c > 0.0) != (to_d > 0.0)


# The Jacobian -------------------------------------------------------------------------------------


@formula
def jacobian(
    theta: float, varphi: float, side: float, links: Links
) -> tuple[float, float, float, float]:
    """Return J row by row: (vx, vz) = J (dl2/dt, dl4/dt). Eq. (16), corrected."""
    s, d = theta + varphi, theta - varphi
    _, k2, _, k4 = cylinders(s, d, links)
    by2, by4 = 2.0 * side / k2, 2.0 * side / k4
    return by2 * math.cos(s), by4 * math.cos(d), -by2 * math.sin(s), by4 * math.sin(d)


@formula
def inverse_jacobian(
    theta: float, varphi: float, side: float, links: Links
) -> tuple[float, float, float, float]:
    """Return the inverse of J row by row: cylinder rates = inverse @ (vx, vz)."""
    s, d = theta + varphi, theta - varphi
    _, k2, _, k4 = cylinders(s, d, links)
    scale = 1.0 / (2.0 * side * math.sin(2.0 * theta))
    return (
        k2 * scale * math.sin(d),
        -k2 * scale * math.cos(d),
        k4 * scale * math.sin(s),
        k4 * scale * math.cos(s),
    )


@formula
def condition_number(k2: float, k4: float, theta: float) -> float:
    """Return the condition number of J, eq. (17): the columns' lengths go with 1/k2 and 1/k4.

    They enclose the angle 2 theta or its supplement.
    """
    p, q, cosine = k2 * k2, k4 * k4, math.cos(2.0 * theta)
    root = math.sqrt((p - q) ** 2 + 4.0 * p * q * cosine * cosine)
    return (p + q + root) / (2.0 * abs(k2 * k4) * abs(math.sin(2.0 * theta)))


@formula
def largest_singular_value(k2: float, k4: float, theta: float, side: float) -> float:
    """Return sigma_max(J): the largest |F| of the cylinders for a unit force on the foot."""
    p, q, cosine = 1.0 / (k2 * k2), 1.0 / (k4 * k4), math.cos(2.0 * theta)
    root = math.sqrt((p - q) ** 2 + 4.0 * p * q * cosine * cosine)
    return side * math.sqrt(2.0 * (p + q + root))


@kernel
def cylinder_accelerations(
    x: float, z: float, vx: float, vz: float, ax: float, az: float, side: float, links: Links
) -> tuple[float, float]:
    """Return the second time derivatives of l2 and l4 (m/s^2) of the foot's motion.

    From the foot's I = 2 l (e^{i alpha} + e^{i beta}) differentiated twice.
    """
    theta, varphi = opening(x, z, side)
    s, d = theta + varphi, theta - varphi
    l1, ob, theta_b, l5, l6, phi, gamma = links
    a, theta5 = crank_angles(s, d, theta_b, phi, gamma)
    beta_rate, alpha_rate = upper_rates(vx, vz, s, d, side)
    # the part of the acceleration that is not the centripetal one of either upper link
    cx = ax + 2.0 * side * (math.sin(d) * alpha_rate**2 - math.sin(s) * beta_rate**2)
    cz = az - 2.0 * side * (math.cos(d) * alpha_rate**2 + math.cos(s) * beta_rate**2)
    beta_bend, alpha_bend = upper_rates(cx, cz, s, d, side)
    l2, k2 = cylinder(l1, ob, math.cos(a), math.sin(a))
    l4, k4 = cylinder(l5, l6, math.cos(theta5), math.sin(theta5))
    h2 = (l1 * ob * math.cos(a) - k2 * k2) / l2
    h4 = (l5 * l6 * math.cos(theta5) - k4 * k4) / l4
    return (
        k2 * beta_bend + h2 * beta_rate * beta_rate,
        k4 * alpha_bend + h4 * alpha_rate * alpha_rate,
    )


@formula
def upper_rates(vx: float, vz: float, s: float, d: float, side: float) -> tuple[float, float]:
    """Return the rates of beta and alpha (rad/s) at a velocity of the foot. Eqs (14), (15)."""
    scale = 1.0 / (2.0 * side * math.sin(s + d))
    return (
        scale * (math.sin(d) * vx - math.cos(d) * vz),
        scale * (math.sin(s) * vx + math.cos(s) * vz),
    )


# Many poses ---------------------------------------------------------------------------------------


@batch_kernel
def inverse_kinematics_batch(
    poses: FloatArray, side: float, links: Links, joints: FloatArray
) -> None:
    """Fill ``joints`` (n, 2) with l2, l4 of ``poses`` (n, 2), all in metres."""
    for i in numba.prange(poses.shape[0]):
        theta, varphi = opening(poses[i, 0], poses[i, 1], side)
        joints[i, 0], _, joints[i, 1], _ = cylinders(theta + varphi, theta - varphi, links)


@batch_kernel
def forward_kinematics_batch(
    joints: FloatArray, modes: FloatArray, side: float, links: Links, poses: FloatArray
) -> None:
    """Fill ``poses`` (n, 2) from ``joints`` (n, 2), m, in assembly modes (n, 2), signs."""
    for i in numba.prange(joints.shape[0]):
        poses[i, 0], poses[i, 1] = foot_of(
            joints[i, 0], joints[i, 1], modes[i, 0], modes[i, 1], side, links
        )


@batch_kernel
def crank_angles_batch(poses: FloatArray, side: float, links: Links, angles: FloatArray) -> None:
    """Fill ``angles`` (n, 2), rad, from OB to OA and from OC to OD, at ``poses`` (n, 2)."""
    _, _, theta_b, _, _, phi, gamma = links
    for i in numba.prange(poses.shape[0]):
        theta, varphi = opening(poses[i, 0], poses[i, 1], side)
        angles[i, 0], angles[i, 1] = crank_angles(
            theta + varphi, theta - varphi, theta_b, phi, gamma
        )


@batch_kernel
def jacobian_batch(poses: FloatArray, side: float, links: Links, matrices: FloatArray) -> None:
    """Fill ``matrices`` (n, 2, 2) with J at ``poses`` (n, 2)."""
    for i in numba.prange(poses.shape[0]):
        theta, varphi = opening(poses[i, 0], poses[i, 1], side)
        j11, j12, j21, j22 = jacobian(theta, varphi, side, links)
        matrices[i, 0, 0], matrices[i, 0, 1] = j11, j12
        matrices[i, 1, 0], matrices[i, 1, 1] = j21, j22


@batch_kernel
def inverse_jacobian_batch(
    poses: FloatArray, side: float, links: Links, matrices: FloatArray
) -> None:
    """Fill ``matrices`` (n, 2, 2) with the inverse of J at ``poses`` (n, 2)."""
    for i in numba.prange(poses.shape[0]):
        theta, varphi = opening(poses[i, 0], poses[i, 1], side)
        j11, j12, j21, j22 = inverse_jacobian(theta, varphi, side, links)
        matrices[i, 0, 0], matrices[i, 0, 1] = j11, j12
        matrices[i, 1, 0], matrices[i, 1, 1] = j21, j22


@batch_kernel
def cylinder_accelerations_batch(
    motion: FloatArray, side: float, links: Links, accelerations: FloatArray
) -> None:
    """Fill ``accelerations`` (n, 2), m/s^2, from poses, velocities, accelerations (n, 6)."""
    for i in numba.prange(motion.shape[0]):
        x, z, vx, vz, ax, az = motion[i]
        accelerations[i, 0], accelerations[i, 1] = cylinder_accelerations(
            x, z, vx, vz, ax, az, side, links
        )


LOCAL_INDICES = ("eta", "sigma_max", "gap", "A", "D", "rate")


@batch_kernel
def local_indices_batch(poses: FloatArray, side: float, links: Links, table: FloatArray) -> None:
    """Fill ``table`` (n, 6) at ``poses`` (n, 2): see ``LOCAL_INDICES``.

    Condition number, sigma_max(J), distance of the cylinders (m), angles from OB to OA and from OC
    to OD (rad), and the largest speed of a piston for a unit speed of the foot.
    """
    _, _, theta_b, _, _, phi, gamma = links
    for i in numba.prange(poses.shape[0]):
        theta, varphi = opening(poses[i, 0], poses[i, 1], side)
        s, d = theta + varphi, theta - varphi
        _, k2, _, k4 = cylinders(s, d, links)
        table[i, 0] = condition_number(k2, k4, theta)
        table[i, 1] = largest_singular_value(k2, k4, theta, side)
        table[i, 2] = cylinder_gap(s, d, links)
        table[i, 3], table[i, 4] = crank_angles(s, d, theta_b, phi, gamma)
        table[i, 5] = max(abs(k2), abs(k4)) / (2.0 * side * math.sin(2.0 * theta))
