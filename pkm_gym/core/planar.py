"""Planar machines of two limbs, symmetric: one pose at a time, compiled, and the machine itself.

Frame: the origin midway between the drive axes, x to the right, y up, the tool below (y < 0).
Limb 1 has its drive at (+e, 0), limb 2 at (-e, 0); ``side`` is +1 and -1. Elbows point outwards,
the tool is the lower of the two circle intersections. Q is the quarter turn [[0, -1], [1, 0]].
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, formula, kernel
from pkm_gym.core.linalg import cross2, dot2, squared_singular_values
from pkm_gym.core.mechanism import IndexMap, Link, Mechanism, Symmetry, dimension
from pkm_gym.core.sampling import rectangle
from pkm_gym.core.types import FloatArray

# A pose nearer to the edge of a limb's annulus than this share of l1 counts as out of reach.
REACH_MARGIN = 1e-9

LOCAL_INDICES = ("sigma_max", "sigma_min", "sin_alpha", "sin_beta")


# One pose -----------------------------------------------------------------------------------------


@formula
def limb(
    x: float, y: float, side: float, e: float, l1: float, l2: float
) -> tuple[float, float, float, float, float]:
    """Return the unit vectors u of the arm and w of the rod, and s = w^T Q u: ux, uy, wx, wy, s.

    Without angles: the arm's tip lies at ``l1 u = p d + side q Q d`` from its drive, d the vector
    from the drive to the tool; then ``s = -side q d^2 / (l1 l2)`` and |s| = sin beta. NaN out of
    reach.
    """
    dx, dy = x - side * e, y
    d2 = dx * dx + dy * dy
    inverse = 1.0 / d2
    p = 0.5 + 0.5 * (l1 * l1 - l2 * l2) * inverse
    q = side * math.sqrt(l1 * l1 * inverse - p * p)
    ax, ay = p * dx - q * dy, p * dy + q * dx
    s = q * d2 * (-1.0 / (l1 * l2))
    return ax / l1, ay / l1, (dx - ax) / l2, (dy - ay) / l2, s


@formula
def conditioning(
    x: float, y: float, e: float, l1: float, l2: float
) -> tuple[float, float, float, float, float]:
    """Return sigma_max^2, sigma_min^2, sin alpha, and sin^2 beta of both limbs.

    The singular values are those of the dimensionless l1 J, whose rows are w_i^T / s_i; alpha is
    the angle between the rods, sin alpha > 0 in the lower assembly mode.
    """
    _, _, w1x, w1y, s1 = limb(x, y, 1.0, e, l1, l2)
    _, _, w2x, w2y, s2 = limb(x, y, -1.0, e, l1, l2)
    sin_alpha = cross2(w1x, w1y, w2x, w2y)
    cos_alpha = dot2(w1x, w1y, w2x, w2y)
    sin2_alpha = sin_alpha * sin_alpha
    sin2_1, sin2_2 = s1 * s1, s2 * s2
    row1, row2 = 1.0 / sin2_1, 1.0 / sin2_2
    larger, smaller = squared_singular_values(
        row1, row2, cos_alpha * s1 * s2 * row1 * row2, sin2_alpha * row1 * row2
    )
    return larger, smaller, sin_alpha, sin2_1, sin2_2


@kernel
def arm_angle(x: float, y: float, side: float, e: float, l1: float, l2: float) -> float:
    """Return the arm angle from +x, counter-clockwise, radians.

    Limb 2 is the mirror image, pi - theta: neither angle jumps while the tool stays below.
    """
    ux, uy, _, _, _ = limb(x, y, side, e, l1, l2)
    angle = math.atan2(uy, side * ux)
    return angle if side > 0.0 else math.pi - angle


@kernel
def tool_position(
    theta1: float, theta2: float, e: float, l1: float, l2: float
) -> tuple[float, float]:
    """Return x, y of the lower assembly mode (sin alpha > 0); NaN where the rods do not meet."""
    x1, y1 = e + l1 * math.cos(theta1), l1 * math.sin(theta1)
    x2, y2 = -e + l1 * math.cos(theta2), l1 * math.sin(theta2)
    gap_x, gap_y = x1 - x2, y1 - y2
    gap2 = gap_x * gap_x + gap_y * gap_y
    drop = math.sqrt(l2 * l2 / gap2 - 0.25)
    return 0.5 * (x1 + x2) + drop * gap_y, 0.5 * (y1 + y2) - drop * gap_x


@kernel
def inverse_jacobian(
    x: float, y: float, e: float, l1: float, l2: float
) -> tuple[float, float, float, float]:
    """Return J row by row, 1/m: joint rates = J @ velocity, row_i = w_i^T / (l1 s_i)."""
    _, _, w1x, w1y, s1 = limb(x, y, 1.0, e, l1, l2)
    _, _, w2x, w2y, s2 = limb(x, y, -1.0, e, l1, l2)
    return w1x / (l1 * s1), w1y / (l1 * s1), w2x / (l1 * s2), w2y / (l1 * s2)


# A rectangle of width b and height h whose top edge lies H under the drives ----------------------


@kernel
def reach_margins(
    e: float, l1: float, l2: float, H: float, b: float, h: float
) -> tuple[float, float]:
    """Return (inner, outer) margins of the workspace to the limbs' annuli, in units of l1.

    Exact: the nearest point of the rectangle to a drive and the farthest one; >= 0 is in reach.
    """
    nearest = math.hypot(max(0.0, e - 0.5 * b), H)
    farthest = math.hypot(0.5 * b + e, H + h)
    return (nearest - abs(l2 - l1)) / l1, (l1 + l2 - farthest) / l1


@kernel
def out_of_reach(inner: float, outer: float) -> float:
    """Return > 0 where the margins say that the workspace is out of reach, or barely within."""
    short = -min(inner, outer)
    return max(0.0, short) + REACH_MARGIN if short > -REACH_MARGIN else 0.0


@kernel
def smallest_sine_beta(e: float, l1: float, l2: float, H: float, b: float, h: float) -> float:
    """Return the smallest sin beta over the workspace: exact, at its nearest or farthest point."""
    nearest2 = max(0.0, e - 0.5 * b) ** 2 + H * H
    farthest2 = (0.5 * b + e) ** 2 + (H + h) ** 2
    smallest = 1.0
    for d2 in (nearest2, farthest2):
        cos_beta = (l1 * l1 + l2 * l2 - d2) / (2.0 * l1 * l2)
        smallest = min(smallest, math.sqrt(max(0.0, 1.0 - cos_beta * cos_beta)))
    return smallest


# Many poses ---------------------------------------------------------------------------------------


@batch_kernel
def inverse_kinematics_batch(
    poses: FloatArray, e: float, l1: float, l2: float, joints: FloatArray
) -> None:
    """Fill ``joints`` (n, 2), radians, from ``poses`` (n, 2), metres."""
    for i in numba.prange(poses.shape[0]):
        x, y = poses[i]
        joints[i, 0] = arm_angle(x, y, 1.0, e, l1, l2)
        joints[i, 1] = arm_angle(x, y, -1.0, e, l1, l2)


@batch_kernel
def forward_kinematics_batch(
    joints: FloatArray, e: float, l1: float, l2: float, poses: FloatArray
) -> None:
    """Fill ``poses`` (n, 2), metres, from ``joints`` (n, 2), radians."""
    for i in numba.prange(joints.shape[0]):
        poses[i, 0], poses[i, 1] = tool_position(joints[i, 0], joints[i, 1], e, l1, l2)


@batch_kernel
def inverse_jacobian_batch(
    poses: FloatArray, e: float, l1: float, l2: float, jacobians: FloatArray
) -> None:
    """Fill ``jacobians`` (n, 2, 2), 1/m, from ``poses`` (n, 2), metres."""
    for i in numba.prange(poses.shape[0]):
        j11, j12, j21, j22 = inverse_jacobian(poses[i, 0], poses[i, 1], e, l1, l2)
        jacobians[i, 0, 0], jacobians[i, 0, 1] = j11, j12
        jacobians[i, 1, 0], jacobians[i, 1, 1] = j21, j22


@batch_kernel
def local_indices_batch(
    poses: FloatArray, e: float, l1: float, l2: float, table: FloatArray
) -> None:
    """Fill ``table`` (n, 4) from ``poses`` (n, 2): see ``LOCAL_INDICES``."""
    for i in numba.prange(poses.shape[0]):
        larger, smaller, sin_alpha, sin2_1, sin2_2 = conditioning(
            poses[i, 0], poses[i, 1], e, l1, l2
        )
        table[i, 0] = math.sqrt(larger)
        table[i, 1] = math.sqrt(smaller)
        table[i, 2] = sin_alpha
        table[i, 3] = math.sqrt(min(sin2_1, sin2_2))


# The machine --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PlanarMachine(Mechanism):
    """A symmetric planar machine of two limbs, with the rectangle that it works in.

    Pose: (x, y) of the tool, m, y < 0 below the drive axes. Joints: arm angles from +x,
    counter-clockwise, rad. The twist is the tool's velocity, m/s.
    """

    e: float = dimension("m", "half the drives' distance less half the platform's", low=0.0)
    l1: float = dimension("m", "proximal arm")
    l2: float = dimension("m", "distal rod")
    H: float = dimension("m", "from the drives' axes down to the workspace's top edge")
    b: float = dimension("m", "width of the workspace")
    h: float = dimension("m", "height of the workspace")

    pose_names = ("x", "y")
    twist_names = ("vx", "vy")
    joint_names = ("theta_1", "theta_2")
    joint_unit = "rad"
    work: ClassVar[float] = 0.05

    @property
    def lengths(self) -> tuple[float, float, float]:
        """The limbs' e, l1 and l2, m."""
        return self.e, self.l1, self.l2

    def inverse_kinematics(self, pose: FloatArray) -> FloatArray:
        """Return the arm angles (..., 2), rad, elbows outwards; NaN out of reach."""
        return self._batch(inverse_kinematics_batch, pose, (2,), *self.lengths)

    def forward_kinematics(self, joints: FloatArray, near: FloatArray | None = None) -> FloatArray:
        """Return the pose (..., 2), m, of the lower assembly mode; NaN where the rods do not meet.

        ``near`` is not needed: the mode fixes the pose.
        """
        del near
        return self._batch(forward_kinematics_batch, joints, (2,), *self.lengths)

    def inverse_jacobian(self, pose: FloatArray) -> FloatArray:
        """Return J (..., 2, 2), 1/m: arm rates = J @ velocity."""
        return self._batch(inverse_jacobian_batch, pose, (2, 2), *self.lengths)

    def jacobian(self, pose: FloatArray) -> FloatArray:
        """Return (..., 2, 2), m: velocity = jacobian @ arm rates."""
        inverse = self.inverse_jacobian(pose)
        swapped = inverse[..., ::-1, ::-1].swapaxes(-1, -2) * np.array([[1.0, -1.0], [-1.0, 1.0]])
        determinant = (
            inverse[..., 0, 0] * inverse[..., 1, 1] - inverse[..., 0, 1] * inverse[..., 1, 0]
        )
        return np.asarray(swapped / determinant[..., None, None])

    def twist(self, pose: FloatArray, pose_rate: FloatArray) -> FloatArray:
        """Return the velocity, which is the rate of the pose."""
        del pose
        return np.array(pose_rate, dtype=float)

    def symmetries(self) -> tuple[Symmetry, ...]:
        """Return the mirror between the drives."""
        return (
            Symmetry(
                "mirrored in x = 0",
                lambda pose: np.asarray(pose, dtype=float) * [-1.0, 1.0],
                lambda joints: np.pi - np.asarray(joints, dtype=float)[..., ::-1],
            ),
        )

    def local_indices(self, pose: FloatArray) -> dict[str, FloatArray]:
        """Return sigma_max, sigma_min of l1 J, sin_alpha and the smaller sin_beta: name -> (...).

        At poses (..., 2).
        """
        table = self._batch(local_indices_batch, pose, (4,), *self.lengths)
        return {name: table[..., k] for k, name in enumerate(LOCAL_INDICES)}

    def index_maps(self, pose: FloatArray) -> dict[str, IndexMap]:
        """Return singular values, condition number and transmission angles at poses (..., 2)."""
        return self.limb_maps(self.local_indices(pose))

    def limb_maps(self, local: Mapping[str, FloatArray]) -> dict[str, IndexMap]:
        """Return the maps of local indices."""
        larger, smaller = local["sigma_max"], local["sigma_min"]
        alpha, beta = (_angle(local[name]) for name in ("sin_alpha", "sin_beta"))
        condition, sine = larger / smaller, local["sin_alpha"]
        one, two = "larger singular value of l1 J", "smaller singular value of l1 J"
        rods, elbows = "between the rods", "at the elbows, the smaller one"
        return {
            "sigma_max": IndexMap("sigma_max", "", "max", larger, doc=one),
            "sigma_min": IndexMap("sigma_min", "", "min", smaller, doc=two),
            "condition": IndexMap("condition", "", "max", condition, doc="condition number of J"),
            "alpha_min": IndexMap("alpha", "rad", "min", alpha, doc=f"transmission angle {rods}"),
            "beta_min": IndexMap("beta", "rad", "min", beta, doc=f"transmission angle {elbows}"),
            "sin_alpha": IndexMap("sin_alpha", "", "min", sine, doc="sin alpha"),
        }

    def explain_reach(self, broken: list[str]) -> list[str]:
        """Say in words by how much the limbs miss the workspace: reach_inner, reach_outer."""
        inner, outer = reach_margins(*self.lengths, self.H, self.b, self.h)
        near, far = (f"{-1e3 * margin * self.l1:.1f} mm" for margin in (inner, outer))
        words = {
            "reach_inner": f"the top edge comes {near} too near to a drive",
            "reach_outer": f"the far bottom corner lies {far} beyond the limb",
        }
        return [f"{name}: {words[name]}" for name in broken]

    def links(self, pose: FloatArray) -> tuple[Link, ...]:
        """Return base, arms and rods, and the tool as a point, at a pose (2,)."""
        x, y = np.asarray(pose, dtype=float)
        drives = np.array([[self.e, 0.0], [-self.e, 0.0]])
        tool = np.array([x, y])
        angles = self.inverse_kinematics(tool)
        elbows = drives + self.l1 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return (
            Link("base", drives[::-1]),
            *(Link("rod", np.stack([elbow, tool])) for elbow in elbows),
            *(Link("arm", np.stack(ends)) for ends in zip(drives, elbows, strict=True)),
            Link("platform", tool[None]),
        )

    def workspace(self) -> FloatArray:
        """Return the rectangle's outline (5, 2), m."""
        right, top, bottom = 0.5 * self.b, -self.H, -self.H - self.h
        corners = [(-right, bottom), (right, bottom), (right, top), (-right, top), (-right, bottom)]
        return np.array(corners)

    def search_poses(self) -> FloatArray:
        """Return poses (n, 2), m, all over the workspace."""
        return self.workspace_grid(161, 41).reshape(-1, 2)

    def workspace_grid(self, columns: int, rows: int) -> FloatArray:
        """Return poses (rows, columns, 2), m, from the bottom left corner to the top right one."""
        low, high = (-0.5 * self.b, -self.H - self.h), (0.5 * self.b, -self.H)
        return rectangle(low, high, columns, rows)

    def sample_poses(self) -> FloatArray:
        """Return the middle of the workspace and two opposite corners (3, 2), m."""
        right, top, bottom = 0.5 * self.b, -self.H, -self.H - self.h
        return np.array([(0.0, 0.5 * (top + bottom)), (-right, bottom), (right, top)])


def _angle(sine: FloatArray) -> FloatArray:
    return np.arcsin(np.clip(sine, -1.0, 1.0))
