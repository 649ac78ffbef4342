"""The skew problem's limits taken apart: smooth at each node and limb, an extreme over them isn't.

The distances of lines are the least of a node's: which two lines they are of seldom changes there.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.clearances import LINES, distances
from pkm_gym.mechanisms.pss5_upu.declared import (
    LEAST_COSINE,
    LEAST_RCOND,
    LEAST_SHARE,
    SKEW_DESIGN,
    SKEW_TASK,
    SkewDesign,
    SkewTask,
)
from pkm_gym.mechanisms.pss5_upu.extremes import (
    REACH,
    block_platform,
    swing_in_base,
    swing_in_platform,
    vertical,
)
from pkm_gym.mechanisms.pss5_upu.indices import (
    BLOCK,
    CENTRE_X,
    CENTRE_Z,
    HALF,
    STATE,
    place,
)
from pkm_gym.mechanisms.pss5_upu.kinematics import (
    LIMBS,
    Limbs,
    gap,
    limbs_at,
    motions,
    platform,
    rate_rows,
)
from pkm_gym.mechanisms.pss5_upu.problem import possible, unreached_by

# What is limited at a node, of each limb: lambda_i, the slider (m), its force per vertical load,
# the cosines of the rod to its line at the centre; of the node: the determinant (m^2) and the
# squared distances (m^2) of rods, rods and rails, rods and the UPU limb.
COSINE, SLIDER, FORCE, BASE, PLATFORM = range(5)
OF_LIMB = 6  # limits of a limb: the slider has two
OF_NODE = 4 + LIMBS * OF_LIMB
PAIRS = LIMBS * (LIMBS - 1) // 2
ALONE = 4 + 2 * PAIRS  # limits of no node, and the condition
UNDEFINED = 10.0  # what counts as the log objective there
TINY, HUGE = 1e-300, 1e300  # that a logarithm is taken of


def columns(nodes: int) -> int:
    """Return the length of a row: the log objective, then the limits."""
    return 1 + ALONE + OF_NODE * nodes


@kernel
def fill_nodes(
    state: FloatArray,
    layout: FloatArray,
    L: float,
    upu: float,
    centre: Limbs,
    limbs: FloatArray,
    dets: FloatArray,
) -> None:
    """Fill ``limbs`` (5, 5, 64) with what is limited of each limb, ``dets`` (64,), at a block."""
    for w in range(BLOCK):
        p = block_platform(state, w, upu)
        at = limbs_at(layout, p, L)
        moved, dets[w] = motions(rate_rows(at, p))
        for i in range(LIMBS):
            limbs[i, COSINE, w], limbs[i, SLIDER, w] = at[i].cosine, at[i].slider
            limbs[i, FORCE, w] = vertical(at[i], moved[i], dets[w])
            limbs[i, BASE, w] = swing_in_base(at[i], centre[i])
            limbs[i, PLATFORM, w] = swing_in_platform(at[i], centre[i], p)


@kernel
def angle(cosine: float) -> float:
    """Return the angle of a cosine, which rounding may take beyond 1."""
    return math.acos(max(-1.0, min(1.0, cosine)))


@kernel
def log(value: float) -> float:
    """Return the logarithm of a value that may be 0 or infinite."""
    return math.log(max(TINY, min(HUGE, value)))


@kernel
def fill_limb(row: FloatArray, limb: FloatArray, w: int, task: SkewTask, rail: float) -> None:
    """Fill a row (6,) with by how much a limb (5, 64) breaks each limit at pose w, scaled.

    Forces, which go to infinity, by their logarithms.
    """
    row[0] = LEAST_COSINE - limb[COSINE, w]
    row[1] = -limb[SLIDER, w] / task.n
    row[2] = limb[SLIDER, w] / rail - 1.0
    row[3] = log(limb[FORCE, w] / task.force)
    row[4] = angle(limb[BASE, w]) - task.swing
    row[5] = angle(limb[PLATFORM, w]) - task.swing


@kernel
def fill_alone(
    row: FloatArray, design: SkewDesign, task: SkewTask, height: float, rcond: float
) -> None:
    """Fill a row (24,) with by how much the limits are broken that are none of a node's."""
    n1 = 3.0 - design.n2 - design.n3
    row[0] = LEAST_SHARE - min(n1, design.n2, design.n3)
    row[1] = n1 / design.n2 - 1.0
    row[2] = height / task.n - task.height
    row[3] = 1.0 - rcond / LEAST_RCOND
    at = 4
    for i in range(LIMBS):
        for j in range(i):
            row[at] = task.gap - gap(i, j, design.a2, design.a3)
            row[at + PAIRS] = task.gap - gap(i, j, design.b2, design.b3)
            at += 1


