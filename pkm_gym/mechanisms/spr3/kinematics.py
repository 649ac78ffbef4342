"""Geometry of the 3-SPR: one pose at a time, compiled. Equations (1)-(10) of the paper, corrected.

Frame: the origin O_B at the centre of the fixed platform, z normal to it and towards the moving
one, x through the spherical joint B_3. The joints stand at the azimuths 120, -120 and 0 degrees,
B_i on the radius b of the fixed platform and A_i on the radius a of the moving one, whose frame is
u, v, w and whose centre O_A.

A pose is (hx, hy, s): the platform's normal is w = (2 hx, 2 hy, 1 - h^2) / (1 + h^2), so that
h = tan(tilt / 2); its frame is turned there without torsion; s is the distance of O_B from its
plane. Every formula is regular at the level pose h = 0.
"""

from __future__ import annotations

import math

import numba

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import solve3
from pkm_gym.core.types import FloatArray

COS = (-0.5, -0.5, 1.0)  # of the joints' azimuths
SIN = (0.5 * math.sqrt(3.0), -0.5 * math.sqrt(3.0), 0.0)

# Newton's corrections must shrink to this share at once, or its start was too far away.
CONTRACTION = 0.25
CONVERGED = 1e-8  # of the last correction: what it leaves is of the order of its square
ITERATIONS = 12

# A path that needs shorter steps than this share of it ends there.
SMALLEST_STEP = 1.0 / 4096.0


@formula
def anchor(hx: float, hy: float, s: float, b: float, cos: float, sin: float) -> tuple[float, float]:
    """Return B_i as the moving platform sees it: radially (along e_i) and along w, m.

    A_i stands at (a, 0) in the same plane, so that the leg's length is a distance in it.
    """
    scale = b / (1.0 + hx * hx + hy * hy)
    radial = scale * (1.0 - 2.0 * ((hx * hx - hy * hy) * cos - 2.0 * hx * hy * sin))
    return radial, 2.0 * scale * (hx * cos + hy * sin) - s


@formula
def leg_length(hx: float, hy: float, s: float, a: float, b: float, cos: float, sin: float) -> float:
    """Return q_i, m: eq. (7) in coordinates without a singularity."""
    radial, normal = anchor(hx, hy, s, b, cos, sin)
    return math.sqrt((radial - a) ** 2 + normal * normal)


@formula
def turned(hx: float, hy: float, u: float, v: float, w: float) -> tuple[float, float, float]:
    """Return in the fixed frame a vector given along u, v and w: the rotation of the platform."""
    scale = 2.0 / (1.0 + hx * hx + hy * hy)
    along = hx * u + hy * v
    rise = (w - along) * scale
    return u + hx * rise, v + hy * rise, w - (along + w * (hx * hx + hy * hy)) * scale


@formula
def position(hx: float, hy: float, s: float, b: float) -> tuple[float, float, float]:
    """Return O_A in the fixed frame, m: eq. (6), corrected; the platform's size drops out."""
    h2 = hx * hx + hy * hy
    scale = 1.0 / (1.0 + h2)
    real, imaginary = hx * hx - hy * hy, 2.0 * hx * hy  # of (hx + i hy)^2
    lever, shift = 2.0 * s * scale, b * scale * scale
    return (
        shift * (real - real * real + imaginary * imaginary) + lever * hx,
        -shift * imaginary * (1.0 + 2.0 * real) + lever * hy,
        -2.0 * shift * (hx * real - hy * imaginary) + s * (1.0 - h2) * scale,
    )


@formula
def fold_margin(hx: float, hy: float, s: float, b: float) -> float:
    """Return 1 - b |h| / |z + conj(rho) h|, rho = x + i y: <= 0 past the fold.

    There two tilts share one position; at the level pose the margin is 1.
    """
    x, y, z = position(hx, hy, s, b)
    across = math.hypot(z + x * hx + y * hy, x * hy - y * hx)
    return 1.0 - b * math.hypot(hx, hy) / across


@formula
def _leg_row(
    hx: float, hy: float, s: float, a: float, b: float, cos: float, sin: float
) -> tuple[float, float, float, float]:
    """Return q_i^2 / 2 and its derivatives by hx, hy, s."""
    scale = 1.0 / (1.0 + hx * hx + hy * hy)
    radial, normal = anchor(hx, hy, s, b, cos, sin)
    arm, rise = radial - a, normal + s
    gx = -arm * (4.0 * b * (hx * cos - hy * sin) + 2.0 * hx * radial)
    gy = arm * (4.0 * b * (hy * cos + hx * sin) - 2.0 * hy * radial)
    gx += 2.0 * normal * (b * cos - hx * rise)
    gy += 2.0 * normal * (b * sin - hy * rise)
    return 0.5 * (arm * arm + normal * normal), gx * scale, gy * scale, -normal


