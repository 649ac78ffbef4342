"""The 3-SPR's design problem: the paper has none, this one is in its spirit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import (
    DesignProblem,
    Dimension,
    Index,
    Measurement,
    Objective,
    Options,
    TaskLike,
)
from pkm_gym.core.reference import Reference
from pkm_gym.core.sampling import symmetric_cube
from pkm_gym.core.task import Task, Variable, quantity
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.spr3.indices import (
    JACOBIANS,
    box_means,
    corners,
    homogeneous,
    smallest_revolute_sine,
)
from pkm_gym.mechanisms.spr3.limits import explain
from pkm_gym.mechanisms.spr3.mechanism import Spr3

REFERENCE = Reference.load("pkm_gym.mechanisms.spr3")

# A ratio outside this range makes no machine.
SMALLEST_RATIO, LARGEST_RATIO = 1e-3, 1e3

# The unreached measure of a design that makes no machine: its log merit is the worst, 7.
NO_MACHINE = 1e30

# Legs nearer than this to lying flat at their shortest count as out of reach, in units of D.
REACH_MARGIN = 1e-9


@dataclass(frozen=True)
class Spr3Task(Task):
    """What the 3-SPR must do; the defaults are the paper's legs and size, and limits of ours."""

    lam: float = quantity(
        0.2,
        "",
        "half the legs' stroke over their middle length",
        legal=(0.02, 0.5),
        family=(0.19, 0.25),
    )
    D: float = quantity(0.43, "m", "characteristic length (a + b + q_c) / 3", legal=(0.01, 10.0))
    volume_min: float = quantity(
        0.15,
        "",
        "smallest volume of the workspace over D^3",
        legal=(1e-4, 2.0),
        family=(0.045, 0.15),
        limit="lower",
    )
    parasitic_max: float = quantity(
        0.06,
        "",
        "largest parasitic offset over D",
        legal=(1e-3, 1.0),
        family=(0.055, 0.125),
        limit="upper",
    )
    s_angle_max: float = quantity(
        math.pi / 4,
        "rad",
        "largest angle of an S joint",
        legal=(0.05, 1.5),
        family=(0.77, 1.15),
        limit="upper",
    )
    r_angle_min: float = quantity(
        0.0,
        "rad",
        "smallest angle of an R joint, 0 = off",
        legal=(0.0, 1.5),
        family=(0.0, 0.75),
        limit="lower",
    )
    lci_low: float = quantity(
        0.3,
        "",
        "smallest local conditioning index",
        legal=(0.01, 0.95),
        family=(0.3, 0.64),
        limit="lower",
    )


@dataclass(frozen=True)
class Spr3Options(Options):
    """Options of the 3-SPR.

    Attributes:
        jacobian: whose conditioning: velocity, tilt-a, tilt-b, tilt-D or points.
        nodes: Gauss nodes in each of three directions.
    """

    jacobian: str = "velocity"
    nodes: int = 3

    def __post_init__(self) -> None:
        """Refuse illegal options."""
        check_known("jacobian", [self.jacobian], JACOBIANS)
        if not (isinstance(self.nodes, int) and 2 <= self.nodes <= 64):
            raise ValueError(f"nodes is {self.nodes!r}: it must be a whole number from 2 to 64")


INDICES = (
    Index("gci", "", "mean local conditioning index over the workspace"),
    Index("volume", "m^3", "volume of the workspace"),
    Index("parasitic", "m", "largest parasitic offset"),
    Index("s_angle", "rad", "largest angle of an S joint, from the base's normal to the leg"),
    Index("r_angle", "rad", "smallest angle of an R joint, from the platform's plane to the leg"),
    Index("lci_min", "", "smallest local conditioning index"),
)


@kernel
def dimensions_violation(r1: float, r3: float) -> float:
    """Return > 0 where the ratios make no machine, from 0 to 1."""
    r2 = 3.0 - r1 - r3
    if not (math.isfinite(r1) and math.isfinite(r3)):
        return 1.0
    smallest, largest = min(r1, r2, r3), max(r1, r2, r3)
    return min(1.0, max(SMALLEST_RATIO - smallest, largest / LARGEST_RATIO - 1.0))


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
    """Fill indices (n, 6), violations (n, 9) and unreached (n,) of designs (n, 2)."""
    for i in numba.prange(designs.shape[0]):
        unreached[i] = measure_one(
            designs[i, 0], designs[i, 1], tasks[own_row(i, tasks.shape[0])], jacobian, nodes,
            weights, table[i], violations[i],
        )  # fmt: skip


@kernel
def measure_one(
    r1: float,
    r3: float,
    task: FloatArray,
    jacobian: int,
    nodes: FloatArray,
    weights: FloatArray,
    table: FloatArray,
    violations: FloatArray,
) -> float:
    """Fill one design's row of indices and violations; return > 0 where they are undefined."""
    lam, D, volume_min, parasitic_max, s_angle_max, r_angle_min, lci_low = task
    table[:] = math.nan
    violations[0] = dimensions_violation(r1, r3)
    if violations[0] > 0.0:
        violations[1:] = 1.0 + violations[0]
        return NO_MACHINE
    r2 = 3.0 - r1 - r3
    length, spin = homogeneous(jacobian, r1, r2, 1.0)
    flat = abs(r2 - r1) - r3 * (1.0 - lam)

    share = det = fold = lci = offset = s_cos = volume = gci = 0.0
    if abs(r2 - r1) < r3:
        share, det, fold, lci, offset, s_cos = corners(r1, r2, r3, lam, length, spin)
    if share == 1.0:
        share, inside, volume, gci = box_means(r1, r2, r3, lam, length, spin, nodes, weights)
        det = min(det, inside)
    if share < 1.0 or not gci > 0.0 or flat > -REACH_MARGIN:
        unreached = max(0.0, flat) + max(REACH_MARGIN, 1.0 - share)
        violations[1] = unreached
        violations[2:] = 1.0 + unreached
        return unreached

    table[0], table[1], table[2], table[5] = gci, volume * D**3, offset * D, lci
    table[3] = math.acos(min(1.0, max(-1.0, s_cos)))
    table[4] = math.asin(smallest_revolute_sine(r1, r2, r3, lam))
    violations[1], violations[2], violations[3] = flat, -det, -fold
    violations[4], violations[5] = 1.0 - volume / volume_min, offset / parasitic_max - 1.0
    violations[6], violations[7] = table[3] - s_angle_max, r_angle_min - table[4]
    violations[8] = lci_low - lci
    return 0.0


