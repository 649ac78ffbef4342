"""All assembly modes of the 3-SPR: every real pose with given leg lengths, both operation modes.

With beta_i the angle of leg i at its R joint, B_i stands at (a + q_i cos beta_i) e_i +
q_i sin beta_i w in the platform's frame. The B_i are the corners of an equilateral triangle with
the side sqrt(3) b, which gives three equations in pairs of angles. Two of them are lines for beta_2
and beta_3 once beta_1 is chosen; the resultant that is left is a polynomial of degree 8 in
cos beta_1, known from its values at nine Chebyshev nodes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numpy.polynomial import chebyshev

from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.kinematics import COS, SIN

DEGREE = 8
ComplexArray = npt.NDArray[np.complex128]

# Equal legs make double roots, which rounding drives off the real axis: every root this near to it
# starts Newton, and what doesn't converge to a real pose is dropped.
NEARLY_REAL = 1e-2
NEWTON_STEPS = 50
SOLVED = 1e-12  # of the residual, in units of b^2 + q^2
APART = 1e-6  # rad: modes nearer to one another are one


class AssemblyModes(NamedTuple):
    """Real poses with the same leg lengths, the home side's first, then by tilt.

    ``operation_mode`` is 1 without torsion, 2 where the platform is turned half round in its plane.
    """

    positions: FloatArray  # (k, 3), m, of O_A
    rotations: FloatArray  # (k, 3, 3), columns u, v, w
    operation_mode: npt.NDArray[np.int64]  # (k,)


def all_assembly_modes(joints: FloatArray, a: float, b: float) -> AssemblyModes:
    """Return every real pose with the leg lengths ``joints`` (3,), m: none to sixteen.

    Poses that meet, at a parallel singularity, may be counted once or not found.
    """
    q = np.asarray(joints, dtype=float)
    nodes = chebyshev.chebpts1(DEGREE + 1)
    roots = chebyshev.chebroots(chebyshev.chebfit(nodes, _resultant(nodes, q, a, b), DEGREE))
    near = (np.abs(roots.imag) < NEARLY_REAL) & (np.abs(roots.real) < 1.0 + NEARLY_REAL)
    cosines = np.clip(roots[near].real, -1.0, 1.0)
    others = _other_angles(cosines, q, a, b)
    starts = np.concatenate([
        np.stack([np.arccos(cosines), others[0][i].real, others[1][j].real], axis=-1)
        for i in range(2) for j in range(2)
    ])  # fmt: skip
    found = _polished(starts, q, a, b)
    found = _different(np.concatenate([found, -found]))
    return _sorted_poses(found, q, a, b)


def _line(cosine: FloatArray, q: FloatArray, j: int, a: float, b: float) -> tuple[FloatArray, ...]:
    """Return A, B, C of A cos beta_j + B sin beta_j + C = 0, for cosines (n,) of beta_1."""
    sine = np.sqrt(1.0 - cosine**2)
    radial, height = a + q[0] * cosine, q[0] * sine
    constant = a**2 + q[j] ** 2 + a * radial + radial**2 + height**2 - 3.0 * b**2
    return (2.0 * a + radial) * q[j], -2.0 * height * q[j], constant


def _other_angles(
    cosine: FloatArray, q: FloatArray, a: float, b: float
) -> list[list[ComplexArray]]:
    """Return the two solutions (n,), complex where there is no real one, of beta_2 and beta_3."""
    pairs = []
    for j in (1, 2):
        A, B, C = _line(cosine, q, j, a, b)
        middle = np.arctan2(B, A).astype(complex)
        swing = np.arccos((-C / np.hypot(A, B)).astype(complex))
        pairs.append([middle + swing, middle - swing])
    return pairs


def _resultant(cosine: FloatArray, q: FloatArray, a: float, b: float) -> FloatArray:
    pairs = _other_angles(cosine, q, a, b)
    product = np.ones_like(cosine, dtype=complex)
    for two in pairs[0]:
        for three in pairs[1]:
            product *= _gap(two, three, q[1], q[2], a, b)
    for j in (1, 2):
        A, B, _ = _line(cosine, q, j, a, b)
        product *= (A**2 + B**2) ** 2
    return product.real


def _gap(one: Any, other: Any, p: float, q: float, a: float, b: float) -> Any:
    """Return |B_i - B_j|^2 - 3 b^2, m^2, from the angles at two R joints."""
    r, s = a + p * np.cos(one), a + q * np.cos(other)
    rise = p * np.sin(one) - q * np.sin(other)
    return r * r + s * s + r * s + rise * rise - 3.0 * b * b


def _polished(angles: FloatArray, q: FloatArray, a: float, b: float) -> FloatArray:
    """Return the real solutions that Newton reaches from starts (n, 3) of the three angles."""
    pairs = ((0, 1), (1, 2), (2, 0))
    with np.errstate(all="ignore"):
        for _ in range(NEWTON_STEPS):
            radial, height = a + q * np.cos(angles), q * np.sin(angles)
            slopes = np.zeros((len(angles), 3, 3))
            for row, (i, j) in enumerate(pairs):
                rise = height[:, i] - height[:, j]
                for k, other, sign in ((i, j, 2.0), (j, i, -2.0)):
                    sideways = (2.0 * radial[:, k] + radial[:, other]) * height[:, k]
                    slopes[:, row, k] = sign * rise * q[k] * np.cos(angles[:, k]) - sideways
            steps = np.einsum("nij,nj->ni", np.linalg.pinv(slopes), _gaps(angles, q, a, b))
            angles = angles - np.clip(steps, -0.5, 0.5)
        solved = np.abs(_gaps(angles, q, a, b)).max(axis=1) < SOLVED * (b**2 + q @ q)
    found: FloatArray = angles[solved]
    return found


def _gaps(angles: FloatArray, q: FloatArray, a: float, b: float) -> FloatArray:
    """Return |B_i - B_j|^2 - 3 b^2 (n, 3) of the pairs 12, 23, 31 from the angles (n, 3)."""
    pairs = ((0, 1), (1, 2), (2, 0))
    gaps = [_gap(angles[:, i], angles[:, j], q[i], q[j], a, b) for i, j in pairs]
    return np.stack(gaps, axis=-1)


def _different(angles: FloatArray) -> FloatArray:
    """Return the rows (k, 3) that differ, as angles."""
    kept: list[FloatArray] = []
    for row in angles:
        if all(np.abs(np.sin(0.5 * (row - other))).max() > 0.5 * APART for other in kept):
            kept.append(row)
    return np.array(kept).reshape(-1, 3)


def _sorted_poses(angles: FloatArray, q: FloatArray, a: float, b: float) -> AssemblyModes:
    """Return the poses of angles (k, 3) at the R joints."""
    radial, height = a + q * np.cos(angles), q * np.sin(angles)
    points = np.stack([radial * COS, radial * SIN, height], axis=-1)
    center = points.mean(axis=1)
    x = (points[:, 2] - center) / b
    y = (points[:, 0] - points[:, 1]) / (np.sqrt(3.0) * b)
    rotations = np.stack([x, y, np.cross(x, y)], axis=1)
    positions = -np.einsum("nij,nj->ni", rotations, center)
    torsionless = rotations[:, 0, 0] + rotations[:, 1, 1] >= 0.0
    mode = np.where(torsionless, 1, 2)
    depth = np.einsum("ni,ni->n", positions, rotations[:, :, 2])
    order = np.lexsort((-rotations[:, 2, 2], mode, depth <= 0.0))
    return AssemblyModes(positions[order], rotations[order], mode[order])
