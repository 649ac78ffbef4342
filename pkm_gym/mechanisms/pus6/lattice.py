"""The workspace of the paper's averages, as reconstructed from its tables.

The paper prints the steps, 4 cm and 12 deg, not the ranges, the travel of the screws or the home;
these were identified from its Tables 1 and 2, so they are a calibration, not a quotation. A pose
counts where all six sliders are within their travel. z moves all sliders alike, so each (x, y,
orientation) is computed once and counted for the levels of z that it reaches; x < 0 is the mirror
image of x > 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.indices import (
    BLOCK,
    ETAS,
    LOCAL,
    POSE_WORK,
    STATE,
    states_of,
    tabulate,
)
from pkm_gym.mechanisms.pus6.kinematics import legs_at, rotation, slider
from pkm_gym.mechanisms.pus6.limits import IDENTITY, least, most

X = np.arange(2.0, 19.0, 4.0) * 1e-2  # m; -18 ... 18 cm without its mirror image
Y = np.arange(-11.0, 22.0, 4.0) * 1e-2
Z = (-0.04, 0.0, 0.04)
ALPHA = np.radians(np.arange(-54.0, 55.0, 12.0))
BETA = np.radians(np.arange(-72.0, 73.0, 12.0))
GAMMA = np.radians(np.arange(-60.0, 61.0, 12.0))
DOWN, UP = -0.175, 0.119  # m, travel of a slider from home


@dataclass(frozen=True)
class Averages:
    """What one design has over the paper's lattice.

    Attributes:
        means: array (6,), of the six indices; NaN where nothing is reached.
        poses: how many are counted, Table 1.
        different: how many of them differ in more than z.
        beyond: how many of the poses lie beyond the direct singularity.
    """

    means: FloatArray
    poses: int
    different: int
    beyond: int


@cache
def lattice_states() -> FloatArray:
    """Return the lattice's states (8, n), see ``indices``, x > 0 alone."""
    axes = np.meshgrid(X, Y, ALPHA, BETA, GAMMA, indexing="ij")
    poses = np.stack(axes, axis=-1).reshape(-1, 5)
    blocks = states_of(poses).reshape(-1, STATE, BLOCK)
    return np.ascontiguousarray(blocks.swapaxes(0, 1).reshape(STATE, -1)[:, : len(poses)])


@batch_kernel
def count_levels(states: FloatArray, layout: FloatArray, L2: float, levels: FloatArray) -> None:
    """Fill ``levels`` (n,) with how many levels of z each of the states (8, n) reaches."""
    home = slider(legs_at(layout, 0.0, 0.0, IDENTITY, L2)[0])
    for k in numba.prange(states.shape[1]):
        r = rotation(
            states[2, k], states[3, k], states[4, k], states[5, k], states[6, k], states[7, k]
        )
        a, b, c, d, e, f = legs_at(layout, states[0, k], states[1, k], r, L2)
        low = least(slider(a), slider(b), slider(c), slider(d), slider(e), slider(f)) - home
        high = most(slider(a), slider(b), slider(c), slider(d), slider(e), slider(f)) - home
        reached = a[5] + b[5] + c[5] + d[5] + e[5] + f[5] < 0.0  # not NaN
        levels[k] = 0.0
        for z in Z:
            if reached and low + z >= DOWN and high + z <= UP:
                levels[k] += 1.0


def averages(
    layout: FloatArray, L: float, length: float, skew: float, same_aspect: bool = False
) -> Averages:
    """Return a design's ``Averages``.

    Args:
        layout: array (30,), see ``lay_out``.
        L: length of the rods, m.
        length: characteristic length, m.
        skew: 1 for the influence convention, 0 for the symmetric one.
        same_aspect: leave out the poses beyond the direct singularity.
    """
    states = lattice_states()
    levels = np.empty(states.shape[1])
    count_levels(0.05 * len(levels), states, layout, L * L, levels)
    reached = np.flatnonzero(levels)
    if len(reached) == 0:
        return Averages(np.full(ETAS, np.nan), 0, 0, 0)
    table = _table(states[:, reached], layout, L, length, skew)
    home = _table(np.array([[0.0, 0, 0, 1, 0, 1, 0, 1]]).T, layout, L, length, skew)[ETAS, 0]
    beyond = table[ETAS] * home < 0.0
    weights = levels[reached]
    across = 2 * int(weights[beyond].sum())
    if same_aspect:
        weights, table = weights[~beyond], table[:, ~beyond]
    total = weights.sum()
    means = table[:ETAS] @ weights / total if total > 0.0 else np.full(ETAS, np.nan)
    return Averages(means, 2 * int(total), 2 * len(weights), across)


def _table(
    states: FloatArray, layout: FloatArray, L: float, length: float, skew: float
) -> FloatArray:
    """Return 1/K of the six indices and det G^-1 (7, n) at states (8, n)."""
    n = states.shape[1]
    blocks = -(-n // BLOCK)
    padded = np.pad(states, ((0, 0), (0, blocks * BLOCK - n)), mode="edge")
    rows = padded.reshape(STATE, blocks, BLOCK).swapaxes(0, 1).reshape(1, blocks, -1)
    tables = np.empty((1, blocks, LOCAL * BLOCK))
    one = np.array([L * L]), np.array([length])
    tabulate(POSE_WORK * n, np.ascontiguousarray(rows), layout[None], *one, skew, tables)
    return tables.reshape(blocks, LOCAL, BLOCK).swapaxes(0, 1).reshape(LOCAL, -1)[:, :n]
