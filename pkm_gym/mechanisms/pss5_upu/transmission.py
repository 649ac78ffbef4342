"""What a pose is worth: dexterity K_v, K_w and transmission K_lambda, K_eta, compiled.

J takes slider rates to (vx, vy, vz, gamma', beta'); its column i is lambda_i times the motion of
limb i. The ratios of its singular values, and eta, don't depend on a motion's scale: cofactors do
for the inverse, without a division by a determinant that may be 0.
"""

from __future__ import annotations

import math

from pkm_gym.core.compile import formula
from pkm_gym.core.five import Five, Rows, squared_norm
from pkm_gym.core.linalg import cross3, det3, dot3, squared_singular_values
from pkm_gym.mechanisms.pss5_upu.kinematics import (
    Limb,
    Limbs,
    Platform,
    motions,
    rate_rows,
    spin,
)

Local = tuple[float, float, float, float]
Gram = tuple[float, float, float, float, float, float]

SINGULAR = 1e-24  # squared: of cofactors to the rows' norm^4, that count as none
LOCAL = 4  # K_v, K_w, K_lambda, K_eta
SWEEPS = 4  # of Jacobi's rotations: the largest value of a 3x3 matrix to rounding


@formula
def local_indices(limbs: Limbs, p: Platform) -> Local:
    """Return K_v, K_w, K_lambda and K_eta at a pose; NaN out of reach.

    At a pose of rank three and less every cofactor is 0: what moves there is no longer the sliders'
    to say, and K_v = K_w = K_eta = 0.
    """
    rows = rate_rows(limbs, p)
    moved, det = motions(rows)
    a, b, c, d, e = limbs
    least = min(a.cosine, b.cosine, c.cosine, d.cosine, e.cosine)
    lost = not several(rows, moved)
    j = (
        scaled(a.cosine, moved[0]),
        scaled(b.cosine, moved[1]),
        scaled(c.cosine, moved[2]),
        scaled(d.cosine, moved[3]),
        scaled(e.cosine, moved[4]),
    )
    eta = output_transmission(limbs, p, moved, det)
    # least - least: 0, but NaN out of reach
    zero = least - least
    return (
        zero if lost else dexterity_v(j),
        zero if lost else dexterity_w(j),
        least,
        zero if lost else eta,
    )


@formula
def several(rows: Rows, moved: Rows) -> bool:
    """Return whether the rows have a rank of four or five; not out of reach."""
    return squared_norm(moved) > SINGULAR * squared_norm(rows) ** 4


@formula
def scaled(x: float, a: Five) -> Five:
    """Return x a."""
    return x * a[0], x * a[1], x * a[2], x * a[3], x * a[4]


@formula
def output_transmission(limbs: Limbs, p: Platform, moved: Rows, det: float) -> float:
    """Return K_eta, the least eta_i = |f_i . v_ai| / |v_ai|.

    v_ai is the velocity of the S joint a_i while the other sliders are locked; motion i makes
    f_i . v_ai the determinant.
    """
    fastest = max(
        joint_speed2(limbs[0], p, moved[0]),
        joint_speed2(limbs[1], p, moved[1]),
        joint_speed2(limbs[2], p, moved[2]),
        joint_speed2(limbs[3], p, moved[3]),
        joint_speed2(limbs[4], p, moved[4]),
    )
    return min(1.0, abs(det) / math.sqrt(fastest))


@formula
def limb_transmission(limb: Limb, p: Platform, motion: Five, det: float) -> float:
    """Return eta_i of one limb; 0 where nothing moves."""
    speed2 = joint_speed2(limb, p, motion)
    return min(1.0, abs(det) / math.sqrt(speed2)) if speed2 > 0.0 else 0.0


@formula
def joint_speed2(limb: Limb, p: Platform, rates: Five) -> float:
    """Return |v + omega x R a_i|^2 at rates."""
    sx, sy, sz = spin(p, rates)
    tx, ty, tz = cross3(sx, sy, sz, limb.ax, limb.ay, limb.az)
    x, y, z = rates[0] + tx, rates[1] + ty, rates[2] + tz
    return dot3(x, y, z, x, y, z)


