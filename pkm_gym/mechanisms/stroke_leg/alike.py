"""Designs that measure alike: B may turn about the hip if phi gives way.

All that the leg does depends on l1, l5, l6, gamma, |OB| and phi + theta_B; only the gap and the
height of B tell designs on the circle about O apart. So most optima lie on an arc of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from pkm_gym.core.evolution import INSIDE
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray

TURNED = ("l3", "l6", "phi", "th3")  # l6 stays
STEP = 0.01  # rad, by which the ends of an arc are looked for
STEPS = 200
HALVES = 40  # of the last step

Inside: TypeAlias = Callable[[FloatArray], BoolArray]


def turned(problem: DesignProblem, designs: FloatArray, angles: FloatArray) -> FloatArray:
    """Return designs (n, d) with B turned about O by angles (n,), rad, and phi less by as much."""
    column = [problem.variable_names.index(name) for name in TURNED]
    l3, l6, phi, th3 = designs[:, column].T
    b = (l6 - l3 * np.exp(-1j * th3)) * np.exp(1j * angles)
    found = designs.copy()
    found[:, column] = np.stack([abs(l6 - b), l6, phi - angles, -np.angle(l6 - b)], axis=-1)
    return found


def middle_of_arc(problem: DesignProblem, designs: FloatArray, tasks: FloatArray) -> FloatArray:
    """Return the middle (n, d) of the arc of feasible designs alike that each design is on.

    Designs that aren't feasible stay as they are, and all do where one of l3, phi, th3 is fixed.
    """
    if not {*TURNED} <= {*problem.variable_names}:
        return designs

    def inside(angles: FloatArray) -> BoolArray:
        moved = turned(problem, designs, angles)
        within = ((moved >= problem.low) & (moved <= problem.high)).all(axis=1)
        kept = (problem.evaluate(moved, tasks).constraints <= INSIDE).all(axis=1)
        return np.asarray(within & kept)

    ends = [_end(inside, np.zeros(len(designs)), side) for side in (-STEP, STEP)]
    middle = turned(problem, designs, 0.5 * (ends[0] + ends[1]))
    alike = inside(0.5 * (ends[0] + ends[1]))
    return np.where(alike[:, None], middle, designs)


def _end(inside: Inside, angles: FloatArray, step: float) -> FloatArray:
    """Return how far (n,) the arcs go in steps of this size, two radians at most."""
    going = np.ones(len(angles), dtype=bool)
    for _ in range(STEPS):
        going &= inside(angles + step)
        angles = np.where(going, angles + step, angles)
        if not going.any():
            break
    for _ in range(HALVES):
        step *= 0.5
        angles = np.where(inside(angles + step), angles + step, angles)
    return angles
