"""Forward kinematics of the 5-PSS/UPU, by Newton along the straight path of the sliders."""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.kinematics import LIMBS, limbs_at, platform_of, rate_rows

CONVERGED = 1e-14  # of Newton's last correction, m and rad
ITERATIONS = 30
LARGEST_CORRECTION = 0.2  # m and rad: further, the start was too far away
SMALLEST_STEP = 1.0 / 1024.0  # of a path


@kernel
def correction(
    pose: FloatArray, sliders: FloatArray, layout: FloatArray, L: float, upu: float,
    matrix: FloatArray, off: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Correct a pose (5,) by one Newton step towards sliders (5,): its size and the determinant.

    ``matrix`` (5, 5) and ``off`` (5,) are scratch. Solves rows . rates = lambda_i (l - l(pose)).
    """
    p = platform_of(pose, upu)
    limbs = limbs_at(layout, p, L)
    rows = rate_rows(limbs, p)
    for i in range(LIMBS):
        for k in range(LIMBS):
            matrix[i, k] = rows[i][k]
        off[i] = limbs[i].cosine * (sliders[i] - limbs[i].slider)
    if not math.isfinite(matrix.sum() + off.sum()):  # out of reach
        return math.inf, 0.0
    det = np.linalg.det(matrix)
    if not abs(det) > 0.0:
        return math.inf, 0.0
    step = np.linalg.solve(matrix, off)
    size = np.max(np.abs(step))
    if not size < LARGEST_CORRECTION:
        return math.inf, det
    pose[:3] += step[:3]
    pose[3] += step[4]
    pose[4] += step[3]
    return size, det


@kernel
def follow(
    pose: FloatArray, start: FloatArray, end: FloatArray, layout: FloatArray, L: float, upu: float
) -> bool:
    """Follow the straight slider path from ``start`` (5,), where ``pose`` (5,) is, to ``end``.

    Returns whether it came there; a direct singularity bars the way.
    """
    off, matrix, trial = np.empty(LIMBS), np.empty((LIMBS, LIMBS)), np.empty(LIMBS)
    target = np.empty(LIMBS)
    trial[:] = pose
    _, side = correction(trial, start, layout, L, upu, matrix, off)
    done, step = 0.0, 1.0
    while done < 1.0:
        t = min(1.0, done + step)
        for i in range(LIMBS):
            target[i] = start[i] + t * (end[i] - start[i])
        trial[:] = pose
        before, found = math.inf, False
        for _ in range(ITERATIONS):
            size, det = correction(trial, target, layout, L, upu, matrix, off)
            if not (det * side > 0.0 and size < before):
                found = before < 1e3 * CONVERGED and det * side > 0.0
                break
            before = size
            if size < CONVERGED:
                found = True
                break
        if found:
            pose[:] = trial
            done, step = t, 2.0 * step
        else:
            step *= 0.5
            if step < SMALLEST_STEP:
                return False
    return True


@batch_kernel
def forward_kinematics_batch(
    joints: FloatArray,
    near: FloatArray,
    layout: FloatArray,
    L: float,
    upu: float,
    poses: FloatArray,
) -> None:
    """Fill ``poses`` (n, 5) from sliders ``joints`` (n, 5), m, along paths from ``near`` (n, 5).

    NaN where a direct singularity bars the way.
    """
    for k in numba.prange(joints.shape[0]):
        start = np.empty(LIMBS)
        poses[k] = near[k]
        limbs = limbs_at(layout, platform_of(near[k], upu), L)
        for i in range(LIMBS):
            start[i] = limbs[i].slider
        if not follow(poses[k], start, joints[k], layout, L, upu):
            poses[k, :] = math.nan
