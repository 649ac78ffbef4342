"""The path that the platform follows, ours: a closed Lissajous figure in all five coordinates.

From rest to rest once around, about the centre of the machine's box and to its scale.
"""

from __future__ import annotations

from math import pi

import numpy as np

from pkm_gym.core.trajectory import ramped
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

SHARE = 0.6  # of the box's half widths
WAVES = np.array([1, 2, 3, 2, 1])  # around: x, y, z, beta, gamma
PHASES = 0.5 * pi * np.array([0, 0, 0, 1, 1])
DURATION, RAMP = 4.0, 0.5  # s: once around, and until full speed is reached


def motion(machine: Pss5Upu, samples: int) -> tuple[FloatArray, FloatArray]:
    """Return poses and their rates (samples, 5) at equal time steps."""
    way, speed = ramped(np.linspace(0.0, DURATION, samples), DURATION, RAMP)
    turn = 2.0 * pi / (DURATION - RAMP) * WAVES
    angle = way[:, None] * turn + PHASES
    poses = machine.in_box(SHARE * np.sin(angle))
    rates = machine.in_box(SHARE * speed[:, None] * turn * np.cos(angle))
    return poses, rates - machine.in_box(np.zeros(5))
