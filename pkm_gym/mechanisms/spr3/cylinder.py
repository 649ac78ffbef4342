"""A second design problem of the 3-SPR: a given cylinder, to be covered by a small machine."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.problem import (
    DesignProblem,
    Dimension,
    Index,
    Measurement,
    Objective,
    TaskLike,
)
from pkm_gym.core.sampling import triangular_cylinder
from pkm_gym.core.task import Task, Variable, quantity
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.cover import CylinderSpr3, cylinder_extremes, cylinder_mean
from pkm_gym.mechanisms.spr3.indices import JACOBIANS, homogeneous
from pkm_gym.mechanisms.spr3.limits import explain_cover
from pkm_gym.mechanisms.spr3.problem import NO_MACHINE, REACH_MARGIN, Spr3Options

# A length outside this range makes no machine, m.
SMALLEST_LENGTH, LARGEST_LENGTH = 1e-3, 1e3

# Legs as they are drawn where next to nothing of the cylinder is reached.
SMALLEST_STROKE = 1e-6


@dataclass(frozen=True)
class CylinderTask(Task):
    """The cylinder that the platform's centre must cover, and how large the machine may be."""

    radius: float = quantity(
        0.13, "m", "radius of the cylinder", legal=(0.001, 10.0), family=(0.1, 0.15)
    )
    height: float = quantity(
        0.065, "m", "height of the cylinder", legal=(0.001, 10.0), family=(0.04, 0.08)
    )
    stroke_ratio: float = quantity(
        1.5,
        "",
        "longest leg over shortest leg, at most",
        legal=(1.01, 5.0),
        family=(1.45, 1.75),
        limit="upper",
    )
    D_max: float = quantity(
        0.43,
        "m",
        "largest characteristic length (a + b + q_c) / 3",
        legal=(0.01, 10.0),
        limit="upper",
    )
    s_angle_max: float = quantity(
        math.pi / 4,
        "rad",
        "largest angle of an S joint",
        legal=(0.05, 1.5),
        family=(0.7, 0.95),
        limit="upper",
    )


@kernel
def dimensions_violation(a: float, b: float, z_c: float) -> float:
    """Return > 0 where the lengths make no machine, from 0 to 1."""
    if not (math.isfinite(a) and math.isfinite(b) and math.isfinite(z_c)):
        return 1.0
    smallest, largest = min(a, b, z_c), max(a, b, z_c)
    return min(1.0, max(1.0 - smallest / SMALLEST_LENGTH, largest / LARGEST_LENGTH - 1.0))


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    jacobian: int,
    nodes: FloatArray,
    weights: FloatArray,
    table: FloatArray,
    violations: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill indices (n, 6), violations (n, 6) and unreached (n,) of designs (n, 3)."""
    for i in numba.prange(designs.shape[0]):
        extremes = np.empty(7)
        unreached[i] = measure_one(
            designs[i], tasks[own_row(i, tasks.shape[0])], jacobian, nodes, weights, extremes,
            table[i], violations[i],
        )  # fmt: skip


@kernel
def measure_one(
    design: FloatArray,
    task: FloatArray,
    jacobian: int,
    nodes: FloatArray,
    weights: FloatArray,
    extremes: FloatArray,
    table: FloatArray,
    violations: FloatArray,
) -> float:
    """Fill one design's row of indices and violations; return > 0 where they are undefined."""
    a, b, z_c = design
    radius, height, stroke_ratio, D_max, s_angle_max = task
    table[:] = math.nan
    violations[0] = dimensions_violation(a, b, z_c)
    if violations[0] > 0.0:
        violations[1:] = 1.0 + violations[0]
        return NO_MACHINE

    sunk, share, gci = 0.5 * height / z_c - 1.0, 0.0, math.nan
    if sunk < 0.0:
        cylinder_extremes(a, b, z_c, radius, height, extremes)
        share = extremes[1] / extremes[0]
    _, _, det, q_min, q_max, s_cos, fold = extremes
    D = (a + b + 0.5 * (q_min + q_max)) / 3.0
    if share == 1.0:
        length, spin = homogeneous(jacobian, a, b, D)
        inside, gci = cylinder_mean(a, b, z_c, radius, height, length, spin, nodes, weights)
        det = min(det, inside)
    if not gci > 0.0:
        unreached = max(0.0, sunk) + max(REACH_MARGIN, 1.0 - share)
        violations[1] = unreached
        violations[2:] = 1.0 + unreached
        return unreached

    s_angle = math.acos(min(1.0, max(-1.0, s_cos)))
    table[0], table[1], table[2], table[3] = gci, q_min, q_max, q_max / q_min
    table[4], table[5] = D, s_angle
    violations[1], violations[2] = -fold, -det
    violations[3], violations[4] = q_max / q_min / stroke_ratio - 1.0, D / D_max - 1.0
    violations[5] = s_angle - s_angle_max
    return 0.0


