"""Rank and reciprocal condition of the limbs' system: five rods and what the UPU limb holds.

Its rows take (v, r omega) to 0 and lambda_i l'_i: [f_i, m_i / r], and the constraint, scaled to a
unit couple: [0, (sin beta, 0, cos beta)] where alpha = 0, [r u x s, u x (s x p)] / |u x (s x p)|
of the UPU limb, s the base's x axis and u the platform's.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import cross3
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.extremes import REACH, block_platform
from pkm_gym.mechanisms.pss5_upu.indices import BLOCK, STATE, hold, place
from pkm_gym.mechanisms.pss5_upu.kinematics import (
    LIMBS,
    PER_LIMB,
    Platform,
    limb_at,
)

Six = tuple[float, float, float, float, float, float]


@formula
def constraint(p: Platform, r: float, upu: float) -> Six:
    """Return the constraint's row."""
    if upu == 0.0:
        sin_b = -p.uz
        return 0.0, 0.0, 0.0, sin_b, 0.0, p.ux
    gx, gy, gz = cross3(p.ux, p.uy, p.uz, 0.0, -p.z, p.y)
    scale = 1.0 / math.sqrt(gx * gx + gy * gy + gz * gz)
    return 0.0, r * p.uz * scale, -r * p.uy * scale, gx * scale, gy * scale, gz * scale


@kernel
def fill_systems(
    state: FloatArray, layout: FloatArray, L: float, r: float, upu: float, systems: FloatArray
) -> None:
    """Fill ``systems`` (6, 6, 64) of a block's poses (448,), the constraint's row last."""
    for i in range(LIMBS):
        for w in range(BLOCK):
            p = block_platform(state, w, upu)
            limb = limb_at(layout, PER_LIMB * i, p, L)
            mx, my, mz = cross3(limb.ax, limb.ay, limb.az, limb.fx, limb.fy, limb.fz)
            row = limb.fx, limb.fy, limb.fz, mx / r, my / r, mz / r
            for k in range(6):
                systems[i, k, w] = row[k]
    for w in range(BLOCK):
        held = constraint(block_platform(state, w, upu), r, upu)
        for k in range(6):
            systems[LIMBS, k, w] = held[k]


@kernel
def fill_gram(systems: FloatArray, gram: FloatArray) -> None:
    """Fill the lower half of ``gram`` (6, 6, 64) with A A^T of ``systems`` A (6, 6, 64)."""
    for i in range(6):
        for j in range(i + 1):
            gram[i, j] = 0.0
            for k in range(6):
                for w in range(BLOCK):
                    gram[i, j, w] += systems[i, k, w] * systems[j, k, w]


@kernel
def fill_square_norms(halves: FloatArray, norms: FloatArray) -> None:
    """Fill ``norms`` (64,) with |S S|^2, Frobenius, of symmetric S by lower halves (6, 6, 64)."""
    norms[:] = 0.0
    entry = np.empty(BLOCK)
    for i in range(6):
        for j in range(i + 1):
            entry[:] = 0.0
            for k in range(6):
                a, b = halves[max(i, k), min(i, k)], halves[max(j, k), min(j, k)]
                for w in range(BLOCK):
                    entry[w] += a[w] * b[w]
            weight = 1.0 if i == j else 2.0
            for w in range(BLOCK):
                norms[w] += weight * entry[w] ** 2


@kernel
def fill_bounds(systems: FloatArray, gram: FloatArray, bounds: FloatArray) -> None:
    """Fill ``bounds`` (64,) with what rcond of ``systems`` (6, 6, 64) isn't below.

    (s6 / s1)^4 >= 1 / (|G^2| |G^-2|) in Frobenius norms, G the Gram matrix, ``gram`` (6, 6, 64)
    scratch: some 5 % below it. 0 at a singular system.
    """
    norms, inverses = np.empty(BLOCK), np.empty(BLOCK)
    fill_gram(systems, gram)
    fill_square_norms(gram, norms)
    for k in range(6):
        sweep(gram, k)
    fill_square_norms(gram, inverses)
    for w in range(BLOCK):
        bound = 1.0 / math.sqrt(math.sqrt(math.sqrt(norms[w] * inverses[w])))
        bounds[w] = bound if bound > 0.0 else 0.0  # noqa: FURB136  # NaN at a singular system


