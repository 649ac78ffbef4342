"""Compiled algebra of fixed size, written on scalars so that loops over poses vectorise."""

from __future__ import annotations

import math

from pkm_gym.core.compile import formula

# Keeps a division by zero away where the three singular values are equal to the last digit.
SMALLEST_SQUARE = 1e-280


@formula
def dot2(ax: float, ay: float, bx: float, by: float) -> float:
    """Return the scalar product of two plane vectors."""
    return ax * bx + ay * by


@formula
def cross2(ax: float, ay: float, bx: float, by: float) -> float:
    """Return ``b^T Q a``, Q the quarter turn: the sine from a to b, for unit vectors."""
    return ax * by - ay * bx


@formula
def squared_singular_values(aa: float, bb: float, ab: float, det2: float) -> tuple[float, float]:
    """Return the squared singular values (larger, smaller) of a matrix with rows a and b.

    ``aa``, ``bb``, ``ab`` are the scalar products of the rows and ``det2`` the squared determinant.
    The smaller one is det2 over the larger: their difference would cancel.
    """
    larger = 0.5 * (aa + bb + math.sqrt((aa - bb) * (aa - bb) + 4.0 * ab * ab))
    return larger, det2 / larger


@formula
def dot3(ax: float, ay: float, az: float, bx: float, by: float, bz: float) -> float:
    """Return the scalar product of two vectors."""
    return ax * bx + ay * by + az * bz


@formula
def cross3(
    ax: float, ay: float, az: float, bx: float, by: float, bz: float
) -> tuple[float, float, float]:
    """Return the vector product a x b."""
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@formula
def det3(
    ax: float, ay: float, az: float,
    bx: float, by: float, bz: float,
    cx: float, cy: float, cz: float,
) -> float:  # fmt: skip
    """Return the determinant of the matrix with rows (or columns) a, b, c."""
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


@formula
def solve3(
    ax: float, ay: float, az: float,
    bx: float, by: float, bz: float,
    cx: float, cy: float, cz: float,
    p: float, q: float, r: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Solve a . x = p, b . x = q, c . x = r: return x, y, z and the determinant."""
    bc_x, bc_y, bc_z = cross3(bx, by, bz, cx, cy, cz)
    ca_x, ca_y, ca_z = cross3(cx, cy, cz, ax, ay, az)
    ab_x, ab_y, ab_z = cross3(ax, ay, az, bx, by, bz)
    det = dot3(ax, ay, az, bc_x, bc_y, bc_z)
    scale = 1.0 / det
    return (
        (p * bc_x + q * ca_x + r * ab_x) * scale,
        (p * bc_y + q * ca_y + r * ab_y) * scale,
        (p * bc_z + q * ca_z + r * ab_z) * scale,
        det,
    )


@formula
def squared_singular_values3(
    aa: float, bb: float, cc: float, ab: float, ac: float, bc: float, det2: float
) -> tuple[float, float, float]:
    """Return the squared singular values, largest first, of a matrix with rows a, b and c.

    With S the traceless part of the Gram matrix and T that of S^2, scaled to the length of S, the
    angle between the two is three times that of the cubic's trigonometric solution. Its half is
    taken from |S - T| and |S + T|: its cosine would lose half the digits next to two equal values.
    The smallest one is ``det2``, the squared determinant, over the product of the others.
    """
    mean = (aa + bb + cc) / 3.0
    p, q, r = aa - mean, bb - mean, cc - mean
    x, y, z = ab * ab, ac * ac, bc * bc
    radius2 = max((p * p + q * q + r * r + 2.0 * (x + y + z)) / 6.0, SMALLEST_SQUARE)
    radius = math.sqrt(radius2)
    scale = 1.0 / radius
    tp = (p * p + x + y - 2.0 * radius2) * scale
    tq = (q * q + x + z - 2.0 * radius2) * scale
    tr = (r * r + y + z - 2.0 * radius2) * scale
    tab, tac, tbc = (
        (ac * bc - ab * r) * scale,
        (ab * bc - ac * q) * scale,
        (ab * ac - bc * p) * scale,
    )
    apart = _squared_length(p - tp, q - tq, r - tr, ab - tab, ac - tac, bc - tbc)
    along = _squared_length(p + tp, q + tq, r + tr, ab + tab, ac + tac, bc + tbc)
    cos, sin = _turn_by_third(math.sqrt(apart), math.sqrt(along), math.sqrt(apart + along))
    largest = mean + 2.0 * radius * (cos * cos - sin * sin)
    middle = mean + radius * (math.sqrt(12.0) * sin * cos - (cos * cos - sin * sin))
    return largest, middle, det2 / (largest * middle)


@formula
def _turn_by_third(sin: float, cos: float, length: float) -> tuple[float, float]:
    """Return cosine and sine of a third of an angle of 0 to 90 degrees, without trigonometry.

    The tangents t of its sixth and x of its half are roots of t^3 - 3 x t^2 - 3 t + x = 0. The
    start is right at both ends and up to 1 % off between them; two of Halley's steps leave nothing.
    """
    x = sin / (length + cos)
    t = x / (3.0 + (math.sqrt(3.0) - 1.0) * x * x)
    t = _halley(t, x)
    t = _halley(t, x)
    scale = 1.0 / (1.0 + t * t)
    return (1.0 - t * t) * scale, 2.0 * t * scale


@formula
def _halley(t: float, x: float) -> float:
    """Return a better root t of t^3 - 3 x t^2 - 3 t + x = 0."""
    miss = ((t - 3.0 * x) * t - 3.0) * t + x
    slope = (t - 2.0 * x) * t - 1.0  # a third of it
    return t - miss * slope / (3.0 * slope * slope - miss * (t - x))


@formula
def _squared_length(p: float, q: float, r: float, x: float, y: float, z: float) -> float:
    """Return the squared Frobenius norm of a symmetric matrix: diagonal, then off it."""
    return p * p + q * q + r * r + 2.0 * (x * x + y * y + z * z)


@formula
def squared_segment_distance(
    wx: float, wy: float, wz: float,
    ux: float, uy: float, uz: float,
    vx: float, vy: float, vz: float,
) -> float:  # fmt: skip
    """Return the squared distance of segments along u and v, w from the start of v to that of u."""
    uu, vv = dot3(ux, uy, uz, ux, uy, uz), dot3(vx, vy, vz, vx, vy, vz)
    uv = dot3(ux, uy, uz, vx, vy, vz)
    uw, vw = dot3(ux, uy, uz, wx, wy, wz), dot3(vx, vy, vz, wx, wy, wz)
    across = uu * vv - uv * uv
    s = unit_share((uv * vw - vv * uw) / across) if across > 1e-12 * uu * vv else 0.0
    t = unit_share((uv * s + vw) / vv)
    s = unit_share((uv * t - uw) / uu)
    dx, dy, dz = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return dot3(dx, dy, dz, dx, dy, dz)


@formula
def unit_share(t: float) -> float:
    """Return t within [0, 1]."""
    return min(1.0, max(0.0, t))
