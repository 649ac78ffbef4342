"""What the limits are about, at the nodes of the box: reach, screws, rods, joints, singularity.

Nodes: the levels -, 0, + of x, y and the three angles, x >= 0 by symmetry: 162 poses. z moves all
sliders alike: only the stroke depends on it.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import squared_segment_distance
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.indices import BLOCK, place
from pkm_gym.mechanisms.pus6.influence import Leg, Legs, first_order
from pkm_gym.mechanisms.pus6.kinematics import (
    Rotation,
    legs_at,
    rotation,
    rotation_of,
    slider,
)

# Of a node: largest horizontal part of a rod squared, least and greatest slider, least cosine of an
# S joint times L^2, least squared distance of two rods, det G^-1.
PER_NODE = 6
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


def nodes() -> FloatArray:
    """Return the unit poses (162, 5) that the limits are looked for at."""
    levels = (-1.0, 0.0, 1.0)
    grid = np.meshgrid((0.0, 1.0), levels, levels, levels, levels, indexing="ij")
    return np.stack(grid, axis=-1).reshape(-1, 5)


@formula
def joint_cosine(leg: Leg, home: Leg, r: Rotation) -> float:
    """Return l_i in the platform's frame times l_i at home: L^2 times the cosine between them."""
    lx, ly, lz = leg[3], leg[4], leg[5]
    return (
        home[3] * (r[0] * lx + r[3] * ly + r[6] * lz)
        + home[4] * (r[1] * lx + r[4] * ly + r[7] * lz)
        + home[5] * (r[2] * lx + r[5] * ly + r[8] * lz)
    )


@formula
def squared_distance(ax: float, ay: float, a: Leg, bx: float, by: float, b: Leg) -> float:
    """Return the squared distance of two rods of equal length as segments, m^2.

    ``ax``, ``ay`` and ``bx``, ``by``: where their screws stand.
    """
    return squared_segment_distance(
        ax - bx, ay - by, slider(a) - slider(b), a[3], a[4], a[5], b[3], b[4], b[5]
    )


@formula
def flat_squared(leg: Leg) -> float:
    """Return the squared horizontal part of a rod, m^2; defined out of reach."""
    return leg[3] * leg[3] + leg[4] * leg[4]


@formula
def least(a: float, b: float, c: float, d: float, e: float, f: float) -> float:
    """Return the least of six numbers."""
    return min(a, b, c, d, e, f)


@formula
def most(a: float, b: float, c: float, d: float, e: float, f: float) -> float:
    """Return the greatest of six numbers."""
    return max(a, b, c, d, e, f)


@formula
def nearest(legs: Legs, p: FloatArray) -> float:
    """Return the least squared distance of two rods, m^2; ``p`` (30,) is the layout."""
    a, b, c, d, e, f = legs
    first = least(
        squared_distance(p[3], p[4], a, p[8], p[9], b),
        squared_distance(p[3], p[4], a, p[13], p[14], c),
        squared_distance(p[3], p[4], a, p[18], p[19], d),
        squared_distance(p[3], p[4], a, p[23], p[24], e),
        squared_distance(p[3], p[4], a, p[28], p[29], f),
        squared_distance(p[8], p[9], b, p[13], p[14], c),
    )
    second = least(
        squared_distance(p[8], p[9], b, p[18], p[19], d),
        squared_distance(p[8], p[9], b, p[23], p[24], e),
        squared_distance(p[8], p[9], b, p[28], p[29], f),
        squared_distance(p[13], p[14], c, p[18], p[19], d),
        squared_distance(p[13], p[14], c, p[23], p[24], e),
        squared_distance(p[13], p[14], c, p[28], p[29], f),
    )
    third = min(
        squared_distance(p[18], p[19], d, p[23], p[24], e),
        squared_distance(p[18], p[19], d, p[28], p[29], f),
    )
    return min(first, second, third, squared_distance(p[23], p[24], e, p[28], p[29], f))


