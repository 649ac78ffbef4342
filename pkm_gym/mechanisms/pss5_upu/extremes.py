"""What the limits are about, at the nodes of the box: reach, sliders, joints, forces, singularity.

Nodes: the levels -, 0, + of all five coordinates, half of them by the mirror y -> -y: 135 poses;
or five levels: 1,625.
"""

from __future__ import annotations

import itertools
import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import cross3, dot3
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.indices import BLOCK, STATE, place
from pkm_gym.mechanisms.pss5_upu.kinematics import (
    Limb,
    Limbs,
    Platform,
    excess,
    limbs_at,
    motions,
    platform,
    rate_rows,
)
from pkm_gym.mechanisms.pss5_upu.transmission import output_transmission

Five = tuple[float, float, float, float, float]

# What is found of a design: least disc_i / L^2, least lambda_i, range of the sliders (m); NaN but
# for the first out of reach.
REACH, COSINE, LOW, HIGH = range(4)
EXTREMES = 4
# Then, where a layout must work: least K_eta, least determinant (m^2, its sign at the centre 1),
# largest force of a slider per vertical load, least cosine of a rod to its line at the centre.
ETA, DET, FORCE, SWING = range(4, 8)
SKEW_EXTREMES = 8


def nodes(levels: int = 3) -> FloatArray:
    """Return the unit poses (135, 5) that the limits are looked for at; 5 levels: (1625, 5)."""
    grid = np.array(list(itertools.product(np.linspace(-1.0, 1.0, levels), repeat=5)))
    y, gamma = grid[:, 1], grid[:, 4]
    return grid[(y > 0.0) | ((y == 0.0) & (gamma >= 0.0))]


@formula
def block_platform(state: FloatArray, w: int, upu: float) -> Platform:
    """Return the platform of pose w of a block (448,)."""
    return platform(
        upu, state[w], state[BLOCK + w], state[2 * BLOCK + w], state[3 * BLOCK + w],
        state[4 * BLOCK + w], state[5 * BLOCK + w], state[6 * BLOCK + w],
    )  # fmt: skip


@formula
def least_excess(layout: FloatArray, p: Platform, L2: float) -> float:
    """Return the least disc_i / L^2 of a ``layout`` (35,), < 0 out of reach."""
    return min(
        excess(layout, 0, p, L2),
        excess(layout, 7, p, L2),
        excess(layout, 14, p, L2),
        excess(layout, 21, p, L2),
        excess(layout, 28, p, L2),
    )


@kernel
def ranges(
    unit: FloatArray, box: FloatArray, layout: FloatArray, L: float, upu: float, state: FloatArray
) -> tuple[float, float, float]:
    """Return the least disc_i / L^2 and the range of the sliders, m, at unit poses (n, 5).

    Where the UPU limb can't turn as it must, the pose is as far out of reach as L.
    """
    reach, low, high, defined = math.inf, math.inf, -math.inf, True
    for first in range(0, unit.shape[0], BLOCK):
        place(unit, first, box, state)
        for w in range(BLOCK):
            p = block_platform(state, w, upu)
            a, b, c, d, e = limbs_at(layout, p, L)
            least = least_excess(layout, p, L * L)
            defined &= p.cos_a > 0.0  # the UPU limb can turn so far
            reach = min(reach, least)
            low = min(low, a.slider, b.slider, c.slider, d.slider, e.slider)
            high = max(high, a.slider, b.slider, c.slider, d.slider, e.slider)
    return reach if defined else min(reach, -1.0), low, high


@batch_kernel
def fill_ranges(
    unit: FloatArray,
    boxes: FloatArray,
    layouts: FloatArray,
    lengths: FloatArray,
    upu: float,
    found: FloatArray,
) -> None:
    """Fill ``found`` (n, 4 or more): REACH, COSINE, LOW, HIGH at unit poses (k, 5)."""
    for i in numba.prange(boxes.shape[0]):
        state = np.empty(STATE * BLOCK)
        reach, low, high = ranges(unit, boxes[i], layouts[i], lengths[i], upu, state)
        inside = reach > 0.0
        found[i, REACH] = reach
        found[i, COSINE] = math.sqrt(reach) if inside else math.nan
        found[i, LOW] = low if inside else math.nan
        found[i, HIGH] = high if inside else math.nan


