"""Many poses of one design in lockstep: all take the same steps, so that the loops vectorise.

Every pose takes the same number of Newton's steps from home, without a branch, and keeps count of
what ``pose_near`` asks of them. Where that doesn't hold, ``follow`` takes the way in shorter steps.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from pkm_gym.core.compile import formula, kernel
from pkm_gym.mechanisms.spr3.kinematics import (
    CONTRACTION,
    CONVERGED,
    COS,
    SIN,
    follow,
    level,
    newton_step,
)

# Loops run over a multiple of it, so that a vector of any width leaves no pose over.
WIDTH = 8

# Records, not rows of a matrix: only with a stride that the compiler knows does a loop vectorise.
LEGS = np.dtype([(name, np.float64) for name in ("q1", "q2", "q3")])
POSE = np.dtype([(name, np.float64) for name in ("hx", "hy", "s", "done")])
LOCAL = np.dtype([(name, np.float64) for name in ("det", "lci")])
JOINTS = np.dtype([(name, np.float64) for name in ("s_cos", "r_sin")])


class Lanes(NamedTuple):
    """Scratch of one design: arrays of as many records as poses, and a few that fill the vector."""

    legs: Any  # q1, q2, q3, m
    poses: Any  # hx, hy, s, and the share of the way from home that was followed
    local: Any  # det J and the local conditioning index
    joints: Any  # smallest S cosine, smallest R sine


@formula
def filled(count: int) -> int:
    """Return how many records hold so many poses and fill the last vector."""
    return (count + WIDTH - 1) // WIDTH * WIDTH


@kernel
def lanes_for(count: int) -> Lanes:
    """Return lanes for up to so many poses."""
    n = filled(count)
    return Lanes(np.empty(n, LEGS), np.empty(n, POSE), np.empty(n, LOCAL), np.empty(n, JOINTS))


@formula
def step_from_home(
    q1: float, q2: float, q3: float, q_c: float, s: float, b: float, scale: float
) -> tuple[float, float, float, float]:
    """Return the pose after Newton's first step from home, and the step's squared size.

    ``newton_step`` at the level pose with legs q_c, whose matrix has an inverse in closed form.
    ``scale`` (1/m) makes a change of s comparable with one of the tilt.
    """
    f1, f2, f3 = q1 * q1, q2 * q2, q3 * q3
    lever = -1.0 / (6.0 * b * s)
    hx = lever * (f1 * COS[0] + f2 * COS[1] + f3 * COS[2])
    hy = lever * (f1 * SIN[0] + f2 * SIN[1])
    ds = (f1 + f2 + f3 - 3.0 * q_c * q_c) / (6.0 * s)
    share = scale * ds
    return hx, hy, s + ds, hx * hx + hy * hy + share * share


@formula
def checked_step(
    hx: float, hy: float, s: float, before: float, fine: bool,
    q1: float, q2: float, q3: float, a: float, b: float, scale: float,
) -> tuple[float, float, float, float, bool]:  # fmt: skip
    """Return the pose after one more step, its squared size, and whether all were fine so far.

    Fine is what ``pose_near`` asks for: steps that shrink, until one was small, and a determinant
    that keeps its sign.
    """
    dx, dy, ds, det = newton_step(hx, hy, s, q1, q2, q3, a, b)
    share = scale * ds
    size = dx * dx + dy * dy + share * share
    shrinks = (size <= CONTRACTION * CONTRACTION * before) | (before < CONVERGED * CONVERGED)
    return hx + dx, hy + dy, s + ds, size, fine & (det > 0.0) & shrinks


@formula
def pose_in_steps(
    q1: float, q2: float, q3: float, q_c: float, s: float, a: float, b: float
) -> tuple[float, float, float, float]:
    """Return the pose with leg lengths q five steps from home, and 1; 0 if it isn't there."""
    scale = 1.0 / (q1 + q2 + q3)
    hx, hy, s, size = step_from_home(q1, q2, q3, q_c, s, b, scale)
    fine = size < 1.0
    hx, hy, s, size, fine = checked_step(hx, hy, s, size, fine, q1, q2, q3, a, b, scale)
    hx, hy, s, size, fine = checked_step(hx, hy, s, size, fine, q1, q2, q3, a, b, scale)
    hx, hy, s, size, fine = checked_step(hx, hy, s, size, fine, q1, q2, q3, a, b, scale)
    hx, hy, s, size, fine = checked_step(hx, hy, s, size, fine, q1, q2, q3, a, b, scale)
    return hx, hy, s, 1.0 if fine & (size < CONVERGED * CONVERGED) else 0.0


@kernel
def solve_in_steps(legs: Any, n: int, q_c: float, a: float, b: float, poses: Any) -> None:
    """Fill ``poses`` from ``legs``, the first n of them: see ``pose_in_steps``."""
    home = level(q_c, a, b)
    for k in range(n):
        leg, pose = legs[k], poses[k]
        pose.hx, pose.hy, pose.s, pose.done = pose_in_steps(leg.q1, leg.q2, leg.q3, q_c, home, a, b)


@kernel
def solve(lanes: Lanes, count: int, q_c: float, a: float, b: float) -> None:
    """Fill the first ``count`` poses from their leg lengths, by straight joint paths from home.

    Home is the level pose with legs q_c, where the lanes that fill the last vector stay; ``done``
    is the share of the path followed: 1, or less where a parallel singularity bars the way.
    """
    legs, poses = lanes.legs, lanes.poses
    for k in range(count, filled(count)):
        legs[k].q1 = legs[k].q2 = legs[k].q3 = q_c
    solve_in_steps(legs, filled(count), q_c, a, b, poses)
    for k in range(count):
        if poses[k].done == 0.0:
            leg, pose = legs[k], poses[k]
            pose.hx, pose.hy, pose.s, pose.done = follow(
                0.0, 0.0, level(q_c, a, b), q_c, q_c, q_c, leg.q1, leg.q2, leg.q3, a, b
            )
