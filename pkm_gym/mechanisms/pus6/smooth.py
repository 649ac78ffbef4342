"""The limits taken apart: of a leg or a pair of rods at a node each is smooth, the worst is not."""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.declared import DESIGN, LEAST_ASPECT, TASK, Pus6Task
from pkm_gym.mechanisms.pus6.influence import Legs, first_order
from pkm_gym.mechanisms.pus6.kinematics import legs_at, rotation_of, slider
from pkm_gym.mechanisms.pus6.limits import IDENTITY, flat_squared, joint_cosine, squared_distance

LEGS = 6
PAIRS = LEGS * (LEGS - 1) // 2
OF_NODE = 4 * LEGS + PAIRS + 1  # stroke up and down, rod_tilt, s_cone; clearance; aspect


@kernel
def fill_node(
    row: FloatArray, legs: Legs, home: Legs, pose: FloatArray, layout: FloatArray, L2: float
) -> None:
    """Fill a row (40,) with sliders, twice, m, angles of rods and S joints, distances, det G^-1."""
    r, at = rotation_of(pose), 4 * LEGS
    for i in range(LEGS):
        row[i] = row[LEGS + i] = slider(legs[i])
        row[2 * LEGS + i] = math.asin(min(1.0, math.sqrt(flat_squared(legs[i]) / L2)))
        row[3 * LEGS + i] = math.acos(min(1.0, joint_cosine(legs[i], home[i], r) / L2))
        for j in range(i):
            a, b = 5 * i + 3, 5 * j + 3
            row[at] = math.sqrt(
                squared_distance(
                    layout[a], layout[a + 1], legs[i], layout[b], layout[b + 1], legs[j]
                )
            )
            at += 1
    row[at] = first_order(legs)[1] / first_order(home)[1]


@kernel
def fill_broken(rows: FloatArray, task: Pus6Task) -> None:
    """Turn rows (nodes, 40) into by how much each limit is broken, > 0 where it is, scaled."""
    low, high = rows[:, :LEGS].min(), rows[:, :LEGS].max()
    for k in range(rows.shape[0]):
        row = rows[k]
        for i in range(LEGS):
            row[i] = (row[i] - low + 2.0 * task.z) / task.stroke - 1.0
            row[LEGS + i] = (high - row[LEGS + i] + 2.0 * task.z) / task.stroke - 1.0
            row[2 * LEGS + i] -= task.rod_tilt
            row[3 * LEGS + i] -= task.s_cone
        for i in range(4 * LEGS, OF_NODE - 1):
            row[i] = 1.0 - row[i] / task.clearance
        row[OF_NODE - 1] = LEAST_ASPECT - row[OF_NODE - 1]


@batch_kernel
def take_apart(
    designs: FloatArray,
    tasks: FloatArray,
    nodes: FloatArray,
    layouts: FloatArray,
    pieces: FloatArray,
) -> None:
    """Fill ``pieces`` (n, nodes, 40) of designs (n, 5) that reach all the nodes (k, 5)."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        design, layout = designs.view(DESIGN)[i, 0], layouts[i]
        L2 = design.L * design.L
        home, pose = legs_at(layout, 0.0, 0.0, IDENTITY, L2), np.zeros(6)
        for k in range(nodes.shape[0]):
            pose[0], pose[1] = task.xy * nodes[k, 0], task.xy * nodes[k, 1]
            pose[3], pose[4] = task.tilt * nodes[k, 2], task.tilt * nodes[k, 3]
            pose[5] = task.spin * nodes[k, 4]
            legs = legs_at(layout, pose[0], pose[1], rotation_of(pose), L2)
            fill_node(pieces[i, k], legs, home, pose, layout, L2)
        fill_broken(pieces[i], task)
