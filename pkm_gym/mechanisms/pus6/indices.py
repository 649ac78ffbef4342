"""The six indices at many poses, blocks of them in lockstep, and their means.

A block is flat and of fixed size, so that the compiler turns its loop into vector instructions: one
kernel for a box, a lattice and any other poses.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.influence import local_indices
from pkm_gym.mechanisms.pus6.kinematics import legs_at, rotation

BLOCK = 64  # poses that are computed in lockstep
STATE = 8  # numbers of a pose there: x, y, then sine and cosine of alpha, beta, gamma
ETAS = 6
LOCAL = ETAS + 1  # 1/K of the six indices, and det G^-1
POSE_WORK = 0.12  # microseconds of a pose in a block


def unit_poses(count: int) -> FloatArray:
    """Return a sample (count, 5) of the half box: scrambled Sobol points, x >= 0.

    x, y, alpha, beta, gamma from -1 to 1; the mirror image of a pose has the same indices.
    """
    from scipy.stats.qmc import Sobol

    points = 2.0 * Sobol(5, scramble=True, seed=0).random(count) - 1.0
    points[:, 0] = np.abs(points[:, 0])
    return np.asarray(points)


def states_of(poses: FloatArray) -> FloatArray:
    """Return the states (blocks, 512) of poses (n, 5): x, y, alpha, beta, gamma, m and rad.

    Beyond the last pose its block repeats it.
    """
    blocks = -(-len(poses) // BLOCK)
    states = np.empty((1, blocks, STATE * BLOCK))
    place_batch(0.1 * len(poses), poses, np.ones((1, 3)), states)
    return states[0]


@kernel
def place(
    unit: FloatArray, first: int, xy: float, tilt: float, spin: float, state: FloatArray
) -> None:
    """Fill ``state`` (512,) with the block of unit poses (n, 5) from ``first``, scaled to a box."""
    for w in range(BLOCK):
        k = min(first + w, unit.shape[0] - 1)
        state[w] = xy * unit[k, 0]
        state[BLOCK + w] = xy * unit[k, 1]
        a, b, g = tilt * unit[k, 2], tilt * unit[k, 3], spin * unit[k, 4]
        state[2 * BLOCK + w], state[3 * BLOCK + w] = math.sin(a), math.cos(a)
        state[4 * BLOCK + w], state[5 * BLOCK + w] = math.sin(b), math.cos(b)
        state[6 * BLOCK + w], state[7 * BLOCK + w] = math.sin(g), math.cos(g)


@batch_kernel
def place_batch(unit: FloatArray, boxes: FloatArray, states: FloatArray) -> None:
    """Fill ``states`` (n, blocks, 512) with unit poses (k, 5) in ``boxes`` (n, 3).

    A box is half the width in x and y (m), the largest tilt and spin (rad).
    """
    blocks = states.shape[1]
    for item in numba.prange(states.shape[0] * blocks):
        i, block = item // blocks, item % blocks
        place(unit, block * BLOCK, boxes[i, 0], boxes[i, 1], boxes[i, 2], states[i, block])


@kernel
def block_indices(
    state: FloatArray, layout: FloatArray, L2: float, lc: float, skew: float, table: FloatArray
) -> None:
    """Fill ``table`` (448,) with the ``local_indices`` of a block's poses (512,)."""
    for w in range(BLOCK):
        r = rotation(
            state[2 * BLOCK + w], state[3 * BLOCK + w], state[4 * BLOCK + w],
            state[5 * BLOCK + w], state[6 * BLOCK + w], state[7 * BLOCK + w],
        )  # fmt: skip
        found = local_indices(legs_at(layout, state[w], state[BLOCK + w], r, L2), lc, skew)
        table[w], table[BLOCK + w], table[2 * BLOCK + w] = found[0], found[1], found[2]
        table[3 * BLOCK + w], table[4 * BLOCK + w] = found[3], found[4]
        table[5 * BLOCK + w], table[6 * BLOCK + w] = found[5], found[6]


@batch_kernel
def tabulate(
    states: FloatArray,
    layouts: FloatArray,
    squares: FloatArray,
    lengths: FloatArray,
    skew: float,
    tables: FloatArray,
) -> None:
    """Fill ``tables`` (n, blocks, 448) of n designs; each block may go to another core.

    Args:
        states: array (n, blocks, 512), or (1, blocks, 512) for all designs.
        layouts: array (n, 30), see ``lay_out``.
        squares: array (n,), L^2, m^2.
        lengths: array (n,), characteristic lengths, m.
        skew: see ``local_indices``.
        tables: filled: 1/K of the six indices and det G^-1, each at 64 poses.
    """
    blocks = tables.shape[1]
    for item in numba.prange(tables.shape[0] * blocks):
        i, block = item // blocks, item % blocks
        state = states[own_row(i, states.shape[0]), block]
        block_indices(state, layouts[i], squares[i], lengths[i], skew, tables[i, block])


@batch_kernel
def fill_means(tables: FloatArray, count: int, means: FloatArray) -> None:
    """Fill ``means`` (n, 6) of the first ``count`` poses of ``tables`` (n, blocks, 448)."""
    for i in numba.prange(tables.shape[0]):
        for k in range(ETAS):
            total = 0.0
            for block in range(tables.shape[1]):
                part = 0.0
                for w in range(min(BLOCK, count - block * BLOCK)):
                    part += tables[i, block, k * BLOCK + w]
                total += part
            means[i, k] = total / count