# Where a layout must work -------------------------------------------------------------------------


@formula
def vertical(limb: Limb, motion: Five, det: float) -> float:
    """Return the force of a limb's slider per vertical load at p: J^T (0, 0, 1, 0, 0)."""
    return abs(limb.cosine * motion[2] / det)


@formula
def swing_in_base(limb: Limb, centre: Limb) -> float:
    """Return the cosine of a rod to where it stands at the centre, seen from the base."""
    return dot3(limb.fx, limb.fy, limb.fz, centre.fx, centre.fy, centre.fz)


@formula
def swing_in_platform(limb: Limb, centre: Limb, p: Platform) -> float:
    """Return the cosine of a rod to where it stands at the centre, seen from the platform."""
    vx, vy, vz = cross3(p.ux, p.uy, p.uz, p.wx, p.wy, p.wz)
    fx, fy, fz = limb.fx, limb.fy, limb.fz
    return dot3(
        dot3(fx, fy, fz, p.ux, p.uy, p.uz), dot3(fx, fy, fz, p.wx, p.wy, p.wz),
        dot3(fx, fy, fz, vx, vy, vz), centre.fx, centre.fy, centre.fz,
    )  # fmt: skip


@formula
def swing_cosine(limb: Limb, centre: Limb, p: Platform) -> float:
    """Return the lesser of both."""
    return min(swing_in_base(limb, centre), swing_in_platform(limb, centre, p))


@formula
def at_node(limbs: Limbs, centre: Limbs, p: Platform) -> tuple[float, float, float, float]:
    """Return K_eta, the determinant (m^2), the largest force and the least cosine of swing."""
    moved, det = motions(rate_rows(limbs, p))
    a, b, c, d, e = limbs
    return (
        output_transmission(limbs, p, moved, det),
        det,
        max(
            vertical(a, moved[0], det), vertical(b, moved[1], det), vertical(c, moved[2], det),
            vertical(d, moved[3], det), vertical(e, moved[4], det),
        ),
        min(
            swing_cosine(a, centre[0], p), swing_cosine(b, centre[1], p),
            swing_cosine(c, centre[2], p), swing_cosine(d, centre[3], p),
            swing_cosine(e, centre[4], p),
        ),
    )  # fmt: skip


@kernel
def node_block(
    state: FloatArray, layout: FloatArray, L: float, upu: float, centre: Limbs, out: FloatArray
) -> None:
    """Fill ``out`` (4 x 64) with ``at_node`` of a block's poses (448,)."""
    for w in range(BLOCK):
        p = block_platform(state, w, upu)
        found = at_node(limbs_at(layout, p, L), centre, p)
        out[w], out[BLOCK + w] = found[0], found[1]
        out[2 * BLOCK + w], out[3 * BLOCK + w] = found[2], found[3]


@batch_kernel
def fill_quality(
    unit: FloatArray,
    boxes: FloatArray,
    layouts: FloatArray,
    lengths: FloatArray,
    upu: float,
    found: FloatArray,
) -> None:
    """Fill ETA, DET, FORCE, SWING of ``found`` (n, 8) at unit poses (k, 5), NaN out of reach."""
    for i in numba.prange(boxes.shape[0]):
        box, layout, L = boxes[i], layouts[i], lengths[i]
        state, out = np.empty(STATE * BLOCK), np.empty(4 * BLOCK)
        middle = platform(upu, box[0], 0.0, box[1], 0.0, 1.0, 0.0, 1.0)
        centre = limbs_at(layout, middle, L)
        sign = math.copysign(1.0, motions(rate_rows(centre, middle))[1])
        eta, least, force, cosine = math.inf, math.inf, 0.0, math.inf
        for first in range(0, unit.shape[0], BLOCK):
            place(unit, first, box, state)
            node_block(state, layout, L, upu, centre, out)
            for w in range(BLOCK):
                eta = min(eta, out[w])
                least = min(least, sign * out[BLOCK + w])
                force, cosine = max(force, out[2 * BLOCK + w]), min(cosine, out[3 * BLOCK + w])
        reached = found[i, REACH] > 0.0
        found[i, ETA] = eta if reached else math.nan
        found[i, DET] = least if reached else math.nan
        found[i, FORCE] = force if reached else math.nan
        found[i, SWING] = cosine if reached else math.nan
