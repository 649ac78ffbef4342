"""A step of the leg, a gait of ours: the paper shows a trot but no number of it.

The foot swings forward along a cycloid and returns on the ground along another one, at rest
relative to the hip whenever it is put down or lifted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pkm_gym.core.types import FloatArray

TROT = (0.0, 0.5, 0.5, 0.0)  # phases of the legs left front, right front, left rear, right rear


class Motion(NamedTuple):
    """The foot in the hip's frame: position (m), velocity and acceleration, all (..., 2)."""

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True)
class Step:
    """A periodic motion of the foot, swing first.

    Attributes:
        stride: m, from where the foot is lifted to where it is put down.
        lift: m, of the foot in the middle of its swing.
        period: s, of swing and stance.
        duty: share of the period that the foot is on the ground, between 0 and 1.
        hip_height: m, of the hip over the ground.
        x0: m, middle of the stride before the hip.
    """

    stride: float = 0.4
    lift: float = 0.1
    period: float = 2.0
    duty: float = 0.5
    hip_height: float = 0.8
    x0: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a step that is none.

        Raises:
            ValueError: naming the field, its value and what is allowed.
        """
        for name in ("stride", "lift", "period", "hip_height"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} is {value!r}: it must be finite and greater than 0")
        if not 0.0 < self.duty < 1.0:
            raise ValueError(f"duty is {self.duty!r}: it must lie between 0 and 1")

    def motion(self, times: FloatArray, phase: float = 0.0) -> Motion:
        """Return the foot at times (...), s, of a leg that is ``phase`` periods ahead."""
        turn = np.mod(np.asarray(times, dtype=float) / self.period + phase, 1.0)
        air = 1.0 - self.duty
        swings = turn < air
        share = np.where(swings, air, self.duty)
        part = np.where(swings, turn, turn - air) / share
        rate = 1.0 / (share * self.period)  # of ``part``
        ahead = np.where(swings, self.stride, -self.stride)
        rise = np.where(swings, 0.5 * self.lift, 0.0)
        angle = 2.0 * np.pi * part
        sine, cosine = np.sin(angle), np.cos(angle)
        omega = 2.0 * np.pi * rate
        x = self.x0 + ahead * (part - sine / (2.0 * np.pi) - 0.5)
        z = -self.hip_height + rise * (1.0 - cosine)
        return Motion(
            np.stack([x, z], axis=-1),
            np.stack([ahead * rate * (1.0 - cosine), rise * omega * sine], axis=-1),
            np.stack([ahead * rate * omega * sine, rise * omega**2 * cosine], axis=-1),
        )