@formula
def newton_step(
    hx: float, hy: float, s: float, q1: float, q2: float, q3: float, a: float, b: float
) -> tuple[float, float, float, float]:
    """Return the corrections of hx, hy, s towards leg lengths q, and the determinant met.

    The determinant of the derivative of q^2/2: > 0 on the home side of the parallel singularities.
    """
    f1, x1, y1, s1 = _leg_row(hx, hy, s, a, b, COS[0], SIN[0])
    f2, x2, y2, s2 = _leg_row(hx, hy, s, a, b, COS[1], SIN[1])
    f3, x3, y3, s3 = _leg_row(hx, hy, s, a, b, COS[2], SIN[2])
    return solve3(
        x1, y1, s1, x2, y2, s2, x3, y3, s3,
        0.5 * q1 * q1 - f1, 0.5 * q2 * q2 - f2, 0.5 * q3 * q3 - f3,
    )  # fmt: skip


@kernel
def pose_near(
    hx: float, hy: float, s: float, q1: float, q2: float, q3: float, a: float, b: float
) -> tuple[float, float, float, int]:
    """Return the pose with leg lengths q next to a pose, and the iterations; 0 if it isn't next.

    Newton. Corrections that shrink fast from the first on, and a determinant that keeps its sign,
    mean that the start lay in the region of attraction of its own branch (Newton-Mysovskikh).
    """
    before = math.inf
    scale = 1.0 / (q1 + q2 + q3)
    for k in range(ITERATIONS):
        dx, dy, ds, det = newton_step(hx, hy, s, q1, q2, q3, a, b)
        size = math.sqrt(dx * dx + dy * dy + ds * ds * scale * scale)
        if not (det > 0.0 and size < 1.0 and size <= CONTRACTION * before):
            return hx, hy, s, 0
        hx, hy, s = hx + dx, hy + dy, s + ds
        if size < CONVERGED:
            return hx, hy, s, k + 1
        before = size
    return hx, hy, s, 0


@kernel
def level(q: float, a: float, b: float) -> float:
    """Return s of the level pose with three legs of length q; NaN where they do not reach."""
    return math.sqrt(q * q - (b - a) * (b - a))


