"""The five-bar's design problem: its kernel over a task, and what only it can say."""

from __future__ import annotations

import math
from typing import Any

import numba

from five_bar.declared import (
    DESIGN,
    FIVE_BAR,
    TASK,
    UNDEFINED,
    Design,
    FiveBarOptions,
    FiveBarTask,
    Indices,
)
from five_bar.mechanism import FiveBar
from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.dimensions import SMALLEST, dimensions_violation
from pkm_gym.core.indices import angle_of_sine
from pkm_gym.core.merit import write
from pkm_gym.core.planar import conditioning, out_of_reach, reach_margins, smallest_sine_beta
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reach import ReachLimits
from pkm_gym.core.rows import Measured
from pkm_gym.core.sampling import gauss_lobatto
from pkm_gym.core.types import FloatArray


@kernel
def mean_conditioning(
    design: Design, task: FiveBarTask, nodes: FloatArray, weights: FloatArray
) -> tuple[float, float]:
    """Return the mean of sigma_min / sigma_max and the smallest sin alpha over the workspace.

    On its right half: the left one is the mirror image.
    """
    mean, sin_alpha = 0.0, math.inf
    for row in range(len(nodes)):
        y = -task.top - task.height * nodes[row]
        for column in range(len(nodes)):
            x = 0.5 * task.width * nodes[column]
            larger, smaller, sine, _, _ = conditioning(x, y, design.e, design.l1, design.l2)
            mean += weights[row] * weights[column] * math.sqrt(smaller / larger)
            sin_alpha = min(sin_alpha, sine)
    return mean, sin_alpha


@kernel
def measure_one(
    design: Design, task: FiveBarTask, nodes: FloatArray, weights: FloatArray
) -> tuple[Indices, ReachLimits, float]:
    """Return one design's indices, own limits, and > 0 where it is out of reach."""
    e, l1, l2 = design.e, design.l1, design.l2
    impossible = dimensions_violation((e, l1, l2), SMALLEST)
    if impossible > 0.0:
        return UNDEFINED, ReachLimits(impossible, math.nan, math.nan), 0.0
    place = task.top, task.width, task.height
    inner, outer = reach_margins(e, l1, l2, *place)
    limits = ReachLimits(dimensions=impossible, reach_inner=-inner, reach_outer=-outer)
    unreached = out_of_reach(inner, outer)
    if unreached > 0.0:
        return UNDEFINED, limits, unreached

    gci, sin_alpha = mean_conditioning(design, task, nodes, weights)
    sin_beta = smallest_sine_beta(e, l1, l2, *place)
    indices = Indices(
        gci=gci,
        rate=1.0 / (l1 * sin_beta),
        size=l1 + l2 + e,
        alpha_min=angle_of_sine(sin_alpha),
        beta_min=angle_of_sine(sin_beta),
        sin_alpha=sin_alpha,
    )
    return indices, limits, 0.0


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill the rows of ``Indices`` and ``ReachLimits`` and unreached (n,) of designs (n, 3)."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        indices, limits, unreached[i] = measure_one(
            designs.view(DESIGN)[i, 0], task, nodes, weights
        )
        write(table[i], indices)
        write(own[i], limits)


class FiveBarProblem(DesignProblem):
    """The five-bar of a given size that moves best over a rectangle.

    Maximise the mean conditioning over l1, l2 and e (or minimise the arms' largest rate), so that
    the workspace stays in reach in one assembly mode, the transmission angles keep their least
    values, there is room for the motors, and the links are no longer than size_max in all.
    """

    declared = FIVE_BAR
    options: FiveBarOptions

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._nodes = gauss_lobatto(self.options.nodes)
        self._work = 0.5 + 0.02 * self.options.nodes**2  # microseconds a design

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        work = len(designs) * self._work
        measure(work, designs, tasks, *self._nodes, rows.table, rows.own, rows.unreached)

    def _mechanism(self, design: FloatArray, task: FiveBarTask) -> FiveBar:
        lengths = self.sizes(design)
        return FiveBar(**lengths, H=task.top, b=task.width, h=task.height)

    def explain_own(self, design: FloatArray, task: FiveBarTask, broken: list[str]) -> list[str]:
        """Say in words by how much the limbs miss the workspace."""
        return self._mechanism(design, task).explain_reach(broken)