INDICES = (
    Index("gci", "", "mean local conditioning index over the cylinder"),
    Index("q_min", "m", "shortest leg in the cylinder"),
    Index("q_max", "m", "longest leg in the cylinder"),
    Index("stroke_ratio", "", "longest over shortest leg"),
    Index("D", "m", "characteristic length (a + b + q_c) / 3, q_c between the two"),
    Index("s_angle", "rad", "largest angle of an S joint, from the base's normal to the leg"),
)


class Spr3CylinderProblem(DesignProblem):
    """Conditioning of a small 3-SPR over a given cylinder (the paper's path in every direction).

    Maximise the mean local conditioning index over a, b and the cylinder's place z_c, so that the
    platform's centre reaches the whole cylinder without singularity, the legs' stroke and the
    machine stay small, and the S joints keep their limit.
    """

    name = "spr3_cylinder"
    title = "3-SPR that covers a given cylinder"
    version = 1
    package = "pkm_gym.mechanisms.spr3"
    reference_file = "cylinder.toml"
    task_type = CylinderTask
    options_type = Spr3Options
    all_variables = (
        Variable("a", 0.1, 0.5, "m", "radius of the revolute joints on the moving platform"),
        Variable("b", 0.2, 0.8, "m", "radius of the spherical joints on the fixed platform"),
        Variable("z_c", 0.3, 0.9, "m", "height of the cylinder's centre over the fixed platform"),
    )
    all_objectives = (Objective("gci", "maximise", "", worst=0.0),)
    constraint_names = ("dimensions", "assembly", "determinant", "stroke", "size", "s_angle")
    dimension_names = ()
    penalty_weight = 10.0
    options: Spr3Options

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._nodes = triangular_cylinder(self.options.nodes)
        self._jacobian = JACOBIANS.index(self.options.jacobian)
        self._scale = np.array([self.reference.data["jacobians"][self.options.jacobian]["gci"]])
        self._work = 6.0 + 0.5 * self.options.nodes**3  # microseconds a design

    def _chosen_indices(self) -> tuple[Index, ...]:
        return INDICES

    def _measure(self, designs: FloatArray, tasks: FloatArray) -> Measurement:
        n = len(designs)
        table, unreached = np.empty((n, len(INDICES))), np.empty(n)
        violations = np.empty((n, len(self.constraint_names)))
        measure(
            n * self._work, designs, tasks, self._jacobian, *self._nodes, table, violations,
            unreached,
        )  # fmt: skip
        return Measurement(table, violations, unreached, self._scale)

    def _mechanism(self, design: FloatArray, task: CylinderTask) -> CylinderSpr3:
        a, b, z_c = map(float, design)
        if dimensions_violation(a, b, z_c) > 0.0:
            raise ValueError(_no_machine(a, b, z_c))
        extremes = np.empty(7)
        cylinder_extremes(a, b, z_c, task.radius, task.height, extremes)
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

    def derived(self, design: FloatArray, task: TaskLike = None) -> dict[str, Dimension]:
        """Return nothing: the variables are the dimensions, and the legs are indices."""
        del design, task
        return {}

    def from_dimensions(
        self, dimensions: Mapping[str, float], task: CylinderTask
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Return the dimensions, which are the variables."""
        del task
        return dict(dimensions), {}

    def explain_limits(
        self, design: FloatArray, task: CylinderTask, broken: list[str]
    ) -> list[str]:
        """Say in words, a line a broken limit, where in the cylinder and by how much."""
        a, b, z_c = map(float, self._complete_one(design))
        if "dimensions" in broken:
            return [f"dimensions: {_no_machine(a, b, z_c)}"]
        return explain_cover(self._mechanism(np.array([a, b, z_c]), task), task, broken)


def _no_machine(a: float, b: float, z_c: float) -> str:
    return (
        f"a = {a:g}, b = {b:g}, z_c = {z_c:g} m make no machine: each must lie between "
        f"{SMALLEST_LENGTH:g} and {LARGEST_LENGTH:g} m"
    )
