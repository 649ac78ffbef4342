"""G and H at many poses: the influence coefficients in slider coordinates."""

from __future__ import annotations

import numba

from pkm_gym.core.compile import batch_kernel, kernel
from pkm_gym.core.five import Five, Symmetric, rows_of
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.influence import (
    Legs,
    first_order,
    over_drops,
    second_order,
    weighted,
)
from pkm_gym.mechanisms.pus6.kinematics import fill_inverse_row, legs_at, rotation_of
from pkm_gym.mechanisms.pus6.six import ACROSS, along_sliders, lifted


@kernel
def fill_first_order(legs: Legs, G: FloatArray) -> None:
    """Fill G (6, 6), rows omega (rad/m) and v, columns sliders."""
    rows = first_order(legs)[0]
    for k in range(6):
        row = along_sliders(rows[k])
        if k == 5:
            row = lifted(row)
        for i in range(6):
            G[k, i] = row[i]


@kernel
def fill_slice(s: Symmetric, a: Five, b: Five, skew: float, H: FloatArray) -> None:
    """Fill a slice H (6, 6) in slider coordinates: s + skew (a b^T - b a^T) / 2."""
    rows = rows_of(s)
    for i in range(6):
        for j in range(6):
            value = 0.0
            for p in range(5):
                for q in range(5):
                    part = rows[p][q] + 0.5 * skew * (a[p] * b[q] - b[p] * a[q])
                    value += ACROSS[i][p] * part * ACROSS[j][q]
            H[i, j] = value


@batch_kernel
def first_order_batch(poses: FloatArray, layout: FloatArray, L: float, G: FloatArray) -> None:
    """Fill ``G`` (n, 6, 6) at ``poses`` (n, 6)."""
    for k in numba.prange(poses.shape[0]):
        r = rotation_of(poses[k])
        fill_first_order(legs_at(layout, poses[k, 0], poses[k, 1], r, L * L), G[k])


@batch_kernel
def inverse_batch(poses: FloatArray, layout: FloatArray, L: float, inverse: FloatArray) -> None:
    """Fill ``inverse`` (n, 6, 6), G^-1, at ``poses`` (n, 6): slider rates = G^-1 (omega, v)."""
    for k in numba.prange(poses.shape[0]):
        r = rotation_of(poses[k])
        legs = legs_at(layout, poses[k, 0], poses[k, 1], r, L * L)
        for i in range(6):
            fill_inverse_row(legs[i], inverse[k, i])


@batch_kernel
def second_order_batch(
    poses: FloatArray, layout: FloatArray, L: float, skew: float, H: FloatArray
) -> None:
    """Fill ``H`` (n, 6, 6, 6) at ``poses`` (n, 6): slices k of (omega, v)' = G q'' + q'^T H q'."""
    for n in numba.prange(poses.shape[0]):
        legs = legs_at(layout, poses[n, 0], poses[n, 1], rotation_of(poses[n]), L * L)
        rows = first_order(legs)[0]
        wx, wy, wz, none = rows[0], rows[1], rows[2], rows[3]
        forms, reach, spin = second_order(legs, rows)
        first, second = (wy, wz, wx, none, none, none), (wz, wx, wy, none, none, none)
        for k in range(6):
            row = along_sliders(rows[k])
            if k == 5:
                row = lifted(row)
            s = weighted(over_drops(row, legs), forms, reach, spin)
            fill_slice(s, first[k], second[k], skew if k < 3 else 0.0, H[n, k])
