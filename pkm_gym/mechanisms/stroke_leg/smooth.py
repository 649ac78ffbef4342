"""The gait's limits taken apart: at each point a limit is smooth, a maximum over points is not."""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.declared import (
    GAIT_DESIGN,
    GAIT_TASK,
    LEAST_CLEARANCE,
    LEAST_OPENING,
    MOST_OPENING,
    GaitIndices,
    GaitTask,
)
from pkm_gym.mechanisms.stroke_leg.gait_indices import BOUNDARY, measure_one

ALONE = 11  # limits that are no maximum over points
POINTWISE = 5  # quantities that are limited at every point
UNDEFINED = 10.0  # what counts as the log objective there


def columns(points: int) -> int:
    """Return the length of a row: the log objective, then the limits."""
    return 1 + ALONE + POINTWISE * points


@kernel
def fill_pieces(row: FloatArray, indices: GaitIndices, task: GaitTask, values: FloatArray) -> None:
    """Fill a row with the log objective and by how much each limit is broken, scaled.

    Forces and speeds, which go to infinity, by their logarithms.
    """
    row[0] = math.log(indices.thrust_rms)
    longest = task.ratio * task.l_min
    row[1] = LEAST_OPENING - indices.theta_min
    row[2] = indices.theta_max - MOST_OPENING
    row[3] = LEAST_CLEARANCE - indices.dead_A_short
    row[4] = LEAST_CLEARANCE - indices.dead_A_long
    row[5] = LEAST_CLEARANCE - indices.dead_D_short
    row[6] = LEAST_CLEARANCE - indices.dead_D_long
    row[7] = 1.0 - indices.l2_min / task.l_min
    row[8] = indices.l2_max / longest - 1.0
    row[9] = 1.0 - indices.l4_min / task.l_min
    row[10] = indices.l4_max / longest - 1.0
    row[11] = indices.mount / task.mount - 1.0
    at = 1 + ALONE
    for i in range(values.shape[1]):
        row[at] = math.log(values[2, i] / task.thrust)
        row[at + 1] = math.log(values[3, i] / task.thrust)
        row[at + 2] = math.log(values[4, i] / task.rate)
        row[at + 3] = math.log(values[5, i] / task.rate)
        row[at + 4] = 1.0 - values[6, i] / task.gap
        at += POINTWISE


@batch_kernel
def take_apart(
    designs: FloatArray,
    tasks: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    edge: FloatArray,
    pieces: FloatArray,
) -> None:
    """Fill the rows of ``pieces`` (n, columns) of designs (n, 7); see ``fill_pieces``."""
    for i in numba.prange(designs.shape[0]):
        values = np.empty((len(BOUNDARY), edge.shape[0]))
        task = tasks.view(GAIT_TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(GAIT_DESIGN)[i, 0]
        indices, limits, unreached = measure_one(design, task, nodes, weights, edge, values)
        if limits.dimensions > 0.0 or unreached > 0.0:
            pieces[i] = 1.0 + unreached
            pieces[i, 0] = UNDEFINED + unreached
        else:
            fill_pieces(pieces[i], indices, task, values)
