"""Many poses of one design in lockstep: all take the same steps, so that the loops vectorise.

Every pose takes the same number of Newton's steps, from home or from the axis, without a branch,
and keeps count of what ``pose_near`` and ``tilt_near`` ask of them. Where that doesn't hold,
``follow`` or ``pose_at`` takes the way in shorter steps.
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
    along_normal,
    follow,
    leg_length,
    level,
    newton_step,
    pose_at,
    tilt_step,
)

# Loops run over a multiple of it, so that a vector of any width leaves no pose over.
WIDTH = 8

# Records, not rows of a matrix: only with a stride that the compiler knows does a loop vectorise.
PLACE = np.dtype([(name, np.float64) for name in ("x", "y", "z")])
LEGS = np.dtype([(name, np.float64) for name in ("q1", "q2", "q3")])
POSE = np.dtype([(name, np.float64) for name in ("hx", "hy", "s", "done")])
LOCAL = np.dtype([(name, np.float64) for name in ("det", "lci")])
JOINTS = np.dtype([(name, np.float64) for name in ("s_cos", "r_sin")])


class Lanes(NamedTuple):
    """Scratch of one design: arrays of as many records as poses, and a few that fill the vector."""

    places: Any  # x, y, z of O_A, m
    legs: Any  # q1, q2, q3, m
    poses: Any  # hx, hy, s, and the share of the way there that was followed
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
    places, legs, poses = np.empty(n, PLACE), np.empty(n, LEGS), np.empty(n, POSE)
    return Lanes(places, legs, poses, np.empty(n, LOCAL), np.empty(n, JOINTS))


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
def shrinks(size: float, before: float) -> bool:
    """Whether a step was much smaller than the one before it, or that one was the last needed."""
    return (size <= CONTRACTION * CONTRACTION * before) | (before < CONVERGED * CONVERGED)


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
    return hx + dx, hy + dy, s + ds, size, fine & (det > 0.0) & shrinks(size, before)


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


@formula
def checked_tilt(
    hx: float, hy: float, before: float, fine: bool, x: float, y: float, z: float, b: float
) -> tuple[float, float, float, bool]:
    """Return the tilt after one more step, its squared size, and whether all were fine so far."""
    dx, dy, det = tilt_step(hx, hy, x, y, z, b)
    size = dx * dx + dy * dy
    return hx + dx, hy + dy, size, fine & (det > 0.0) & shrinks(size, before)


@formula
def pose_there(x: float, y: float, z: float, b: float) -> tuple[float, float, float, float]:
    """Return the pose with O_A at a position five steps from the axis, and 1; 0 if it isn't there.

    The first step, from the level pose at the same z, is in closed form.
    """
    hx, hy = 0.5 * x / z, 0.5 * y / z
    size = hx * hx + hy * hy
    fine = (z > 0.0) & (size < 1.0)
    hx, hy, size, fine = checked_tilt(hx, hy, size, fine, x, y, z, b)
    hx, hy, size, fine = checked_tilt(hx, hy, size, fine, x, y, z, b)
    hx, hy, size, fine = checked_tilt(hx, hy, size, fine, x, y, z, b)
    hx, hy, size, fine = checked_tilt(hx, hy, size, fine, x, y, z, b)
    done = 1.0 if fine & (size < CONVERGED * CONVERGED) else 0.0
    return hx, hy, along_normal(hx, hy, x, y, z), done


@kernel
def solve_places_in_steps(places: Any, n: int, b: float, poses: Any) -> None:
    """Fill ``poses`` from ``places``, the first n of them: see ``pose_there``."""
    for k in range(n):
        place, pose = places[k], poses[k]
        pose.hx, pose.hy, pose.s, pose.done = pose_there(place.x, place.y, place.z, b)


@kernel
def solve_places(lanes: Lanes, count: int, b: float) -> None:
    """Fill the first ``count`` poses from O_A's places, by straight lines from the axis.

    ``done`` is the share of the line followed: 1, or less where the fold bars the way.
    """
    places, poses = lanes.places, lanes.poses
    for k in range(count, filled(count)):
        places[k].x, places[k].y, places[k].z = 0.0, 0.0, b
    solve_places_in_steps(places, filled(count), b, poses)
    for k in range(count):
        if poses[k].done == 0.0:
            place, pose = places[k], poses[k]
            pose.hx, pose.hy, pose.s, pose.done = pose_at(place.x, place.y, place.z, b)


@kernel
def legs_of(lanes: Lanes, count: int, a: float, b: float) -> None:
    """Fill the first ``count`` leg lengths from the poses."""
    poses, legs = lanes.poses, lanes.legs
    for k in range(filled(count)):
        pose, leg = poses[k], legs[k]
        leg.q1 = leg_length(pose.hx, pose.hy, pose.s, a, b, COS[0], SIN[0])
        leg.q2 = leg_length(pose.hx, pose.hy, pose.s, a, b, COS[1], SIN[1])
        leg.q3 = leg_length(pose.hx, pose.hy, pose.s, a, b, COS[2], SIN[2])
