"""Least distances of centre lines at the nodes: rods, other limbs' rails, the UPU limb."""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import squared_segment_distance
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.extremes import REACH, block_platform, least_excess
from pkm_gym.mechanisms.pss5_upu.indices import BLOCK, STATE, hold, place
from pkm_gym.mechanisms.pss5_upu.kinematics import LIMBS, PER_LIMB, Limb, Platform, limb_at

ROD_ROD, ROD_RAIL, ROD_UPU = range(3)
LINES = 6 * BLOCK  # of a limb's rods in a block: the S joint on the platform, the rod to it


@formula
def line(limb: Limb, p: Platform, L: float) -> tuple[float, float, float, float, float, float]:
    """Return where a rod begins, at its slider, and the rod as a vector, m."""
    ux, uy, uz = L * limb.fx, L * limb.fy, L * limb.fz
    return p.x + limb.ax - ux, p.y + limb.ay - uy, p.z + limb.az - uz, ux, uy, uz


@kernel
def draw_rods(
    state: FloatArray, layout: FloatArray, k: int, L: float, upu: float, rods: FloatArray
) -> None:
    """Fill ``rods`` (384,) with the ``line`` of the limb at k at a block's poses (448,)."""
    for w in range(BLOCK):
        p = block_platform(state, w, upu)
        x, y, z, ux, uy, uz = line(limb_at(layout, k, p, L), p, L)
        rods[w], rods[BLOCK + w], rods[2 * BLOCK + w] = x, y, z
        rods[3 * BLOCK + w], rods[4 * BLOCK + w], rods[5 * BLOCK + w] = ux, uy, uz


@kernel
def between_rods(a: FloatArray, b: FloatArray, out: FloatArray) -> None:
    """Lower ``out`` (64,) to the squared distance of two limbs' rods (384,)."""
    for w in range(BLOCK):
        found = squared_segment_distance(
            a[w] - b[w], a[BLOCK + w] - b[BLOCK + w], a[2 * BLOCK + w] - b[2 * BLOCK + w],
            a[3 * BLOCK + w], a[4 * BLOCK + w], a[5 * BLOCK + w],
            b[3 * BLOCK + w], b[4 * BLOCK + w], b[5 * BLOCK + w],
        )  # fmt: skip
        out[w] = min(out[w], found)


@kernel
def to_rail(a: FloatArray, layout: FloatArray, k: int, length: float, out: FloatArray) -> None:
    """Lower ``out`` (64,) to the squared distance of a limb's rods (384,) and the rail at k."""
    x, y = layout[k + 2], layout[k + 3]
    vx, vy, vz = length * layout[k + 4], length * layout[k + 5], length * layout[k + 6]
    for w in range(BLOCK):
        found = squared_segment_distance(
            a[w] - x, a[BLOCK + w] - y, a[2 * BLOCK + w],
            a[3 * BLOCK + w], a[4 * BLOCK + w], a[5 * BLOCK + w], vx, vy, vz,
        )  # fmt: skip
        out[w] = min(out[w], found)


@kernel
def to_upu(a: FloatArray, state: FloatArray, out: FloatArray) -> None:
    """Lower ``out`` (64,) to the squared distance of a limb's rods (384,) and the UPU limb O p."""
    for w in range(BLOCK):
        found = squared_segment_distance(
            a[w], a[BLOCK + w], a[2 * BLOCK + w],
            a[3 * BLOCK + w], a[4 * BLOCK + w], a[5 * BLOCK + w],
            state[w], state[BLOCK + w], state[2 * BLOCK + w],
        )  # fmt: skip
        out[w] = min(out[w], found)


@kernel
def distances(
    state: FloatArray, layout: FloatArray, L: float, length: float, upu: float,
    rods: FloatArray, out: FloatArray,
) -> None:  # fmt: skip
    """Fill ``out`` (3, 64) with the squared distances at a block's poses; ``rods`` (5, 384)."""
    out[:] = math.inf
    for i in range(LIMBS):
        draw_rods(state, layout, PER_LIMB * i, L, upu, rods[i])
        to_upu(rods[i], state, out[ROD_UPU])
        for j in range(LIMBS):
            if j < i:
                between_rods(rods[i], rods[j], out[ROD_ROD])
            if j != i:
                to_rail(rods[i], layout, PER_LIMB * j, length, out[ROD_RAIL])


@batch_kernel
def fill_clearances(
    unit: FloatArray,
    boxes: FloatArray,
    layouts: FloatArray,
    lengths: FloatArray,
    rails: FloatArray,
    upu: float,
    found: FloatArray,
    clearances: FloatArray,
) -> None:
    """Fill ``clearances`` (n, 3), m, at unit poses (k, 5); NaN out of reach.

    ``rails`` (n,) are the rails' lengths, m, ``found`` (n, 4 or more) see ``fill_ranges``.
    """
    for i in numba.prange(boxes.shape[0]):
        if not found[i, REACH] > 0.0:
            clearances[i, :] = math.nan
            continue
        state, rods, out = np.empty(STATE * BLOCK), np.empty((LIMBS, LINES)), np.empty((3, BLOCK))
        clearances[i, :] = math.inf
        for first in range(0, unit.shape[0], BLOCK):
            place(unit, first, boxes[i], state)
            distances(state, layouts[i], lengths[i], rails[i], upu, rods, out)
            for k in range(3):
                clearances[i, k] = min(clearances[i, k], math.sqrt(out[k].min()))


@batch_kernel
def clearances_batch(
    poses: FloatArray, layout: FloatArray, L: float, length: float, upu: float, found: FloatArray
) -> None:
    """Fill ``found`` (n, 3) with the distances, m, at poses (n, 5); NaN out of reach."""
    for n in numba.prange(poses.shape[0]):
        state, rods, out = np.empty(STATE * BLOCK), np.empty((LIMBS, LINES)), np.empty((3, BLOCK))
        hold(poses[n], state)
        distances(state, layout, L, length, upu, rods, out)
        reached = least_excess(layout, block_platform(state, 0, upu), L * L) > 0.0
        for k in range(3):
            found[n, k] = math.sqrt(out[k, 0]) if reached else math.nan