@formula
def dexterity_w(j: Rows) -> float:
    """Return K_w = s2 / s1 of J_w, whose columns end the rows of ``j``: gamma', beta'."""
    aa = j[0][3] ** 2 + j[1][3] ** 2 + j[2][3] ** 2 + j[3][3] ** 2 + j[4][3] ** 2
    bb = j[0][4] ** 2 + j[1][4] ** 2 + j[2][4] ** 2 + j[3][4] ** 2 + j[4][4] ** 2
    ab = (
        j[0][3] * j[0][4] + j[1][3] * j[1][4] + j[2][3] * j[2][4] + j[3][3] * j[3][4]
        + j[4][3] * j[4][4]
    )  # fmt: skip
    det2 = (  # by Cauchy and Binet: aa bb - ab^2 would cancel
        minor2(j[0], j[1]) + minor2(j[0], j[2]) + minor2(j[0], j[3]) + minor2(j[0], j[4])
        + minor2(j[1], j[2]) + minor2(j[1], j[3]) + minor2(j[1], j[4])
        + minor2(j[2], j[3]) + minor2(j[2], j[4]) + minor2(j[3], j[4])
    )  # fmt: skip
    larger, smaller = squared_singular_values(aa, bb, ab, det2)
    return math.sqrt(smaller / larger)


@formula
def minor2(a: Five, b: Five) -> float:
    """Return the squared minor of two columns of J_w."""
    m = a[3] * b[4] - a[4] * b[3]
    return m * m


@formula
def dexterity_v(j: Rows) -> float:
    """Return K_v = s3 / s1 of J_v, whose columns begin the rows of ``j``: vx, vy, vz."""
    a, b, c, d, e = j
    gram = (
        a[0] * a[0] + b[0] * b[0] + c[0] * c[0] + d[0] * d[0] + e[0] * e[0],
        a[1] * a[1] + b[1] * b[1] + c[1] * c[1] + d[1] * d[1] + e[1] * e[1],
        a[2] * a[2] + b[2] * b[2] + c[2] * c[2] + d[2] * d[2] + e[2] * e[2],
        a[0] * a[1] + b[0] * b[1] + c[0] * c[1] + d[0] * d[1] + e[0] * e[1],
        a[0] * a[2] + b[0] * b[2] + c[0] * c[2] + d[0] * d[2] + e[0] * e[2],
        a[1] * a[2] + b[1] * b[2] + c[1] * c[2] + d[1] * d[2] + e[1] * e[2],
    )
    det2 = (  # by Cauchy and Binet
        minor3(a, b, c) + minor3(a, b, d) + minor3(a, b, e) + minor3(a, c, d) + minor3(a, c, e)
        + minor3(a, d, e) + minor3(b, c, d) + minor3(b, c, e) + minor3(b, d, e) + minor3(c, d, e)
    )  # fmt: skip
    x, y, z = squared_values(gram)
    largest = max(x, y, z)
    middle = max(min(x, y), min(max(x, y), z))
    # s3^2 = det2 / (s1 s2)^2
    return math.sqrt(det2 / middle) / largest if middle > 0.0 else middle


@formula
def minor3(a: Five, b: Five, c: Five) -> float:
    """Return the squared minor of three columns of J_v."""
    m = det3(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2])
    return m * m


@formula
def squared_values(gram: Gram) -> tuple[float, float, float]:
    """Return the eigenvalues of a Gram matrix (xx, yy, zz, xy, xz, yz), by Jacobi's rotations.

    Square roots only, so that a block of poses is computed in lockstep; a rotation without an angle
    where there is nothing to turn.
    """
    xx, yy, zz, xy, xz, yz = gram
    for _ in range(SWEEPS):
        xx, yy, xy, xz, yz = turned(xx, yy, xy, xz, yz)
        xx, zz, xz, xy, yz = turned(xx, zz, xz, xy, yz)
        yy, zz, yz, xy, xz = turned(yy, zz, yz, xy, xz)
    return xx, yy, zz


@formula
def turned(
    pp: float, qq: float, pq: float, pr: float, qr: float
) -> tuple[float, float, float, float, float]:
    """Turn p and q so that pq = 0: return pp, qq, pq, pr, qr then.

    t = tan of the smaller angle, with tan of twice it 2 pq / (qq - pp).
    """
    apart = qq - pp
    across = abs(apart) + math.sqrt(apart * apart + 4.0 * pq * pq)
    t = math.copysign(2.0, apart) * pq / across if across > 0.0 else across
    c = 1.0 / math.sqrt(1.0 + t * t)
    s = t * c
    return pp - t * pq, qq + t * pq, 0.0 * pq, c * pr - s * qr, s * pr + c * qr
