"""The 3-SPR's mean conditioning index by components, for NumPy or JAX: XLA makes one loop of it."""

from __future__ import annotations

from typing import Any

import numpy as np

STEPS = 5  # of Newton, from home

AZIMUTHS = np.radians([120.0, -120.0, 0.0])
COS, SIN = np.cos(AZIMUTHS).tolist(), np.sin(AZIMUTHS).tolist()


def dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Any, b: Any) -> Any:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def solved(rows: Any, sides: Any) -> Any:
    """The vector whose products with three rows are the sides, by Cramer's rule."""
    a, b, c = rows
    minors = list(zip(cross(b, c), cross(c, a), cross(a, b), strict=True))
    scale = 1.0 / dot(a, cross(b, c))
    return [dot(minor, sides) * scale for minor in minors]


def anchors(hx: Any, hy: Any, s: Any, b: Any) -> Any:
    """B_i as the platform sees it, radially and along its normal."""
    scale, real, imaginary = b / (1.0 + hx * hx + hy * hy), hx * hx - hy * hy, 2.0 * hx * hy
    return [
        (
            scale * (1.0 - 2.0 * (real * cos - imaginary * sin)),
            2.0 * scale * (hx * cos + hy * sin) - s,
        )
        for cos, sin in zip(COS, SIN, strict=True)
    ]


def newton(hx: Any, hy: Any, s: Any, a: Any, b: Any, legs: Any) -> Any:
    rows, misses, scale = [], [], 1.0 / (1.0 + hx * hx + hy * hy)
    for cos, sin, q, (radial, normal) in zip(COS, SIN, legs, anchors(hx, hy, s, b), strict=True):
        arm, rise = radial - a, normal + s
        gx = -arm * (4.0 * b * (hx * cos - hy * sin) + 2.0 * hx * radial)
        gy = arm * (4.0 * b * (hy * cos + hx * sin) - 2.0 * hy * radial)
        gx += 2.0 * normal * (b * cos - hx * rise)
        gy += 2.0 * normal * (b * sin - hy * rise)
        rows.append((gx * scale, gy * scale, -normal))
        misses.append(0.5 * (q * q - arm * arm - normal * normal))
    dx, dy, ds = solved(rows, misses)
    return hx + dx, hy + dy, s + ds


def jacobian(xp: Any, hx: Any, hy: Any, s: Any, a: Any, b: Any) -> Any:
    """The rows of J."""
    found = anchors(hx, hy, s, b)
    held = [(-n * cos, -n * sin, p) for cos, sin, (p, n) in zip(COS, SIN, found, strict=True)]
    u, v = solved(held, SIN), solved(held, [-cos for cos in COS])
    rows = []
    for cos, sin, (radial, normal) in zip(COS, SIN, found, strict=True):
        length = xp.sqrt((radial - a) ** 2 + normal * normal)
        along, up = (a - radial) / length, -normal / length
        rows.append((
            along * cos + a * up * (sin * u[0] - cos * u[1]),
            along * sin + a * up * (sin * v[0] - cos * v[1]),
            up,
        ))  # fmt: skip
    return rows


def ratio(xp: Any, rows: Any) -> Any:
    """The smallest singular value over the largest one, by the cubic's trigonometric solution."""
    a, b, c = rows
    mean = (dot(a, a) + dot(b, b) + dot(c, c)) / 3.0
    p, q, r = dot(a, a) - mean, dot(b, b) - mean, dot(c, c) - mean
    x, y, z = dot(a, b), dot(a, c), dot(b, c)
    radius = xp.sqrt((p * p + q * q + r * r + 2.0 * (x * x + y * y + z * z)) / 6.0)
    half = 0.5 * (p * (q * r - z * z) - x * (x * r - y * z) + y * (x * z - y * q))
    third = xp.arccos(xp.clip(half / radius**3, -1.0, 1.0)) / 3.0
    largest = mean + 2.0 * radius * xp.cos(third)
    return xp.sqrt((mean + 2.0 * radius * xp.cos(third + 2.0 * np.pi / 3.0)) / largest)


def gci(xp: Any, designs: Any, lam: Any, nodes: Any, weights: Any) -> Any:
    """The index (n,) of designs (n, 2) whose joint boxes hold no isotropic pose."""
    a, leg = designs.T[..., None]
    b = 3.0 - a - leg
    legs = [leg * (1.0 + lam * node) for node in nodes.T]
    pose: Any = (0.0, 0.0, xp.sqrt(leg**2 - (b - a) ** 2))
    for _ in range(STEPS):
        pose = newton(*pose, a, b, legs)
    rows = jacobian(xp, *pose, a, b)
    parts = weights / abs(dot(rows[0], cross(rows[1], rows[2])))
    return (parts * ratio(xp, rows)).sum(axis=1) / parts.sum(axis=1)