@kernel
def fill_pieces(
    row: FloatArray,
    task: SkewTask,
    unit: FloatArray,
    box: FloatArray,
    layout: FloatArray,
    L: float,
    rail: float,
    r: float,
    upu: float,
) -> None:
    """Fill a row (4590,) with the limits of all nodes (k, 5), a node's one after the other."""
    state, dets, rods = np.empty(STATE * BLOCK), np.empty(BLOCK), np.empty((LIMBS, LINES))
    limbs, apart = np.empty((LIMBS, 5, BLOCK)), np.empty((3, BLOCK))
    middle = platform(upu, box[CENTRE_X], 0.0, box[CENTRE_Z], 0.0, 1.0, 0.0, 1.0)
    centre = limbs_at(layout, middle, L)
    sign = math.copysign(1.0, motions(rate_rows(centre, middle))[1])
    for first in range(0, unit.shape[0], BLOCK):
        place(unit, first, box, state)
        fill_nodes(state, layout, L, upu, centre, limbs, dets)
        distances(state, layout, L, rail, upu, rods, apart)
        for w in range(min(BLOCK, unit.shape[0] - first)):
            at = OF_NODE * (first + w)
            row[at] = -sign * dets[w] / (r * r)
            for k in range(3):
                row[at + 1 + k] = 1.0 - math.sqrt(apart[k, w]) / task.clearance
            for k in range(LIMBS):
                start = at + 4 + OF_LIMB * k
                fill_limb(row[start : start + OF_LIMB], limbs[k], w, task, rail)


@batch_kernel
def take_apart(
    designs: FloatArray,
    tasks: FloatArray,
    unit: FloatArray,
    boxes: FloatArray,
    layouts: FloatArray,
    lengths: FloatArray,
    rails: FloatArray,
    radii: FloatArray,
    upu: float,
    values: FloatArray,
    means: FloatArray,
    found: FloatArray,
    rcond: FloatArray,
    pieces: FloatArray,
) -> None:
    """Fill the rows of ``pieces`` (n, columns) of designs (n, 8).

    Of the objective's ``values`` (n,), the ``means`` (n, 6), what was ``found`` at the nodes and
    the least ``rcond`` (n,); for the rest see ``SetOut``.
    """
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(SKEW_TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(SKEW_DESIGN)[i, 0]
        n1 = 3.0 - design.n2 - design.n3
        undefined = possible(n1, design.n2, design.n3, design.theta, design.lam0, task.n)
        if undefined <= 0.0:
            undefined = unreached_by(found[i, REACH], means[i])
        if undefined > 0.0:
            pieces[i] = 1.0 + undefined
            pieces[i, 0] = UNDEFINED + undefined
        else:
            box, first = boxes[i], 1 + ALONE
            pieces[i, 0] = -log(values[i])
            height = box[CENTRE_Z] + box[HALF + 2]
            fill_alone(pieces[i, 1:first], design, task, height, rcond[i])
            fill_pieces(
                pieces[i, first:], task, unit, box, layouts[i], lengths[i], rails[i], radii[i], upu
            )
