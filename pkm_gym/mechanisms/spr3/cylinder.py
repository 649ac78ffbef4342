"""A second design problem of the 3-SPR: a given cylinder, to be covered by a small machine."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.dimensions import SMALLEST, dimensions_violation
from pkm_gym.core.mechanism import IndexMap, Mechanism
from pkm_gym.core.merit import write
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Measured
from pkm_gym.core.sampling import triangular_cylinder
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.cover import LOOKS, CylinderSpr3, cylinder_extremes, cylinder_mean
from pkm_gym.mechanisms.spr3.declared import (
    CYLINDER_DESIGN,
    CYLINDER_TASK,
    CYLINDER_UNDEFINED,
    JACOBIANS,
    SPR3_CYLINDER,
    Conditioning,
    CylinderDesign,
    CylinderIndices,
    CylinderLimits,
    CylinderTask,
    Spr3Options,
)
from pkm_gym.mechanisms.spr3.indices import homogeneous
from pkm_gym.mechanisms.spr3.lockstep import lanes_for
from pkm_gym.mechanisms.spr3.words import assembly_over_cylinder

# The least that a cylinder counts as out of reach.
REACH_MARGIN = 1e-9

# Legs as they are drawn where next to nothing of the cylinder is reached.
SMALLEST_STROKE = 1e-6


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    jacobian: int,
    nodes: FloatArray,
    weights: FloatArray,
    looks: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill the rows of ``Indices`` and ``Limits`` and unreached (n,) of designs (n, 3)."""
    for i in numba.prange(designs.shape[0]):
        extremes = np.empty(7)
        task = tasks.view(CYLINDER_TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(CYLINDER_DESIGN)[i, 0]
        indices, limits, unreached[i] = measure_one(
            design, task, jacobian, nodes, weights, looks, extremes
        )
        write(table[i], indices)
        write(own[i], limits)


@kernel
def measure_one(
    design: CylinderDesign,
    task: CylinderTask,
    jacobian: int,
    nodes: FloatArray,
    weights: FloatArray,
    looks: FloatArray,
    extremes: FloatArray,
) -> tuple[CylinderIndices, CylinderLimits, float]:
    """Return one design's indices, own limits, and > 0 where it is out of reach."""
    a, b, z_c, radius, height = design.a, design.b, design.z_c, task.radius, task.height
    impossible = dimensions_violation((a, b, z_c), SMALLEST)
    if impossible > 0.0:
        return CYLINDER_UNDEFINED, CylinderLimits(impossible, math.nan), 0.0

    lanes = lanes_for(max(looks.shape[0], nodes.shape[0]))
    sunk, share, gci = 0.5 * height / z_c - 1.0, 0.0, math.nan
    if sunk < 0.0:
        cylinder_extremes(a, b, z_c, radius, height, looks, lanes, extremes)
        share = extremes[1] / extremes[0]
    _, _, det, q_min, q_max, s_cos, fold = extremes
    D = (a + b + 0.5 * (q_min + q_max)) / 3.0
    if share == 1.0:
        length, spin = homogeneous(jacobian, a, b, D)
        inside, gci = cylinder_mean(a, b, z_c, radius, height, length, spin, nodes, weights, lanes)
        det = min(det, inside)
    if not gci > 0.0:
        unreached = max(0.0, sunk) + max(REACH_MARGIN, 1.0 - share)
        return CYLINDER_UNDEFINED, CylinderLimits(impossible, unreached), unreached

    indices = CylinderIndices(
        gci=gci,
        q_min=q_min,
        q_max=q_max,
        stroke_ratio=q_max / q_min,
        D=D,
        s_angle=math.acos(min(1.0, max(-1.0, s_cos))),
        det=det,
    )
    return indices, CylinderLimits(dimensions=impossible, assembly=-fold), 0.0


class Spr3CylinderProblem(DesignProblem):
    """Conditioning of a small 3-SPR over a given cylinder.

    Maximise the mean local conditioning index over a, b and the cylinder's place z_c, so that the
    platform's centre reaches the whole cylinder without singularity, the legs' stroke and the
    machine stay small, and the S joints keep their limit. The paper's path, in every plane through
    the z axis, sweeps such a cylinder; its size and the limits are ours.
    """

    declared = SPR3_CYLINDER
    options: Spr3Options

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._nodes = (*triangular_cylinder(self.options.nodes), LOOKS)
        self._jacobian = JACOBIANS.index(self.options.jacobian)
        scales = self.reference.table(f"jacobians.{self.options.jacobian}", Conditioning)
        self.scale = scales.gci
        self._work = 2.0 + 0.05 * self.options.nodes**3  # microseconds a design

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        measure(
            len(designs) * self._work, designs, tasks, self._jacobian, *self._nodes, rows.table,
            rows.own, rows.unreached,
        )  # fmt: skip

    def index_maps(self, machine: Mechanism, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., 3), of the Jacobian that was chosen."""
        assert isinstance(machine, CylinderSpr3)
        return machine.index_maps(pose, self.options.jacobian)

    def _mechanism(self, design: FloatArray, task: CylinderTask) -> CylinderSpr3:
        a, b, z_c = map(float, design)
        extremes = np.empty(7)
        lanes = lanes_for(len(LOOKS))
        cylinder_extremes(a, b, z_c, task.radius, task.height, LOOKS, lanes, extremes)
        q_min, q_max = map(float, extremes[3:5])  # of what is reached: more than one length
        return CylinderSpr3(
            a=a,
            b=b,
            q_min=q_min,
            q_max=max(q_max, q_min * (1.0 + SMALLEST_STROKE)),
            z_c=z_c,
            radius=task.radius,
            height=task.height,
        )

    def explain_own(self, design: FloatArray, task: CylinderTask, broken: list[str]) -> list[str]:
        """Say in words what keeps the platform from the cylinder."""
        del broken
        return [f"assembly: {assembly_over_cylinder(self._mechanism(design, task))}"]
