"""Geometry of the 5-PSS/UPU: one pose at a time, compiled.

Frame O: z up, the origin at the centre of the rails' feet. Rail i rises from its foot B_i inwards
and upwards along e_i; the slider stands l_i from the foot; the rod f_i of length L joins it to the
S joint a_i of the platform. A pose is (x, y, z, beta, gamma): the platform's centre p, which is the
upper U joint of the passive limb O p, and the rotation Rz(alpha) Ry(beta) Rx(gamma). alpha is no
freedom: 0 in the paper (``upu`` = 0), or what a UPU limb gives (``upu`` = 1).

Rates are in the paper's order (vx, vy, vz, gamma', beta').
"""

from __future__ import annotations

import math
from typing import NamedTuple

from pkm_gym.core.compile import formula, kernel
from pkm_gym.core.five import Five, Rows, cofactors, dot
from pkm_gym.core.linalg import cross3, dot3
from pkm_gym.core.types import FloatArray

LIMBS = 5
FIFTH = 2.0 * math.pi / 5.0

# What a layout holds: of each limb the S joint in the platform (2), the foot (2) and the rail (3).
PER_LIMB = 7


class Platform(NamedTuple):
    """Where the platform stands: its centre, two of its axes, and how it turns with its rates."""

    x: float
    y: float
    z: float
    ux: float  # the platform's x axis u, about which gamma' turns
    uy: float
    uz: float
    wx: float  # its y axis
    wy: float
    wz: float
    sin_a: float  # of alpha; beta' turns about (-sin alpha, cos alpha, 0)
    cos_a: float
    yaw_y: float  # alpha' = yaw_y vy + yaw_z vz + yaw_b beta'
    yaw_z: float
    yaw_b: float


class Limb(NamedTuple):
    """A limb at a pose: arm R a_i, unit rod f_i, lambda_i = f_i e_i (NaN out of reach), slider."""

    ax: float
    ay: float
    az: float
    fx: float
    fy: float
    fz: float
    cosine: float
    slider: float


Limbs = tuple[Limb, Limb, Limb, Limb, Limb]


@kernel
def lay_out(
    layout: FloatArray, r: float, R: float, theta: float, a2: float, a3: float, b2: float, b3: float
) -> None:
    """Fill ``layout`` (35,): of each limb the S joint in the platform, the foot and the rail, m.

    ``a2`` ... ``b3`` turn the joints of the limbs 2 and 3 on platform (a) and base (b) away from
    72 and 144 deg; the limbs 5 and 4 mirror them. The paper's are 0. The rails' directions are
    those of its W_i as Rz(+delta) Rx(+theta): it prints them mirrored.
    """
    for i in range(LIMBS):
        of = min(i, LIMBS - i)
        a = FIFTH * of + (a2 if of == 1 else a3 if of == 2 else 0.0)
        b = FIFTH * of + (b2 if of == 1 else b3 if of == 2 else 0.0)
        side = 1.0 if i <= 2 else -1.0
        k = PER_LIMB * i
        layout[k], layout[k + 1] = r * math.cos(a), side * r * math.sin(a)
        layout[k + 2], layout[k + 3] = R * math.cos(b), side * R * math.sin(b)
        layout[k + 4] = -math.cos(theta) * math.cos(b)
        layout[k + 5] = -side * math.cos(theta) * math.sin(b)
        layout[k + 6] = math.sin(theta)


@kernel
def azimuth(i: int, second: float, third: float) -> float:
    """Return the azimuth of the joint of limb i, rad."""
    of = min(i, LIMBS - i)
    angle = FIFTH * of + (second if of == 1 else third if of == 2 else 0.0)
    return angle if i <= 2 else -angle


@kernel
def gap(i: int, j: int, second: float, third: float) -> float:
    """Return the angle between the joints of the limbs i and j on their circle, rad."""
    turn = 2.0 * math.pi
    apart = azimuth(i, second, third) - azimuth(j, second, third)
    return abs(apart - turn * round(apart / turn))


@kernel
def least_gap(second: float, third: float) -> float:
    """Return the least angle between two of five joints on a circle, rad."""
    least = math.inf
    for i in range(LIMBS):
        for j in range(i):
            least = min(least, gap(i, j, second, third))
    return least


@kernel
def home_height(r: float, R: float, L: float, theta: float, lam0: float) -> float:
    """Return z at home, m, where each rod has the cosine lam0 to its rail in the paper's layout."""
    rise = (R - r) * math.tan(theta)
    return rise + L * math.sqrt(max(0.0, 1.0 - lam0 * lam0)) / math.cos(theta)


@formula
def platform(
    upu: float, x: float, y: float, z: float, sin_b: float, cos_b: float, sin_g: float, cos_g: float
) -> Platform:
    """Return where the platform stands; ``upu`` 1: sin alpha = -(y/z) tan beta, 0: alpha = 0.

    The UPU limb holds s . (p x u) = 0, s the x axis of the base, u that of the platform; its rate
    gives alpha'.
    """
    sin_a = -upu * y * sin_b / (z * cos_b)
    cos_a = math.sqrt(1.0 - sin_a * sin_a)
    ux, uy, uz = cos_a * cos_b, sin_a * cos_b, -sin_b
    scale = upu / (ux * z)
    return Platform(
        x, y, z, ux, uy, uz,
        cos_a * sin_b * sin_g - sin_a * cos_g,
        sin_a * sin_b * sin_g + cos_a * cos_g,
        cos_b * sin_g,
        sin_a, cos_a,
        uz * scale, -uy * scale, -(sin_a * (uy * y + uz * z) + cos_a * ux * y) * scale,
    )  # fmt: skip