class Spr3Problem(DesignProblem):
    """Conditioning of the 3-SPR over its whole workspace.

    Maximise the mean local conditioning index over r1 = a/D and r3 = q_c/D (r2 = b/D = 3 - r1 - r3)
    with legs from q_c (1 - lam) to q_c (1 + lam), so that the joint box is free of singularities,
    the workspace is large enough, and the parasitic offset, the joints' angles and the local
    conditioning keep their limits all over it.
    """

    name = "spr3"
    title = "3-DOF spatial mechanism with two rotations and one translation"
    version = 1
    package = "pkm_gym.mechanisms.spr3"
    task_type = Spr3Task
    options_type = Spr3Options
    all_variables = (
        Variable("r1", 0.15, 0.8, "", "a / D"),
        Variable("r3", 1.1, 1.8, "", "q_c / D"),
    )
    all_objectives = (Objective("gci", "maximise", "", worst=0.0),)
    constraint_names = (
        "dimensions",
        "assembly",
        "determinant",
        "fold",
        "volume",
        "parasitic",
        "s_angle",
        "r_angle",
        "lci",
    )
    dimension_names = ("r2", "a", "b", "q_min", "q_max")
    penalty_weight = 5.0
    options: Spr3Options

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._nodes = symmetric_cube(self.options.nodes)
        self._jacobian = JACOBIANS.index(self.options.jacobian)
        self._scale = np.array([REFERENCE.data["jacobians"][self.options.jacobian]["gci"]])
        self._work = 5.0 + 0.4 * self.options.nodes**3  # microseconds a design

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

    def _mechanism(self, design: FloatArray, task: Spr3Task) -> Spr3:
        r1, r3 = map(float, design)
        if dimensions_violation(r1, r3) > 0.0:
            raise ValueError(_no_machine(r1, r3))
        q_c = r3 * task.D
        return Spr3(
            a=r1 * task.D,
            b=(3.0 - r1 - r3) * task.D,
            q_min=q_c * (1.0 - task.lam),
            q_max=q_c * (1.0 + task.lam),
        )

    def derived(self, design: FloatArray, task: TaskLike = None) -> dict[str, Dimension]:
        """Return r2, a, b, q_min and q_max of a design (d,)."""
        machine = self.mechanism(design, task)
        assert isinstance(machine, Spr3)
        lengths = {name: Dimension(getattr(machine, name), "m") for name in LENGTHS}
        return {"r2": Dimension(machine.b / machine.D, ""), **lengths}

    def from_dimensions(
        self, dimensions: Mapping[str, float], task: Spr3Task
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Turn a, b, q_min, q_max (m), or r2 beside another ratio, into ratios, lam and D."""
        del task
        values = dict(dimensions)
        lengths = {name: values.pop(name) for name in LENGTHS if name in values}
        if lengths:
            missing = [name for name in LENGTHS if name not in lengths]
            if missing or values:
                what = f"lacks {', '.join(missing)}" if missing else f"also has {', '.join(values)}"
                raise ValueError(f"a design in lengths needs just a, b, q_min and q_max: it {what}")
            a, b, q_min, q_max = lengths.values()
            if not (all(0.0 < x < math.inf for x in lengths.values()) and q_min < q_max):
                raise ValueError(
                    f"a, b, q_min, q_max are {a:g}, {b:g}, {q_min:g}, {q_max:g} m: all must be "
                    "finite and > 0, and q_min < q_max"
                )
            q_c = 0.5 * (q_min + q_max)
            D = (a + b + q_c) / 3.0
            return {"r1": a / D, "r3": q_c / D}, {"lam": (q_max - q_min) / (2.0 * q_c), "D": D}
        if "r2" in values:
            r2 = values.pop("r2")
            if len(values) != 1:
                raise ValueError("r2 needs r1 or r3 beside it, and not both: they add up to 3")
            other = "r3" if "r1" in values else "r1"
            values[other] = 3.0 - r2 - next(iter(values.values()))
        return values, {}

    def explain_limits(self, design: FloatArray, task: Spr3Task, broken: list[str]) -> list[str]:
        """Say in words, a line a broken limit, where in the workspace and by how much."""
        full = self._complete_one(design)
        if "dimensions" in broken:
            return [f"dimensions: {_no_machine(*map(float, full))}"]
        return explain(self._mechanism(full, task), task, broken, self.options.jacobian)


LENGTHS = ("a", "b", "q_min", "q_max")


def _no_machine(r1: float, r3: float) -> str:
    return (
        f"r1 = {r1:g}, r2 = {3.0 - r1 - r3:g}, r3 = {r3:g} make no machine: each must lie between "
        f"{SMALLEST_RATIO:g} and {LARGEST_RATIO:g}"
    )
