"""A path of the shape of the paper's Fig. 2, in a plane through the axis, and the legs' motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel
from pkm_gym.core.trajectory import cruise_durations, duration_345, polyline_345
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.cover import LOOKS, cylinder_extremes
from pkm_gym.mechanisms.spr3.kinematics import level
from pkm_gym.mechanisms.spr3.lockstep import lanes_for

if TYPE_CHECKING:
    from pkm_gym.mechanisms.spr3.mechanism import Spr3

PLACES = 0.001  # m, between the heights that a path is tried at
SAMPLES = 101  # of a side of a path


@dataclass(frozen=True)
class GatePath:
    """P1 (-R, z_start), P2 (-R, z_across), P3 (R, z_across), P4 (R, z_start) of the paper's Fig. 2.

    Its R, h and v_max are printed; where it stands, and on which side the way across is, isn't.

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
    """The legs along a path; what is out of reach is NaN.

    Attributes:
        times: array (n,), s.
        positions: array (n, 3) of O_A, m.
        velocities: array (n, 3) of O_A, m/s.
        lengths: array (n, 3) of the legs, m.
        rates: array (n, 3) of the legs, m/s.
        swings: array (n, 3), rad/s, how fast the legs turn across themselves.
        spins: array (n, 3), rad/s, how fast they turn about themselves, seen from B_i to A_i.
    """

    times: FloatArray
    positions: FloatArray
    velocities: FloatArray
    lengths: FloatArray
    rates: FloatArray
    swings: FloatArray
    spins: FloatArray


def motion(
    machine: Spr3,
    path: GatePath,
    speed: float,
    acceleration: float,
    samples: int = 601,
    *,
    cruise: bool = False,
) -> Motion:
    """Return the legs' motion along a path of rest-to-rest 3-4-5 moves. Eqs (21), (22).

    ``speed`` (m/s) and ``acceleration`` (m/s^2) are the largest ones of O_A. A single move a side
    reaches one of them; with ``cruise`` it stays at the speed between its halves, and reaches both.
    """
    times, positions, velocities = along(path, speed, acceleration, samples, cruise=cruise)
    poses = machine.pose_at(positions)
    rates = np.einsum("nij,nj->ni", machine.inverse_jacobian(poses), velocities)
    swings, spins = machine.limb_turning(poses, velocities)
    return Motion(
        times, positions, velocities, machine.inverse_kinematics(poses), rates,
        np.linalg.norm(swings, axis=-1), spins,
    )  # fmt: skip


def along(
    path: GatePath, speed: float, acceleration: float, samples: int, *, cruise: bool = False
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return times (n,), s, positions (n, 3), m, and velocities (n, 3), m/s, along a path.

    Moves, ``speed``, ``acceleration`` and ``cruise`` are those of ``motion``.
    """
    corners = path.corners
    sides = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    durations, cruises = np.array(
        [
            cruise_durations(side, speed, acceleration)
            if cruise
            else (duration_345(side, speed, acceleration), 0.0)
            for side in sides
        ]
    ).T.copy()
    times = np.linspace(0.0, (durations + cruises).sum(), samples)
    positions, velocities = np.empty((samples, 3)), np.empty((samples, 3))
    _along(0.05 * samples, times, corners, durations, cruises, positions, velocities)
    return times, positions, velocities


@batch_kernel
def _along(
    times: FloatArray,
    corners: FloatArray,
    durations: FloatArray,
    cruises: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
) -> None:
    for k in numba.prange(times.shape[0]):
        polyline_345(times[k], corners, durations, cruises, positions[k], velocities[k])


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

    It holds the paths of its shape in every direction gamma. The shortest leg bounds a low one, the
    longest leg a high one: the largest touches both ends.

    Raises:
        ValueError: for legs too short to hold the platform level.
    """
    from scipy.optimize import brentq

    low, high = (level(q, machine.a, machine.b) for q in (machine.q_min, machine.q_max))
    if not low < high:
        raise ValueError(
            f"no cylinder fits: legs of {machine.q_min:g} m can't hold the platform level"
        )
    extremes, lanes = np.empty(7), lanes_for(len(LOOKS))

    def margins(radius: float, z_c: float) -> tuple[float, float]:
        height = slenderness * radius
        cylinder_extremes(machine.a, machine.b, z_c, radius, height, LOOKS, lanes, extremes)
        if extremes[1] < extremes[0]:  # beyond the fold
            return -machine.q_max, -machine.q_max
        return float(extremes[3] - machine.q_min), float(machine.q_max - extremes[4])

    def largest(z_c: float) -> float:
        return float(brentq(lambda r: min(margins(r, z_c)), 0.0, machine.q_max, xtol=1e-12))

    def balance(z_c: float) -> float:
        shortest, longest = margins(largest(z_c), z_c)
        return shortest - longest

    inside = 1e-6 * (high - low)
    z_c = float(brentq(balance, low + inside, high - inside, xtol=1e-12))
    radius = largest(z_c)
    return radius, slenderness * radius, z_c
