"""Influence coefficients of first and second order, G and H, at one pose, and the local indices.

X = (omega, v) = G q', X' = G q'' + q'^T H q''. Every slider moved alike is a pure motion along z: G
takes (1, ..., 1) to v_z alone, and every slice of H takes it to 0. So everything is written in the
five slider directions across it, an orthonormal basis (``across``), without a rank to be found.
"""

from __future__ import annotations

import math

from pkm_gym.core.compile import formula
from pkm_gym.core.five import (
    Five,
    Symmetric,
    added,
    cofactors,
    combined,
    combined3,
    dot,
    product,
    rows_of,
    squared,
    squared_norm,
    symmetric_cofactors_norm,
)
from pkm_gym.mechanisms.pus6.six import (
    Six,
    across,
    along_sliders,
    beside,
    lifted,
    mean,
    squares,
    without,
)

Leg = tuple[float, float, float, float, float, float]  # arm c and rod l from slider to S joint
Legs = tuple[Leg, Leg, Leg, Leg, Leg, Leg]
SixFives = tuple[Five, Five, Five, Five, Five, Five]
SixForms = tuple[Symmetric, Symmetric, Symmetric, Symmetric, Symmetric, Symmetric]

SINGULAR = 1e-26  # squared: of cofactors to the norm's fourth power, that count as none
A = B = 0.02  # error coefficients of eqs (2) and (3)


@formula
def inverse_row(leg: Leg) -> tuple[float, float, float, float, float]:
    """Return a leg's row of G^-1, q'_i = row . (omega, v), without its last number, which is 1."""
    cx, cy, cz, lx, ly, lz = leg
    scale = 1.0 / lz
    kx, ky = lx * scale, ly * scale
    return cy - cz * ky, cz * kx - cx, cx * ky - cy * kx, kx, ky


@formula
def first_order(legs: Legs) -> tuple[SixFives, float, tuple[float, float, float, float]]:
    """Return the rows of G across (1, ..., 1), det G^-1, and four squared norms.

    The rows omega and v; v_z has 1/sqrt(6) along (1, ..., 1) besides. The norms are those of the
    columns of G^-1, omega (m^2) and v, and of the pseudo-inverses of G's parts omega and v.
    """
    a, b, c = inverse_row(legs[0]), inverse_row(legs[1]), inverse_row(legs[2])
    d, e, f = inverse_row(legs[3]), inverse_row(legs[4]), inverse_row(legs[5])
    x = (a[0], b[0], c[0], d[0], e[0], f[0])
    y = (a[1], b[1], c[1], d[1], e[1], f[1])
    z = (a[2], b[2], c[2], d[2], e[2], f[2])
    u = (a[3], b[3], c[3], d[3], e[3], f[3])
    v = (a[4], b[4], c[4], d[4], e[4], f[4])
    columns = (across(x), across(y), across(z), across(u), across(v))
    minors = cofactors(columns)
    det = dot(columns[0], minors[0])
    scale = 1.0 / det
    zero = 0.0
    wx = combined(scale, minors[0], zero, minors[0])
    wy = combined(-scale, minors[1], zero, minors[1])
    wz = combined(scale, minors[2], zero, minors[2])
    vx = combined(-scale, minors[3], zero, minors[3])
    vy = combined(scale, minors[4], zero, minors[4])
    near = combined3(-mean(x), wx, -mean(y), wy, -mean(z), wz)
    vz = combined3(1.0, near, -mean(u), vx, -mean(v), vy)
    turning = squares(x) + squares(y) + squares(z)
    moving = squares(u) + squares(v) + 6.0
    norms = (turning, moving, *pseudo_inverses(x, y, z, u, v))
    return (wx, wy, wz, vx, vy, vz), -math.sqrt(6.0) * det, norms  # the basis is left-handed


