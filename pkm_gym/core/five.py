"""Compiled algebra of vectors of five numbers and 5x5 matrices, on scalars.

A vector is a tuple, a symmetric matrix its fifteen entries on and above the diagonal, row by row.
"""

from __future__ import annotations

from pkm_gym.core.compile import formula

Five = tuple[float, float, float, float, float]
Ten = tuple[float, float, float, float, float, float, float, float, float, float]
Symmetric = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float,
    float, float,
]  # fmt: skip
Rows = tuple[Five, Five, Five, Five, Five]


@formula
def dot(a: Five, b: Five) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4]


@formula
def combined(x: float, a: Five, y: float, b: Five) -> Five:
    """Return x a + y b."""
    return (
        x * a[0] + y * b[0],
        x * a[1] + y * b[1],
        x * a[2] + y * b[2],
        x * a[3] + y * b[3],
        x * a[4] + y * b[4],
    )


@formula
def combined3(x: float, a: Five, y: float, b: Five, z: float, c: Five) -> Five:
    """Return x a + y b + z c."""
    return (
        x * a[0] + y * b[0] + z * c[0],
        x * a[1] + y * b[1] + z * c[1],
        x * a[2] + y * b[2] + z * c[2],
        x * a[3] + y * b[3] + z * c[3],
        x * a[4] + y * b[4] + z * c[4],
    )


@formula
def squared(a: Five) -> Symmetric:
    """Return a a^T."""
    return (
        a[0] * a[0], a[0] * a[1], a[0] * a[2], a[0] * a[3], a[0] * a[4],
        a[1] * a[1], a[1] * a[2], a[1] * a[3], a[1] * a[4],
        a[2] * a[2], a[2] * a[3], a[2] * a[4],
        a[3] * a[3], a[3] * a[4],
        a[4] * a[4],
    )  # fmt: skip


@formula
def product(a: Five, b: Five) -> Symmetric:
    """Return a b^T + b a^T."""
    return (
        2.0 * a[0] * b[0], a[0] * b[1] + a[1] * b[0], a[0] * b[2] + a[2] * b[0],
        a[0] * b[3] + a[3] * b[0], a[0] * b[4] + a[4] * b[0],
        2.0 * a[1] * b[1], a[1] * b[2] + a[2] * b[1], a[1] * b[3] + a[3] * b[1],
        a[1] * b[4] + a[4] * b[1],
        2.0 * a[2] * b[2], a[2] * b[3] + a[3] * b[2], a[2] * b[4] + a[4] * b[2],
        2.0 * a[3] * b[3], a[3] * b[4] + a[4] * b[3],
        2.0 * a[4] * b[4],
    )  # fmt: skip


@formula
def added(s: Symmetric, x: float, t: Symmetric) -> Symmetric:
    """Return s + x t."""
    return (
        s[0] + x * t[0], s[1] + x * t[1], s[2] + x * t[2], s[3] + x * t[3], s[4] + x * t[4],
        s[5] + x * t[5], s[6] + x * t[6], s[7] + x * t[7], s[8] + x * t[8], s[9] + x * t[9],
        s[10] + x * t[10], s[11] + x * t[11], s[12] + x * t[12], s[13] + x * t[13],
        s[14] + x * t[14],
    )  # fmt: skip


@formula
def rows_of(s: Symmetric) -> Rows:
    """Return the rows of a symmetric matrix."""
    return (
        (s[0], s[1], s[2], s[3], s[4]),
        (s[1], s[5], s[6], s[7], s[8]),
        (s[2], s[6], s[9], s[10], s[11]),
        (s[3], s[7], s[10], s[12], s[13]),
        (s[4], s[8], s[11], s[13], s[14]),
    )


@formula
def squared_norm(m: Rows) -> float:
    """Return the squared Frobenius norm."""
    return dot(m[0], m[0]) + dot(m[1], m[1]) + dot(m[2], m[2]) + dot(m[3], m[3]) + dot(m[4], m[4])


@formula
def minors2(a: Five, b: Five) -> Ten:
    """Return the 2x2 minors of two rows: columns 01, 02, 03, 04, 12, 13, 14, 23, 24, 34."""
    return (
        a[0] * b[1] - a[1] * b[0],
        a[0] * b[2] - a[2] * b[0],
        a[0] * b[3] - a[3] * b[0],
        a[0] * b[4] - a[4] * b[0],
        a[1] * b[2] - a[2] * b[1],
        a[1] * b[3] - a[3] * b[1],
        a[1] * b[4] - a[4] * b[1],
        a[2] * b[3] - a[3] * b[2],
        a[2] * b[4] - a[4] * b[2],
        a[3] * b[4] - a[4] * b[3],
    )


@formula
def minors4(m: Ten, n: Ten) -> Five:
    """Return the 4x4 minors without column 0 ... 4, from the 2x2 minors of either two rows.

    By Laplace's expansion; those without an odd column bear a minus.
    """
    return (
        m[4] * n[9] - m[5] * n[8] + m[6] * n[7] + m[7] * n[6] - m[8] * n[5] + m[9] * n[4],
        -(m[1] * n[9] - m[2] * n[8] + m[3] * n[7] + m[7] * n[3] - m[8] * n[2] + m[9] * n[1]),
        m[0] * n[9] - m[2] * n[6] + m[3] * n[5] + m[5] * n[3] - m[6] * n[2] + m[9] * n[0],
        -(m[0] * n[8] - m[1] * n[6] + m[3] * n[4] + m[4] * n[3] - m[6] * n[1] + m[8] * n[0]),
        m[0] * n[7] - m[1] * n[5] + m[2] * n[4] + m[4] * n[2] - m[5] * n[1] + m[7] * n[0],
    )


@formula
def cofactors(m: Rows) -> Rows:
    """Return the matrix of the cofactors, but for the sign of its odd rows.

    No pivots and no divisions: regular at singular matrices of rank four, and without branches.
    """
    m01, m34 = minors2(m[0], m[1]), minors2(m[3], m[4])
    return (
        minors4(minors2(m[1], m[2]), m34),
        minors4(minors2(m[0], m[2]), m34),
        minors4(m01, m34),
        minors4(m01, minors2(m[2], m[4])),
        minors4(m01, minors2(m[2], m[3])),
    )


@formula
def symmetric_cofactors_norm(c: Rows) -> float:
    """Return the squared Frobenius norm of the ``cofactors`` of a symmetric matrix."""
    return (
        c[0][0] ** 2 + c[1][1] ** 2 + c[2][2] ** 2 + c[3][3] ** 2 + c[4][4] ** 2
        + 2.0 * (
            c[0][1] ** 2 + c[0][2] ** 2 + c[0][3] ** 2 + c[0][4] ** 2 + c[1][2] ** 2
            + c[1][3] ** 2 + c[1][4] ** 2 + c[2][3] ** 2 + c[2][4] ** 2 + c[3][4] ** 2
        )
    )  # fmt: skip
