"""The path that the tool engraves, ours: a spiral on a tilted plane, the tool square to it.

From where the platform is parked to a point over the plane's middle, down to the plane, out along
an Archimedean spiral at a constant feed, up, and back. All of it is to the scale of the machine's
box and within it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, asinh, pi, sqrt

import numpy as np
import numpy.typing as npt

from pkm_gym.core.trajectory import polyline_345, ramped
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.mechanism import Pus6

PARK = np.array([0.4, 0.7, 0.6, 0.0, 0.0, 0.0])  # in half widths of the box: level, aside
SHARE = 0.8  # of the box's width and of its tilt that are used
LOW, LIFT = 0.5, 0.3  # in z: how low the plane's middle is, and the way down to it
RISE = 0.5  # in z: the most that the plane rises to its edge; a flat box has a flat plane
TOWARDS = np.radians(-60.0)  # azimuth that the plane slopes down to
TURNS = 3
PACE = 1.25  # 1/s: the feed over the spiral's radius, 50 mm/s in the default box
RAMP = 1.6  # s, in which the feed is reached
TOUCH = 1e-9  # m
COME, DIP = 1.2, 0.5  # s, from the park over the plane, and down to it


@dataclass(frozen=True)
class Plane:
    """What is engraved: middle (3,), m, axes as columns (3, 3), the third its normal.

    ``tilt`` (3,) are the angles of the tool's pose, rad; radius of the spiral and lift over it, m.
    """

    middle: FloatArray
    axes: FloatArray
    tilt: FloatArray
    radius: float
    lift: float

    @property
    def along(self) -> float:
        """Length of the spiral, m."""
        return self.radius * wound(2.0 * pi * TURNS) / (2.0 * pi * TURNS)

    @property
    def period(self) -> float:
        """How long the spiral takes, s."""
        return self.along / (PACE * self.radius) + RAMP

    def holds(self, poses: FloatArray) -> npt.NDArray[np.bool_]:
        """Return whether the tool's tip is on the plane (...) at poses (..., 6)."""
        over = (poses[..., :3] - self.middle) @ self.axes[:, 2]
        return np.asarray(np.abs(over) < TOUCH)


def plane(machine: Pus6) -> Plane:
    """Return the plane that a machine engraves."""
    radius = SHARE * machine.xy
    slope = min(SHARE * machine.tilt, asin(min(1.0, RISE * machine.z / radius)))
    normal = np.array([
        np.sin(slope) * np.cos(TOWARDS), np.sin(slope) * np.sin(TOWARDS), np.cos(slope)
    ])  # fmt: skip
    tilt = np.array([np.arctan2(-normal[1], normal[2]), np.arcsin(normal[0]), 0.0])
    middle = np.array([0.0, 0.0, -LOW * machine.z])
    axes = machine.rotation(np.concatenate([middle, tilt]))
    return Plane(middle, axes, tilt, radius, LIFT * machine.z)


def motion(machine: Pus6, samples: int) -> tuple[float, FloatArray, FloatArray]:
    """Return the duration, s, and poses and their rates (samples, 6) at equal time steps."""
    flat = plane(machine)
    first, last = COME + DIP, COME + DIP + flat.period
    duration = last + DIP + COME
    times = np.linspace(0.0, duration, samples)
    points, velocities = spiral(np.clip(times - first, 0.0, flat.period), flat)
    poses, rates = np.tile(flat.tilt, (samples, 2)), np.zeros((samples, 6))
    poses[:, :3], rates[:, :3] = flat.middle + points @ flat.axes.T, velocities @ flat.axes.T
    up = np.concatenate([flat.lift * flat.axes[:, 2], np.zeros(3)])
    park, durations, none = machine.in_box(PARK), np.array([COME, DIP]), np.zeros(2)
    for k in np.flatnonzero(times < first):
        corners = np.stack([park, poses[k] + up, poses[k]])
        polyline_345(times[k], corners, durations, none, poses[k], rates[k])
    for k in np.flatnonzero(times > last):
        corners = np.stack([poses[k], poses[k] + up, park])
        back = durations[::-1].copy()
        polyline_345(times[k] - last, corners, back, none, poses[k], rates[k])
    return duration, poses, rates


def spiral(times: FloatArray, flat: Plane) -> tuple[FloatArray, FloatArray]:
    """Return points and velocities (n, 3) in the plane's axes at times (n,) from its middle on."""
    pitch = flat.radius / (2.0 * pi * TURNS)  # m/rad
    way, speed = ramped(times, flat.period, RAMP)
    turned = unwound(PACE * flat.radius * way / pitch)
    rate = PACE * flat.radius * speed / (pitch * np.sqrt(1.0 + turned**2))
    cosine, sine, none = np.cos(turned), np.sin(turned), np.zeros_like(turned)
    points = pitch * turned[:, None] * np.stack([cosine, sine, none], axis=-1)
    across = np.stack([cosine - turned * sine, sine + turned * cosine, none], axis=-1)
    return points, pitch * rate[:, None] * across


def wound(angle: float) -> float:
    """Return the length of the spiral of unit pitch (1 per rad) up to an angle, rad."""
    return 0.5 * (angle * sqrt(1.0 + angle**2) + asinh(angle))


def unwound(lengths: FloatArray) -> FloatArray:
    """Return the angles (n,), rad, at lengths (n,) of the spiral of unit pitch.

    Newton from beyond the root of a convex function: it never overshoots.
    """
    angle = np.minimum(lengths, np.sqrt(2.0 * lengths))
    for _ in range(8):
        slope = np.sqrt(1.0 + angle**2)
        angle -= (0.5 * (angle * slope + np.arcsinh(angle)) - lengths) / slope
    return angle