@formula
def leg_form(leg: Leg, wx: Five, wy: Five, wz: Five, vx: Five, vy: Five) -> Symmetric:
    """Return Q_i: l_iz q''_i = l_i . (v' + omega' x c_i) - q'^T Q_i q', but for (l_i . c_i).

    That part, the same for all legs but for its factor, is added by ``second_order``.
    """
    cx, cy, cz, lx, ly, lz = leg
    rx = combined3(1.0, vx, cz, wy, -cy, wz)  # of the S joint's velocity across the slider
    ry = combined3(1.0, vy, cx, wz, -cz, wx)
    fall = combined(lx / lz, rx, ly / lz, ry)
    turned = combined3(-0.5 * lx, wx, -0.5 * ly, wy, -0.5 * lz, wz)
    arm = combined3(cx, wx, cy, wy, cz, wz)
    return added(
        added(added(product(turned, arm), -1.0, squared(rx)), -1.0, squared(ry)),
        -1.0,
        squared(fall),
    )


@formula
def weighted(
    w: Six,
    forms: SixForms,
    reach: Six,
    spin: Symmetric,
) -> Symmetric:
    """Return the slice sum_i w_i Q_i, ``reach`` the six l_i . c_i and ``spin`` G_w^T G_w."""
    turn = (
        w[0] * reach[0] + w[1] * reach[1] + w[2] * reach[2]
        + w[3] * reach[3] + w[4] * reach[4] + w[5] * reach[5]
    )  # fmt: skip
    s = (
        turn * spin[0], turn * spin[1], turn * spin[2], turn * spin[3], turn * spin[4],
        turn * spin[5], turn * spin[6], turn * spin[7], turn * spin[8], turn * spin[9],
        turn * spin[10], turn * spin[11], turn * spin[12], turn * spin[13], turn * spin[14],
    )  # fmt: skip
    s = added(added(s, w[0], forms[0]), w[1], forms[1])
    s = added(added(s, w[2], forms[2]), w[3], forms[3])
    return added(added(s, w[4], forms[4]), w[5], forms[5])


@formula
def second_order(legs: Legs, rows: SixFives) -> tuple[SixForms, Six, Symmetric]:
    """Return what the slices of H are made of: see ``weighted``; ``rows`` are those of G."""
    wx, wy, wz, vx, vy, _ = rows
    forms = (
        leg_form(legs[0], wx, wy, wz, vx, vy),
        leg_form(legs[1], wx, wy, wz, vx, vy),
        leg_form(legs[2], wx, wy, wz, vx, vy),
        leg_form(legs[3], wx, wy, wz, vx, vy),
        leg_form(legs[4], wx, wy, wz, vx, vy),
        leg_form(legs[5], wx, wy, wz, vx, vy),
    )
    reach = (
        rod_on_arm(legs[0]), rod_on_arm(legs[1]), rod_on_arm(legs[2]),
        rod_on_arm(legs[3]), rod_on_arm(legs[4]), rod_on_arm(legs[5]),
    )  # fmt: skip
    return forms, reach, added(added(squared(wx), 1.0, squared(wy)), 1.0, squared(wz))


@formula
def over_drops(row: Six, legs: Legs) -> Six:
    """Return G_ki / l_iz."""
    return (
        row[0] / legs[0][5], row[1] / legs[1][5], row[2] / legs[2][5],
        row[3] / legs[3][5], row[4] / legs[4][5], row[5] / legs[5][5],
    )  # fmt: skip


@formula
def rod_on_arm(leg: Leg) -> float:
    """Return l_i . c_i."""
    return leg[0] * leg[3] + leg[1] * leg[4] + leg[2] * leg[5]


@formula
def condition_squared(norm: float, minors: float, det: float) -> float:
    """Return (|H_k| |H_k^+|)^2 from squared norms of slice and cofactors; infinite at rank < 5."""
    if minors <= SINGULAR * norm**4:
        return math.inf
    return norm * minors / (det * det)


