"""Sliders, limbs and Jacobians of the 5-PSS/UPU at many poses."""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, kernel
from pkm_gym.core.five import Rows
from pkm_gym.core.linalg import cross3
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.kinematics import (
    LIMBS,
    Limb,
    limbs_at,
    motions,
    platform_of,
    rate_rows,
    spin,
)
from pkm_gym.mechanisms.pss5_upu.transmission import (
    LOCAL,
    limb_transmission,
    local_indices,
    scaled,
    several,
)

PER_LIMB_FOUND = 8  # arm (3), rod (3), lambda, slider


@batch_kernel
def limbs_batch(
    poses: FloatArray, layout: FloatArray, L: float, upu: float, found: FloatArray
) -> None:
    """Fill ``found`` (n, 5, 8) with each limb's arm, unit rod, lambda and slider."""
    for n in numba.prange(poses.shape[0]):
        limbs = limbs_at(layout, platform_of(poses[n], upu), L)
        for i in range(LIMBS):
            for k in range(PER_LIMB_FOUND):
                found[n, i, k] = limbs[i][k]


@batch_kernel
def yaw_batch(poses: FloatArray, upu: float, found: FloatArray) -> None:
    """Fill ``found`` (n, 4): alpha, and what alpha' is per vy, vz and beta'."""
    for n in numba.prange(poses.shape[0]):
        p = platform_of(poses[n], upu)
        found[n, 0] = math.asin(p.sin_a)
        found[n, 1], found[n, 2], found[n, 3] = p.yaw_y, p.yaw_z, p.yaw_b


@kernel
def inverse_row(limb: Limb, row: FloatArray) -> None:
    """Fill a limb's row (6,), l'_i = row . (omega, v)."""
    scale = 1.0 / limb.cosine
    mx, my, mz = cross3(limb.ax, limb.ay, limb.az, limb.fx, limb.fy, limb.fz)
    row[0], row[1], row[2] = mx * scale, my * scale, mz * scale
    row[3], row[4], row[5] = limb.fx * scale, limb.fy * scale, limb.fz * scale


@batch_kernel
def inverse_batch(
    poses: FloatArray, layout: FloatArray, L: float, upu: float, found: FloatArray
) -> None:
    """Fill ``found`` (n, 5, 6), slider rates = found @ (omega, v)."""
    for n in numba.prange(poses.shape[0]):
        limbs = limbs_at(layout, platform_of(poses[n], upu), L)
        for i in range(LIMBS):
            inverse_row(limbs[i], found[n, i])


@kernel
def barred(rows: Rows, moved: Rows, det: float) -> bool:
    """Return whether the pose is singular, so that J doesn't exist; not out of reach."""
    return det == 0.0 or (not several(rows, moved) and math.isfinite(det))


@batch_kernel
def rates_batch(
    poses: FloatArray, layout: FloatArray, L: float, upu: float, found: FloatArray
) -> None:
    """Fill ``found`` (n, 5, 5), (vx, vy, vz, gamma', beta') = found @ slider rates.

    Infinite at a singular pose.
    """
    for n in numba.prange(poses.shape[0]):
        p = platform_of(poses[n], upu)
        limbs = limbs_at(layout, p, L)
        rows = rate_rows(limbs, p)
        moved, det = motions(rows)
        if barred(rows, moved, det):
            found[n] = math.inf
            continue
        for i in range(LIMBS):
            scale = limbs[i].cosine / det
            for k in range(LIMBS):
                found[n, k, i] = scale * moved[i][k]


@batch_kernel
def twists_batch(
    poses: FloatArray, layout: FloatArray, L: float, upu: float, found: FloatArray
) -> None:
    """Fill ``found`` (n, 6, 5), (omega, v) = found @ slider rates; infinite at a singular pose."""
    for n in numba.prange(poses.shape[0]):
        p = platform_of(poses[n], upu)
        limbs = limbs_at(layout, p, L)
        rows = rate_rows(limbs, p)
        moved, det = motions(rows)
        if barred(rows, moved, det):
            found[n] = math.inf
            continue
        for i in range(LIMBS):
            column = scaled(limbs[i].cosine / det, moved[i])
            turn = spin(p, column)
            for k in range(3):
                found[n, k, i], found[n, 3 + k, i] = turn[k], column[k]


@batch_kernel
def local_batch(
    poses: FloatArray, layout: FloatArray, L: float, upu: float, found: FloatArray
) -> None:
    """Fill ``found`` (n, 4) with K_v, K_w, K_lambda and K_eta at poses (n, 5)."""
    for n in numba.prange(poses.shape[0]):
        p = platform_of(poses[n], upu)
        local = local_indices(limbs_at(layout, p, L), p)
        for k in range(LOCAL):
            found[n, k] = local[k]


@batch_kernel
def transmission_batch(
    poses: FloatArray, layout: FloatArray, L: float, upu: float, found: FloatArray
) -> None:
    """Fill ``found`` (n, 5, 2) with each limb's lambda_i and eta_i at poses (n, 5).

    eta_i = 0 at a singular pose, NaN out of reach.
    """
    for n in numba.prange(poses.shape[0]):
        p = platform_of(poses[n], upu)
        limbs = limbs_at(layout, p, L)
        rows = rate_rows(limbs, p)
        moved, det = motions(rows)
        none = barred(rows, moved, det)
        found[n] = 0.0 if none else math.nan
        for i in range(LIMBS):
            found[n, i, 0] = limbs[i].cosine
            if math.isfinite(det) and not none:
                found[n, i, 1] = limb_transmission(limbs[i], p, moved[i], det)