@kernel
def sweep(gram: FloatArray, k: int) -> None:
    """Sweep column k of symmetric G by lower halves (6, 6, 64): all six make -G^-1 of G."""
    column, inverse = np.empty((6, BLOCK)), np.empty(BLOCK)
    for w in range(BLOCK):
        inverse[w] = 1.0 / gram[k, k, w]
    for i in range(6):
        column[i] = gram[max(i, k), min(i, k)]
    for i in range(6):
        for j in range(i + 1):
            for w in range(BLOCK):
                gram[i, j, w] -= column[i, w] * (column[j, w] * inverse[w])
    for i in range(6):
        for w in range(BLOCK):
            gram[max(i, k), min(i, k), w] = column[i, w] * inverse[w]
    for w in range(BLOCK):
        gram[k, k, w] = -inverse[w]


@kernel
def least_rcond(
    unit: FloatArray,
    box: FloatArray,
    layout: FloatArray,
    L: float,
    r: float,
    upu: float,
    enough: float,
    systems: FloatArray,
) -> float:
    """Return the least rcond at unit poses (n, 5) within reach; ``systems`` (n / 64, 6, 6, 64).

    Its bound, which is smooth, where that is ``enough``. Else the eigenvalues of Gram matrices are
    computed where the bound is the least, then wherever it is less than what was found; singular
    values, exact near 0 as well, of the worst.
    """
    state, gram = np.empty(STATE * BLOCK), np.empty((6, 6, BLOCK))
    bounds = np.empty(systems.shape[0] * BLOCK)
    for block in range(systems.shape[0]):
        place(unit, block * BLOCK, box, state)
        fill_systems(state, layout, L, r, upu, systems[block])
        fill_bounds(systems[block], gram, bounds[block * BLOCK : (block + 1) * BLOCK])
    bounds = bounds[: unit.shape[0]]
    if not math.isfinite(bounds.sum() + systems.sum()):  # no machine
        return math.nan
    if bounds.min() > enough:
        return bounds.min()
    squared, worst = math.inf, np.int64(0)
    for at in np.argsort(bounds):
        if not bounds[at] ** 2 < squared:
            break
        system = np.ascontiguousarray(systems[at // BLOCK, :, :, at % BLOCK])
        values = np.linalg.eigvalsh(system @ system.T)
        if values[0] / values[5] < squared:
            squared, worst = values[0] / values[5], at
    system = np.ascontiguousarray(systems[worst // BLOCK, :, :, worst % BLOCK])
    exact = np.linalg.svd(system)[1]
    return exact[5] / exact[0]


@batch_kernel
def fill_rcond(
    unit: FloatArray,
    boxes: FloatArray,
    layouts: FloatArray,
    lengths: FloatArray,
    radii: FloatArray,
    upu: float,
    enough: float,
    found: FloatArray,
    least: FloatArray,
) -> None:
    """Fill ``least`` (n,) with the least rcond at unit poses (k, 5), NaN out of reach.

    ``radii`` (n,) are r, m, ``found`` (n, 4 or more) see ``fill_ranges``, ``enough``
    ``least_rcond``.
    """
    for i in numba.prange(boxes.shape[0]):
        least[i] = math.nan
        if found[i, REACH] > 0.0:
            systems = np.empty(((unit.shape[0] + BLOCK - 1) // BLOCK, 6, 6, BLOCK))
            least[i] = least_rcond(
                unit, boxes[i], layouts[i], lengths[i], radii[i], upu, enough, systems
            )


@batch_kernel
def systems_batch(
    poses: FloatArray, layout: FloatArray, L: float, r: float, upu: float, found: FloatArray
) -> None:
    """Fill ``found`` (n, 6, 6) with the limbs' system at poses (n, 5)."""
    for n in numba.prange(poses.shape[0]):
        state, systems = np.empty(STATE * BLOCK), np.empty((6, 6, BLOCK))
        hold(poses[n], state)
        fill_systems(state, layout, L, r, upu, systems)
        found[n] = systems[:, :, 0]