@formula
def turning_slice(s: Symmetric, a: Five, b: Five, skew: float) -> tuple[float, float]:
    """Return squared norm and squared condition of an angular slice with its skew part.

    The slice is s + skew (a b^T - b a^T) / 2.
    """
    rows, h = rows_of(s), 0.5 * skew
    x, y = h * a[0], h * b[0]
    r0 = combined3(1.0, rows[0], x, b, -y, a)
    x, y = h * a[1], h * b[1]
    r1 = combined3(1.0, rows[1], x, b, -y, a)
    x, y = h * a[2], h * b[2]
    r2 = combined3(1.0, rows[2], x, b, -y, a)
    x, y = h * a[3], h * b[3]
    r3 = combined3(1.0, rows[3], x, b, -y, a)
    x, y = h * a[4], h * b[4]
    r4 = combined3(1.0, rows[4], x, b, -y, a)
    m = (r0, r1, r2, r3, r4)
    c = cofactors(m)
    norm = squared_norm(m)
    return norm, condition_squared(norm, squared_norm(c), dot(m[0], c[0]))


@formula
def moving_slice(s: Symmetric) -> tuple[float, float]:
    """Return squared norm and squared condition of a linear slice, a symmetric matrix."""
    m = rows_of(s)
    c = cofactors(m)
    norm = squared_norm(m)
    return norm, condition_squared(norm, symmetric_cofactors_norm(c), dot(m[0], c[0]))


@formula
def pseudo_inverses(x: Six, y: Six, z: Six, u: Six, v: Six) -> tuple[float, float]:
    """Return the squared norms of the pseudo-inverses of G's two parts, omega and v.

    From the columns of G^-1, of v_z (1, ..., 1): the pseudo-inverse of either part are its columns
    without what lies along those of the other. Nothing grows without bounds beside a singularity.
    """
    one = (1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    u1 = without(u, one)
    v1 = without(without(v, one), u1)
    turning = beside(x, one, u1, v1) + beside(y, one, u1, v1) + beside(z, one, u1, v1)
    y1 = without(y, x)
    z1 = without(without(z, x), y1)
    return turning, beside(u, x, y1, z1) + beside(v, x, y1, z1) + beside(one, x, y1, z1)


@formula
def local_indices(legs: Legs, lc: float, skew: float) -> tuple[float, ...]:
    """Return 1/K of the six indices, eqs (1)-(7), and det G^-1.

    Args:
        legs: arm and rod of each leg, m.
        lc: characteristic length, m: the unit of length of eta_F and eta_I.
        skew: 1 for the influence-coefficient convention of H, 0 for the symmetric one.
    """
    rows, det, (turning, moving, pinv_w, pinv_v) = first_order(legs)
    wx, wy, wz, vx, vy, vz = rows
    norm_w = dot(wx, wx) + dot(wy, wy) + dot(wz, wz)
    norm_v = dot(vx, vx) + dot(vy, vy) + dot(vz, vz) + 1.0 / 6.0
    K_w, K_v = math.sqrt(norm_w * pinv_w), math.sqrt(norm_v * pinv_v)

    forms, reach, spin = second_order(legs, rows)
    s = weighted(over_drops(along_sliders(wx), legs), forms, reach, spin)
    n0, k0 = turning_slice(s, wy, wz, skew)
    s = weighted(over_drops(along_sliders(wy), legs), forms, reach, spin)
    n1, k1 = turning_slice(s, wz, wx, skew)
    s = weighted(over_drops(along_sliders(wz), legs), forms, reach, spin)
    n2, k2 = turning_slice(s, wx, wy, skew)
    s = weighted(over_drops(along_sliders(vx), legs), forms, reach, spin)
    n3, k3 = moving_slice(s)
    s = weighted(over_drops(along_sliders(vy), legs), forms, reach, spin)
    n4, k4 = moving_slice(s)
    s = weighted(over_drops(lifted(along_sliders(vz)), legs), forms, reach, spin)
    n5, k5 = moving_slice(s)

    H_w, H_v = math.sqrt(k0 + k1 + k2), math.sqrt(k3 + k4 + k5)
    second = A * A + 2.0 * A
    lc2 = lc * lc
    G = math.sqrt(lc2 * norm_w + norm_v)
    H = math.sqrt(lc2 * (lc2 * (n0 + n1 + n2) + (n3 + n4 + n5)))
    return (
        1.0 / K_w,
        1.0 / K_v,
        1.0 / (B * K_w + second * H_w),
        1.0 / (B * K_v + second * H_v),
        1.0 / (G * math.sqrt(turning / lc2 + moving)),
        1.0 / (G + H),
        det,
    )