@formula
def at_pose(
    legs: Legs, home: Legs, layout: FloatArray, r: Rotation
) -> tuple[float, float, float, float, float, float]:
    """Return what the limits are about at a pose: see ``PER_NODE``."""
    a, b, c, d, e, f = legs
    return (
        most(
            flat_squared(a), flat_squared(b), flat_squared(c),
            flat_squared(d), flat_squared(e), flat_squared(f),
        ),
        least(slider(a), slider(b), slider(c), slider(d), slider(e), slider(f)),
        most(slider(a), slider(b), slider(c), slider(d), slider(e), slider(f)),
        least(
            joint_cosine(a, home[0], r), joint_cosine(b, home[1], r),
            joint_cosine(c, home[2], r), joint_cosine(d, home[3], r),
            joint_cosine(e, home[4], r), joint_cosine(f, home[5], r),
        ),
        nearest(legs, layout),
        first_order(legs)[1],
    )  # fmt: skip


@kernel
def node_block(
    state: FloatArray, layout: FloatArray, home: Legs, L2: float, out: FloatArray
) -> None:
    """Fill ``out`` (6 x 64), see ``PER_NODE``, of a block's poses (8 x 64)."""
    for w in range(BLOCK):
        r = rotation(
            state[2 * BLOCK + w], state[3 * BLOCK + w], state[4 * BLOCK + w],
            state[5 * BLOCK + w], state[6 * BLOCK + w], state[7 * BLOCK + w],
        )  # fmt: skip
        found = at_pose(legs_at(layout, state[w], state[BLOCK + w], r, L2), home, layout, r)
        out[w], out[BLOCK + w], out[2 * BLOCK + w] = found[0], found[1], found[2]
        out[3 * BLOCK + w], out[4 * BLOCK + w] = found[3], found[4]
        out[5 * BLOCK + w] = found[5]


@kernel
def node_extremes(
    unit: FloatArray,
    xy: float,
    tilt: float,
    spin: float,
    layout: FloatArray,
    L2: float,
    state: FloatArray,
    out: FloatArray,
) -> tuple[float, float, float, float, float, float]:
    """Return the worst of the nodes (n, 5): see ``PER_NODE``; all but the first NaN out of reach.

    Reach (share of L), range of the sliders without that of z (m), least cosine of an S joint,
    least distance of two rods (m), det G^-1 at home, and the least of it over that.
    """
    home = legs_at(layout, 0.0, 0.0, IDENTITY, L2)
    at_home = first_order(home)[1]
    flat, low, high, cosine, near = 0.0, math.inf, -math.inf, math.inf, math.inf
    aspect = math.inf
    for first in range(0, unit.shape[0], BLOCK):
        place(unit, first, xy, tilt, spin, state)
        node_block(state, layout, home, L2, out)
        for w in range(BLOCK):
            flat = max(flat, out[w])
            low, high = min(low, out[BLOCK + w]), max(high, out[2 * BLOCK + w])
            cosine, near = min(cosine, out[3 * BLOCK + w]), min(near, out[4 * BLOCK + w])
            aspect = min(aspect, out[5 * BLOCK + w] / at_home)
    reach = math.sqrt(flat / L2)
    if not reach < 1.0:
        return reach, math.nan, math.nan, math.nan, at_home, math.nan
    return reach, high - low, cosine / L2, math.sqrt(near), at_home, aspect


@batch_kernel
def limits_batch(poses: FloatArray, layout: FloatArray, L: float, found: FloatArray) -> None:
    """Fill ``found`` (n, 6) with ``at_pose`` at ``poses`` (n, 6), det G^-1 over that of home."""
    for k in numba.prange(poses.shape[0]):
        home = legs_at(layout, 0.0, 0.0, IDENTITY, L * L)
        r = rotation_of(poses[k])
        values = at_pose(legs_at(layout, poses[k, 0], poses[k, 1], r, L * L), home, layout, r)
        for j in range(PER_NODE):
            found[k, j] = values[j]
        found[k, PER_NODE - 1] /= first_order(home)[1]