@formula
def excess(layout: FloatArray, k: int, p: Platform, L2: float) -> float:
    """Return disc_i / L^2 of the limb at k, < 0 out of reach: lambda_i^2 where it is in reach."""
    ax, ay, az = arm_at(layout, k, p)
    dx, dy, dz = p.x + ax - layout[k + 2], p.y + ay - layout[k + 3], p.z + az
    along = dot3(dx, dy, dz, layout[k + 4], layout[k + 5], layout[k + 6])
    return 1.0 - (dot3(dx, dy, dz, dx, dy, dz) - along * along) / L2


@formula
def arm_at(layout: FloatArray, k: int, p: Platform) -> tuple[float, float, float]:
    """Return R a_i of the limb at k, m."""
    a, b = layout[k], layout[k + 1]
    return a * p.ux + b * p.wx, a * p.uy + b * p.wy, a * p.uz + b * p.wz


@formula
def limb_at(layout: FloatArray, k: int, p: Platform, L: float) -> Limb:
    """Return the limb at k: l_i = e . d - sqrt(L^2 - d^2 + (e . d)^2), the slider behind the rod.

    d = p + R a_i - B_i.
    """
    ax, ay, az = arm_at(layout, k, p)
    ex, ey, ez = layout[k + 4], layout[k + 5], layout[k + 6]
    dx, dy, dz = p.x + ax - layout[k + 2], p.y + ay - layout[k + 3], p.z + az
    along = dot3(dx, dy, dz, ex, ey, ez)
    root = math.sqrt(L * L - dot3(dx, dy, dz, dx, dy, dz) + along * along)
    slider, scale = along - root, 1.0 / L
    return Limb(
        ax, ay, az,
        (dx - slider * ex) * scale, (dy - slider * ey) * scale, (dz - slider * ez) * scale,
        root * scale, slider,
    )  # fmt: skip


@formula
def limbs_at(layout: FloatArray, p: Platform, L: float) -> Limbs:
    """Return all limbs of a ``layout`` (35,)."""
    return (
        limb_at(layout, 0, p, L),
        limb_at(layout, 7, p, L),
        limb_at(layout, 14, p, L),
        limb_at(layout, 21, p, L),
        limb_at(layout, 28, p, L),
    )


@kernel
def platform_of(pose: FloatArray, upu: float) -> Platform:
    """Return where the platform stands at a pose (5,)."""
    b, g = pose[3], pose[4]
    return platform(
        upu, pose[0], pose[1], pose[2], math.sin(b), math.cos(b), math.sin(g), math.cos(g)
    )


# Rates --------------------------------------------------------------------------------------------


@formula
def rate_row(limb: Limb, p: Platform) -> Five:
    """Return a limb's row, lambda_i l'_i = row . (vx, vy, vz, gamma', beta').

    That is f . v + m . omega, m = (R a_i) x f the moment of the rod, alpha' put in.
    """
    mx, my, mz = cross3(limb.ax, limb.ay, limb.az, limb.fx, limb.fy, limb.fz)
    return (
        limb.fx,
        limb.fy + p.yaw_y * mz,
        limb.fz + p.yaw_z * mz,
        mx * p.ux + my * p.uy + mz * p.uz,
        my * p.cos_a - mx * p.sin_a + mz * p.yaw_b,
    )


@formula
def rate_rows(limbs: Limbs, p: Platform) -> Rows:
    """Return the rows of all limbs."""
    return (
        rate_row(limbs[0], p),
        rate_row(limbs[1], p),
        rate_row(limbs[2], p),
        rate_row(limbs[3], p),
        rate_row(limbs[4], p),
    )


@formula
def motions(rows: Rows) -> tuple[Rows, float]:
    """Return the motions of the limbs, each times the determinant, and the determinant.

    Motion i are the rates at which f_i . v of limb i is 1 and that of all others 0: a column of the
    inverse, here the row of cofactors, regular where the inverse isn't. ``cofactors`` leaves the
    sign of its odd rows to us.
    """
    m = cofactors(rows)
    det = dot(rows[0], m[0])
    return (m[0], negative(m[1]), m[2], negative(m[3]), m[4]), det


@formula
def negative(a: Five) -> Five:
    """Return -a."""
    return -a[0], -a[1], -a[2], -a[3], -a[4]


@formula
def spin(p: Platform, rates: Five) -> tuple[float, float, float]:
    """Return omega at rates: alpha' z + beta' (-sin alpha, cos alpha, 0) + gamma' u."""
    g, b = rates[3], rates[4]
    return (
        g * p.ux - b * p.sin_a,
        g * p.uy + b * p.cos_a,
        g * p.uz + p.yaw_y * rates[1] + p.yaw_z * rates[2] + p.yaw_b * b,
    )