@kernel
def follow(
    hx: float, hy: float, s: float,
    p1: float, p2: float, p3: float,
    q1: float, q2: float, q3: float,
    a: float, b: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Follow the straight joint path from p, where the pose is known, to q.

    Returns the pose reached and the share of the path followed: 1, or less where a parallel
    singularity bars the way.
    """
    done, step = 0.0, 1.0
    while done < 1.0:
        t = min(1.0, done + step)
        x, y, z, found = pose_near(
            hx, hy, s, p1 + t * (q1 - p1), p2 + t * (q2 - p2), p3 + t * (q3 - p3), a, b
        )
        if found:
            hx, hy, s, done, step = x, y, z, t, 2.0 * step
        else:
            step *= 0.5
            if step < SMALLEST_STEP:
                break
    return hx, hy, s, done


@formula
def tilt_step(
    hx: float, hy: float, x: float, y: float, z: float, b: float
) -> tuple[float, float, float]:
    """Return the corrections of hx, hy towards a position, and the determinant met.

    Newton on rho - 2 z h - conj(rho) h^2 - b conj(h)^2 = 0, rho = x + i y, h = hx + i hy; the
    determinant is > 0 on this side of the fold.
    """
    px, py = x * hx + y * hy, x * hy - y * hx  # conj(rho) h
    slope_x, slope_y = 2.0 * (z + px), 2.0 * py
    cross_x, cross_y = 2.0 * b * hx, -2.0 * b * hy
    lever_x, lever_y = 2.0 * z + px, py
    rest_x = x - lever_x * hx + lever_y * hy - b * (hx * hx - hy * hy)
    rest_y = y - lever_x * hy - lever_y * hx + 2.0 * b * hx * hy
    det = slope_x * slope_x + slope_y * slope_y - cross_x * cross_x - cross_y * cross_y
    dx = slope_x * rest_x + slope_y * rest_y - cross_x * rest_x - cross_y * rest_y
    dy = slope_x * rest_y - slope_y * rest_x - cross_y * rest_x + cross_x * rest_y
    return dx / det, dy / det, det


@kernel
def tilt_near(
    hx: float, hy: float, x: float, y: float, z: float, b: float
) -> tuple[float, float, int]:
    """Return the tilt at a position next to a known one, and the iterations; 0 if it isn't next."""
    before = math.inf
    for k in range(ITERATIONS):
        dx, dy, det = tilt_step(hx, hy, x, y, z, b)
        size = math.sqrt(dx * dx + dy * dy)
        if not (det > 0.0 and size < 1.0 and size <= CONTRACTION * before):
            return hx, hy, 0
        hx, hy = hx + dx, hy + dy
        if size < CONVERGED:
            return hx, hy, k + 1
        before = size
    return hx, hy, 0


@formula
def along_normal(hx: float, hy: float, x: float, y: float, z: float) -> float:
    """Return s, m: how far a position lies along the platform's normal."""
    wx, wy, wz = turned(hx, hy, 0.0, 0.0, 1.0)
    return wx * x + wy * y + wz * z


@kernel
def pose_at(x: float, y: float, z: float, b: float) -> tuple[float, float, float, float]:
    """Return the pose with O_A at a position, on the branch of the level pose at the same z.

    Follows the straight line from the axis; the fourth number is the share of it that was
    followed: 1, or less where the fold bars the way.
    """
    hx = hy = done = 0.0
    step = 1.0
    while done < 1.0 and z > 0.0:
        t = min(1.0, done + step)
        kx, ky, found = tilt_near(hx, hy, t * x, t * y, z, b)
        if found:
            hx, hy, done, step = kx, ky, t, 2.0 * step
        else:
            step *= 0.5
            if step < SMALLEST_STEP:
                break
    return hx, hy, along_normal(hx, hy, x, y, z), done


@batch_kernel
def leg_lengths_batch(poses: FloatArray, a: float, b: float, lengths: FloatArray) -> None:
    """Fill ``lengths`` (n, 3), m, from ``poses`` (n, 3), whatever the legs' range."""
    for k in numba.prange(poses.shape[0]):
        hx, hy, s = poses[k]
        for i in range(3):
            lengths[k, i] = leg_length(hx, hy, s, a, b, COS[i], SIN[i])


@batch_kernel
def forward_kinematics_batch(
    joints: FloatArray, near: FloatArray, a: float, b: float, poses: FloatArray
) -> None:
    """Fill ``poses`` (n, 3) from ``joints`` (n, 3), m, by straight paths from the poses ``near``.

    NaN where a parallel singularity bars the way.
    """
    for k in numba.prange(joints.shape[0]):
        hx, hy, s = near[k]
        p1 = leg_length(hx, hy, s, a, b, COS[0], SIN[0])
        p2 = leg_length(hx, hy, s, a, b, COS[1], SIN[1])
        p3 = leg_length(hx, hy, s, a, b, COS[2], SIN[2])
        q1, q2, q3 = joints[k]
        x, y, z, done = follow(hx, hy, s, p1, p2, p3, q1, q2, q3, a, b)
        poses[k, 0], poses[k, 1], poses[k, 2] = x, y, z
        if done < 1.0:
            poses[k, :] = math.nan


@batch_kernel
def poses_at_batch(positions: FloatArray, b: float, poses: FloatArray) -> None:
    """Fill ``poses`` (n, 3) from ``positions`` (n, 3), m; NaN beyond the fold."""
    for k in numba.prange(positions.shape[0]):
        x, y, z = positions[k]
        hx, hy, s, done = pose_at(x, y, z, b)
        poses[k, 0], poses[k, 1], poses[k, 2] = hx, hy, s
        if done < 1.0:
            poses[k, :] = math.nan


@batch_kernel
def frames_batch(poses: FloatArray, b: float, frames: FloatArray) -> None:
    """Fill ``frames`` (n, 3, 4) from ``poses`` (n, 3): the columns u, v, w, and O_A (m)."""
    for k in numba.prange(poses.shape[0]):
        hx, hy, s = poses[k]
        frames[k, 0, 0], frames[k, 1, 0], frames[k, 2, 0] = turned(hx, hy, 1.0, 0.0, 0.0)
        frames[k, 0, 1], frames[k, 1, 1], frames[k, 2, 1] = turned(hx, hy, 0.0, 1.0, 0.0)
        frames[k, 0, 2], frames[k, 1, 2], frames[k, 2, 2] = turned(hx, hy, 0.0, 0.0, 1.0)
        frames[k, 0, 3], frames[k, 1, 3], frames[k, 2, 3] = position(hx, hy, s, b)
