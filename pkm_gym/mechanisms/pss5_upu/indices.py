"""The local indices at many poses, blocks of them in lockstep, and their means.

A block is flat and of fixed size, so that the compiler turns its loop into vector instructions.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.kinematics import limbs_at, platform
from pkm_gym.mechanisms.pss5_upu.transmission import LOCAL, local_indices

BLOCK = 64  # poses that are computed in lockstep
STATE = 7  # numbers of a pose there: x, y, z, then sine and cosine of beta and gamma
MEANS = LOCAL + 2  # theirs, of the local transmission index, and of where it is good
GOOD = 0.7  # the least of both transmissions from which GTW counts a pose
POSE_WORK = 0.25  # microseconds of a pose in a block

# What a box of poses holds: its centre x, z and half its width in x, y, z (m), beta, gamma (rad).
CENTRE_X, CENTRE_Z, HALF = 0, 1, 2
BOX = 7


def unit_poses(count: int) -> FloatArray:
    """Return a sample (count, 5) of the box: scrambled Sobol points from -1 to 1.

    x, y, z, beta, gamma. Unscrambled ones would hold the centre, where the paper's layout is
    singular.
    """
    from scipy.stats.qmc import Sobol

    return np.asarray(2.0 * Sobol(5, scramble=True, seed=0).random(count) - 1.0)


@kernel
def place(unit: FloatArray, first: int, box: FloatArray, state: FloatArray) -> None:
    """Fill ``state`` (448,) with the block of unit poses (n, 5) from ``first``, in a box (7,)."""
    for w in range(BLOCK):
        k = min(first + w, unit.shape[0] - 1)
        state[w] = box[CENTRE_X] + box[HALF] * unit[k, 0]
        state[BLOCK + w] = box[HALF + 1] * unit[k, 1]
        state[2 * BLOCK + w] = box[CENTRE_Z] + box[HALF + 2] * unit[k, 2]
        b, g = box[HALF + 3] * unit[k, 3], box[HALF + 4] * unit[k, 4]
        state[3 * BLOCK + w], state[4 * BLOCK + w] = math.sin(b), math.cos(b)
        state[5 * BLOCK + w], state[6 * BLOCK + w] = math.sin(g), math.cos(g)


@kernel
def hold(pose: FloatArray, state: FloatArray) -> None:
    """Fill ``state`` (448,) with one pose (5,), all over the block."""
    b, g = pose[3], pose[4]
    for w in range(BLOCK):
        state[w], state[BLOCK + w], state[2 * BLOCK + w] = pose[0], pose[1], pose[2]
        state[3 * BLOCK + w], state[4 * BLOCK + w] = math.sin(b), math.cos(b)
        state[5 * BLOCK + w], state[6 * BLOCK + w] = math.sin(g), math.cos(g)


@kernel
def block_indices(
    state: FloatArray, layout: FloatArray, L: float, upu: float, table: FloatArray
) -> None:
    """Fill ``table`` (256,) with the ``local_indices`` of a block's poses (448,)."""
    for w in range(BLOCK):
        p = platform(
            upu, state[w], state[BLOCK + w], state[2 * BLOCK + w], state[3 * BLOCK + w],
            state[4 * BLOCK + w], state[5 * BLOCK + w], state[6 * BLOCK + w],
        )  # fmt: skip
        found = local_indices(limbs_at(layout, p, L), p)
        table[w], table[BLOCK + w] = found[0], found[1]
        table[2 * BLOCK + w], table[3 * BLOCK + w] = found[2], found[3]


@kernel
def add_block(table: FloatArray, used: int, sums: FloatArray) -> None:
    """Add what the first ``used`` poses of a block's table (256,) count to ``sums`` (6,)."""
    for k in range(LOCAL):
        part = 0.0
        for w in range(used):
            part += table[k * BLOCK + w]
        sums[k] += part
    lti, good = 0.0, 0.0
    for w in range(used):
        least = min(table[2 * BLOCK + w], table[3 * BLOCK + w])
        lti += least
        good += 1.0 if least >= GOOD else 0.0
    sums[LOCAL] += lti
    sums[LOCAL + 1] += good


@batch_kernel
def fill_sums(
    unit: FloatArray,
    boxes: FloatArray,
    layouts: FloatArray,
    lengths: FloatArray,
    upu: float,
    parts: int,
    sums: FloatArray,
) -> None:
    """Fill ``sums`` (n, parts, 6) over unit poses (k, 5) in boxes (n, 7); each part on its core.

    Args:
        unit: array (k, 5), see ``unit_poses``.
        boxes: array (n, 7).
        layouts: array (n, 35), see ``lay_out``.
        lengths: array (n,), L, m.
        upu: see ``platform``.
        parts: into how many the poses of a design are shared out, whole blocks each.
        sums: filled, NaN where a pose is out of reach.
    """
    count = unit.shape[0]
    blocks = (count + BLOCK - 1) // BLOCK
    each = (blocks + parts - 1) // parts
    for item in numba.prange(boxes.shape[0] * parts):
        i, part = item // parts, item % parts
        state, table = np.empty(STATE * BLOCK), np.empty(LOCAL * BLOCK)
        sums[i, part, :] = 0.0
        for block in range(part * each, min(blocks, (part + 1) * each)):
            place(unit, block * BLOCK, boxes[i], state)
            block_indices(state, layouts[i], lengths[i], upu, table)
            add_block(table, min(BLOCK, count - block * BLOCK), sums[i, part])
