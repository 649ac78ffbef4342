"""The paper's path: down, across, up in a plane through the axis, and the legs' motion along it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel
from pkm_gym.core.trajectory import duration_345, polyline_345
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.cover import cylinder_extremes
from pkm_gym.mechanisms.spr3.kinematics import level

if TYPE_CHECKING:
    from pkm_gym.mechanisms.spr3.mechanism import Spr3

PLACES = 0.001  # m, between the heights that a path is tried at
SAMPLES = 101  # of a side of a path


@dataclass(frozen=True)
class GatePath:
    """P1 (-R, z_start), P2 (-R, z_across), P3 (R, z_across), P4 (R, z_start) of the paper's fig. 2.

    Attributes:
        radius: R, m.
        z_start: z of the first and the last corner, m.
        z_across: z of the way across, m.
        gamma: angle of the path's plane from x, rad.
    """

    radius: float
    z_start: float
    z_across: float
    gamma: float = 0.0

    @property
    def corners(self) -> FloatArray:
        """The four corners (4, 3), m."""
        r = self.radius * np.array([-1.0, -1.0, 1.0, 1.0])
        z = np.array([self.z_start, self.z_across, self.z_across, self.z_start])
        return np.stack([r * np.cos(self.gamma), r * np.sin(self.gamma), z], axis=-1)

    @property
    def points(self) -> FloatArray:
        """Positions (n, 3), m, along the path."""
        share = np.linspace(0.0, 1.0, SAMPLES)[:, None]
        sides = [
            start + share * (end - start)
            for start, end in zip(self.corners[:-1], self.corners[1:], strict=True)
        ]
        return np.concatenate(sides)


@dataclass(frozen=True)
class Motion:
    """The legs along a path.

    Attributes:
        times: array (n,), s.
        positions: array (n, 3) of O_A, m.
        velocities: array (n, 3) of O_A, m/s.
        lengths: array (n, 3) of the legs, m; NaN out of reach.
        rates: array (n, 3) of the legs, m/s; NaN out of reach.
    """

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray
    lengths: FloatArray
    rates: FloatArray


def motion(
    machine: Spr3, path: GatePath, speed: float, acceleration: float, samples: int = 601
) -> Motion:
    """Return the legs' motion along a path of rest-to-rest 3-4-5 moves. Eqs (21), (22).

    ``speed`` (m/s) and ``acceleration`` (m/s^2) are the largest ones of O_A.
    """
    corners = path.corners
    sides = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    durations = np.array([duration_345(side, speed, acceleration) for side in sides])
    times = np.linspace(0.0, durations.sum(), samples)
    positions, velocities = np.empty((samples, 3)), np.empty((samples, 3))
    _along(0.05 * samples, times, corners, durations, positions, velocities)
    poses = machine.pose_at(positions)
    rates = np.einsum("nij,nj->ni", machine.inverse_jacobian(poses), velocities)
    return Motion(times, positions, velocities, machine.inverse_kinematics(poses), rates)


@batch_kernel
def _along(
    times: FloatArray,
    corners: FloatArray,
    durations: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
) -> None:
    for k in numba.prange(times.shape[0]):
        polyline_345(times[k], corners, durations, positions[k], velocities[k])


def needed_range(machine: Spr3, path: GatePath) -> tuple[float, float]:
    """Return the shortest and the longest leg, m, that a path asks for; NaN beyond the fold."""
    lengths = machine.leg_lengths(machine.pose_at(path.points))
    return float(lengths.min()), float(lengths.max())


def best_place(machine: Spr3, radius: float, height: float, gamma: float = 0.0) -> GatePath:
    """Return the path of that size, its way across nearer to the base, at the best height.

    The best is the one whose legs leave the machine's range the least, or stay within it the most.

    Raises:
        ValueError: where no height lets the platform follow the path.
    """
    best, least = None, np.inf
    for near in np.arange(PLACES, machine.a + machine.b + machine.q_max, PLACES):
        path = GatePath(radius, float(near) + height, float(near), gamma)
        shortest, longest = needed_range(machine, path)
        outside = max(machine.q_min - shortest, longest - machine.q_max)
        if outside < least:
            best, least = path, outside
    if best is None:
        raise ValueError(
            f"no height lets the platform follow a path with R = {radius:g} m, h = {height:g} m"
        )
    return best


def largest_cylinder(machine: Spr3, slenderness: float = 0.5) -> tuple[float, float, float]:
    """Return R, h = slenderness R and z_c, m, of the largest cylinder in the workspace.

    It holds the paths of its shape in every direction gamma.
    """
    from scipy.optimize import brentq, minimize_scalar

    extremes = np.empty(7)

    def room(radius: float, z_c: float) -> float:
        cylinder_extremes(machine.a, machine.b, z_c, radius, slenderness * radius, extremes)
        if extremes[1] < extremes[0]:
            return -machine.q_max
        return float(min(extremes[3] - machine.q_min, machine.q_max - extremes[4]))

    def largest(z_c: float) -> float:
        return float(brentq(room, 0.0, machine.q_max, args=(z_c,), xtol=1e-12))

    low, high = (level(q, machine.a, machine.b) for q in (machine.q_min, machine.q_max))
    margin = 1e-6 * (high - low)
    found = minimize_scalar(
        lambda z: -largest(z), bounds=(low + margin, high - margin), method="bounded",
        options={"xatol": 1e-10},
    )  # fmt: skip
    radius = -float(found.fun)
    return radius, slenderness * radius, float(found.x)
