"""A second design problem of the leg, ours: a leg for the rectangle that its foot moves in."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, own_row
from pkm_gym.core.dimensions import SMALLEST, dimensions_violation
from pkm_gym.core.merit import write
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Measured
from pkm_gym.core.sampling import gauss_jacobi
from pkm_gym.core.tally import TALLY
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.alike import middle_of_arc
from pkm_gym.mechanisms.stroke_leg.declared import (
    GAIT_DESIGN,
    GAIT_TASK,
    STROKE_LEG_GAIT,
    GaitTask,
)
from pkm_gym.mechanisms.stroke_leg.gait_indices import BOUNDARY, boundary, measure_one
from pkm_gym.mechanisms.stroke_leg.mechanism import explain_angles
from pkm_gym.mechanisms.stroke_leg.smooth import columns, take_apart
from pkm_gym.mechanisms.stroke_leg.workspace import GaitLeg

NODES = 10  # Gauss nodes in x and in z
INTERVALS = 12  # of an edge of the rectangle, where the limits are looked for
LENGTHS = ("l1", "l3", "l6", "l")


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    nodes: FloatArray,
    weights: FloatArray,
    edge: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill the rows of ``GaitIndices`` and ``GaitLimits`` and unreached (n,) of designs (n, 7)."""
    for i in numba.prange(designs.shape[0]):
        values = np.empty((len(BOUNDARY), edge.shape[0]))
        task = tasks.view(GAIT_TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(GAIT_DESIGN)[i, 0]
        indices, limits, unreached[i] = measure_one(design, task, nodes, weights, edge, values)
        write(table[i], indices)
        write(own[i], limits)


class StrokeLegGaitProblem(DesignProblem):
    """A leg for a gait: cylinders that carry the body and are fast enough for the foot.

    Minimise the cylinders' force over the rectangle that the foot moves in, so that cylinders of
    one kind fit, none is overloaded or too slow, the cranks keep clear of their dead lines, the
    cylinders of each other, and the leg fits under its mount.
    """

    declared = STROKE_LEG_GAIT

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._nodes = gauss_jacobi(NODES)
        self._edge = boundary(INTERVALS)

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        measure(
            4.0 * len(designs), designs, tasks, *self._nodes, self._edge, rows.table, rows.own,
            rows.unreached,
        )  # fmt: skip

    def pieces(self, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        """Return the log objective and the limits at every point of the boundary, one by one."""
        TALLY.designs += len(designs)
        rows = np.empty((len(designs), columns(len(self._edge))))
        full = np.ascontiguousarray(self.complete(designs))
        take_apart(5.0 * len(full), full, tasks, *self._nodes, self._edge, rows)
        return rows

    def _mechanism(self, design: FloatArray, task: GaitTask) -> GaitLeg:
        named = super().sizes(design)
        return GaitLeg(
            **named,
            l5=named["l1"],
            stride=task.stride,
            lift=task.lift,
            hip_height=task.hip_height,
            x0=task.x0,
            cone=task.cone,
        )

    def one_of_alike(self, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        """Return the middle of the arc of designs alike that each of designs (n, d) is on."""
        return middle_of_arc(self, designs, tasks)

    def sizes(self, design: FloatArray) -> dict[str, float]:
        """Return the lengths of a complete design."""
        named = super().sizes(design)
        return {name: named[name] for name in LENGTHS}

    def explain_dimensions(self, design: FloatArray) -> str:
        """Say in words that a complete design makes no machine, and what is allowed."""
        if dimensions_violation(tuple(self.sizes(design).values()), SMALLEST) > 0.0:
            return super().explain_dimensions(design)
        return explain_angles(super().sizes(design))

    def explain_own(self, design: FloatArray, task: GaitTask, broken: list[str]) -> list[str]:
        """Say in words by how much the rhombi miss the far corner of the foot's rectangle."""
        del broken
        far = math.hypot(abs(task.x0) + 0.5 * task.stride, task.hip_height)
        longest = 4.0 * self.sizes(design)["l"]
        words = f"the far corner of the foot's rectangle lies {1e3 * far:.1f} mm from the hip"
        return [f"reach: {words}; the stretched rhombi reach {1e3 * longest:.1f} mm"]
