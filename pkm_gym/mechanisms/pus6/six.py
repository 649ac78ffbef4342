"""Compiled algebra of slider vectors, six numbers, and their coordinates across (1, ..., 1)."""

from __future__ import annotations

import math

from pkm_gym.core.compile import formula
from pkm_gym.core.five import Five

Six = tuple[float, float, float, float, float, float]

R2, R12 = math.sqrt(0.5), math.sqrt(1.0 / 12.0)
# The five directions across (1, ..., 1), as rows for each slider.
ACROSS = (
    (R2, 0.0, 0.0, 0.5, R12),
    (-R2, 0.0, 0.0, 0.5, R12),
    (0.0, R2, 0.0, -0.5, R12),
    (0.0, -R2, 0.0, -0.5, R12),
    (0.0, 0.0, R2, 0.0, -2.0 * R12),
    (0.0, 0.0, -R2, 0.0, -2.0 * R12),
)


@formula
def across(a: Six) -> Five:
    """Return the coordinates of a slider vector in the five directions across (1, ..., 1)."""
    s, t = a[0] + a[1], a[2] + a[3]
    return (
        R2 * (a[0] - a[1]),
        R2 * (a[2] - a[3]),
        R2 * (a[4] - a[5]),
        0.5 * (s - t),
        R12 * (s + t - 2.0 * (a[4] + a[5])),
    )


@formula
def along_sliders(v: Five) -> Six:
    """Return the slider vector of coordinates in the five directions."""
    s, t, u = 0.5 * v[3] + R12 * v[4], -0.5 * v[3] + R12 * v[4], -2.0 * R12 * v[4]
    return (
        s + R2 * v[0], s - R2 * v[0], t + R2 * v[1], t - R2 * v[1], u + R2 * v[2], u - R2 * v[2],
    )  # fmt: skip


@formula
def lifted(a: Six) -> Six:
    """Return the row of v_z with its part along (1, ..., 1): each slider lifts by a sixth."""
    s = 1.0 / 6.0
    return a[0] + s, a[1] + s, a[2] + s, a[3] + s, a[4] + s, a[5] + s


@formula
def mean(a: Six) -> float:
    """Return the mean of six numbers."""
    return (a[0] + a[1] + a[2] + a[3] + a[4] + a[5]) * (1.0 / 6.0)


@formula
def squares(a: Six) -> float:
    """Return the sum of the squares of six numbers."""
    return a[0] ** 2 + a[1] ** 2 + a[2] ** 2 + a[3] ** 2 + a[4] ** 2 + a[5] ** 2


@formula
def without(a: Six, b: Six) -> Six:
    """Return a without its part along b."""
    t = -(
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
    ) / squares(b)  # fmt: skip
    return (
        a[0] + t * b[0], a[1] + t * b[1], a[2] + t * b[2],
        a[3] + t * b[3], a[4] + t * b[4], a[5] + t * b[5],
    )  # fmt: skip


@formula
def beside(a: Six, x: Six, y: Six, z: Six) -> float:
    """Return the squared length of a without its parts along x, y and z, square to each other."""
    return squares(without(without(without(a, x), y), z))
