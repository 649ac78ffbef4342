"""The 3-SPR's design problem: the paper has none, this one is in its spirit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.dimensions import all_of, dimensions_violation, positive
from pkm_gym.core.mechanism import IndexMap, Mechanism
from pkm_gym.core.merit import write
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Measured
from pkm_gym.core.sampling import symmetric_cube
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.box import CORNERS, EDGES, box_means, corners, smallest_revolute_sine
from pkm_gym.mechanisms.spr3.declared import (
    DESIGN,
    JACOBIANS,
    SPR3,
    TASK,
    UNDEFINED,
    Conditioning,
    Design,
    Indices,
    Limits,
    Spr3Options,
    Spr3Task,
)
from pkm_gym.mechanisms.spr3.indices import homogeneous
from pkm_gym.mechanisms.spr3.lockstep import lanes_for
from pkm_gym.mechanisms.spr3.mechanism import Spr3
from pkm_gym.mechanisms.spr3.words import assembly_of_box

# Legs nearer than this to lying flat at their shortest count as out of reach, in units of D.
REACH_MARGIN = 1e-9

LENGTHS = ("a", "b", "q_min", "q_max")


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    jacobian: int,
    nodes: FloatArray,
    weights: FloatArray,
    at_corners: FloatArray,
    on_edges: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill the rows of ``Indices`` and ``Limits`` and unreached (n,) of designs (n, 2)."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(DESIGN)[i, 0]
        indices, limits, unreached[i] = measure_one(
            design, task, jacobian, nodes, weights, at_corners, on_edges
        )
        write(table[i], indices)
        write(own[i], limits)


@kernel
def measure_one(
    design: Design,
    task: Spr3Task,
    jacobian: int,
    nodes: FloatArray,
    weights: FloatArray,
    at_corners: FloatArray,
    on_edges: FloatArray,
) -> tuple[Indices, Limits, float]:
    """Return one design's indices, own limits, and > 0 where it is out of reach."""
    r1, r3, lam, D = design.r1, design.r3, task.lam, task.D
    r2 = 3.0 - r1 - r3
    impossible = dimensions_violation((r1, r2, r3), 1.0)
    if impossible > 0.0:
        return UNDEFINED, Limits(impossible, math.nan), 0.0
    length, spin = homogeneous(jacobian, r1, r2, 1.0)
    flat = abs(r2 - r1) - r3 * (1.0 - lam)

    sines = np.empty((2, 5))
    lanes = lanes_for(max(on_edges.shape[0], nodes.shape[0]))
    share = det = fold = lci = offset = s_cos = volume = gci = 0.0
    if abs(r2 - r1) < r3:
        share, det, fold, lci, offset, s_cos = corners(
            r1, r2, r3, lam, length, spin, at_corners, lanes, sines
        )
    if share == 1.0:
        share, inside, volume, gci = box_means(r1, r2, r3, lam, length, spin, nodes, weights, lanes)
        det = min(det, inside)
    if share < 1.0 or not gci > 0.0 or flat > -REACH_MARGIN:
        unreached = max(0.0, flat) + max(REACH_MARGIN, 1.0 - share)
        return UNDEFINED, Limits(impossible, unreached), unreached

    indices = Indices(
        gci=gci,
        volume=volume * D**3,
        parasitic=offset * D,
        s_angle=math.acos(min(1.0, max(-1.0, s_cos))),
        r_angle=math.asin(smallest_revolute_sine(r1, r2, r3, lam, on_edges, lanes, sines)),
        lci_min=lci,
        det=det,
        fold=fold,
    )
    return indices, Limits(dimensions=impossible, assembly=flat), 0.0


class Spr3Problem(DesignProblem):
    """Conditioning of the 3-SPR over its whole workspace.

    Maximise the mean local conditioning index over r1 = a/D and r3 = q_c/D (r2 = b/D = 3 - r1 - r3)
    with legs from q_c (1 - lam) to q_c (1 + lam), so that the joint box is free of singularities,
    the workspace is large enough, and the parasitic offset, the joints' angles and the local
    conditioning keep their limits all over it.
    """

    declared = SPR3
    options: Spr3Options

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._nodes = (*symmetric_cube(self.options.nodes), CORNERS, EDGES)
        self._jacobian = JACOBIANS.index(self.options.jacobian)
        scales = self.reference.table(f"jacobians.{self.options.jacobian}", Conditioning)
        self.scale = scales.gci
        self._work = 2.0 + 0.06 * self.options.nodes**3  # microseconds a design

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        measure(
            len(designs) * self._work, designs, tasks, self._jacobian, *self._nodes, rows.table,
            rows.own, rows.unreached,
        )  # fmt: skip

    def index_maps(self, machine: Mechanism, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., 3), of the Jacobian that was chosen."""
        assert isinstance(machine, Spr3)
        return machine.index_maps(pose, self.options.jacobian)

    def _mechanism(self, design: FloatArray, task: Spr3Task) -> Spr3:
        r1, r2, r3 = self.sizes(design).values()
        q_c = r3 * task.D
        return Spr3(
            a=r1 * task.D,
            b=r2 * task.D,
            q_min=q_c * (1.0 - task.lam),
            q_max=q_c * (1.0 + task.lam),
        )

    def from_dimensions(
        self, dimensions: Mapping[str, float], task: Spr3Task
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Turn a, b, q_min, q_max (m), or r2 beside another ratio, into ratios, lam and D."""
        del task
        if lengths := all_of(LENGTHS, dimensions, "m"):
            a, b, q_min, q_max = positive(lengths, "m")
            if not q_min < q_max:
                raise ValueError(f"q_min is {q_min:g} m: it must be less than q_max, {q_max:g} m")
            q_c = 0.5 * (q_min + q_max)
            D = (a + b + q_c) / 3.0
            return {"r1": a / D, "r3": q_c / D}, {"lam": (q_max - q_min) / (2.0 * q_c), "D": D}
        values = dict(dimensions)
        if "r2" in values:
            r2 = values.pop("r2")
            if len(values) != 1:
                raise ValueError("r2 needs r1 or r3 beside it, and not both: they add up to 3")
            other = "r3" if "r1" in values else "r1"
            values[other] = 3.0 - r2 - next(iter(values.values()))
        return values, {}

    def explain_own(self, design: FloatArray, task: Spr3Task, broken: list[str]) -> list[str]:
        """Say in words what keeps the legs from assembly."""
        del broken
        return [f"assembly: {assembly_of_box(self._mechanism(design, task))}"]

    def sizes(self, design: FloatArray) -> dict[str, float]:
        """Return all three ratios of a complete design."""
        r1, r3 = map(float, design)
        return {"r1": r1, "r2": 3.0 - r1 - r3, "r3": r3}
