"""The two design problems of the 6-PUS: indices over a box of poses, against the printed design."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.dimensions import SMALLEST, dimensions_violation
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.mechanism import IndexMap, Mechanism
from pkm_gym.core.merit import CAP, write
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import Reference
from pkm_gym.core.rows import Measured
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.mechanisms.pus6.atlas import columns, paper_designs
from pkm_gym.mechanisms.pus6.declared import (
    DESIGN,
    PUS6,
    PUS6_LAYOUT,
    SAMPLINGS,
    TASK,
    UNDEFINED,
    Design,
    Indices,
    Limits,
    Pus6Options,
    Pus6Task,
)
from pkm_gym.mechanisms.pus6.indices import (
    BLOCK,
    ETAS,
    LOCAL,
    POSE_WORK,
    STATE,
    fill_means,
    place_batch,
    tabulate,
    unit_poses,
)
from pkm_gym.mechanisms.pus6.kinematics import PER_LEG, lay_out
from pkm_gym.mechanisms.pus6.lattice import averages
from pkm_gym.mechanisms.pus6.limits import PER_NODE, node_extremes, nodes
from pkm_gym.mechanisms.pus6.mechanism import Pus6, angles_violation, explain_angles
from pkm_gym.mechanisms.pus6.smooth import OF_NODE, take_apart

SINGULAR = 1e-9  # det G^-1 at home over R^3 below which there is no machine to move
UNREACHED = 1e-9
LENGTHS = ("L", "R", "r_B")
ALONE = ("dimensions", "spacing")  # the limits that are no maximum over the nodes
DESIGN_WORK = 25.0  # microseconds, of the limits
TOGETHER = 2**17  # poses that are tabulated at a time


@kernel
def possible(design: Design) -> float:
    """Return > 0 where the dimensions make no machine."""
    impossible = dimensions_violation((design.L, design.R, design.r_B), SMALLEST)
    return max(impossible, angles_violation(design.phi_A, design.phi_C))


@batch_kernel
def set_out(
    designs: FloatArray,
    tasks: FloatArray,
    boxes: FloatArray,
    layouts: FloatArray,
    squares: FloatArray,
    lengths: FloatArray,
) -> None:
    """Fill what ``place_batch`` and ``tabulate`` take of designs (n, 5) and their tasks."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(DESIGN)[i, 0]
        boxes[i, 0], boxes[i, 1], boxes[i, 2] = task.xy, task.tilt, task.spin
        lay_out(layouts[i], design.R, design.r_B, design.phi_A, design.phi_C, task.tool)
        squares[i] = design.L * design.L
        lengths[i] = task.characteristic_length


@kernel
def measure_one(
    design: Design,
    task: Pus6Task,
    eta: FloatArray,
    printed: FloatArray,
    corners: FloatArray,
    layout: FloatArray,
    state: FloatArray,
    out: FloatArray,
) -> tuple[Indices, Limits, float]:
    """Return one design's indices, own limit, and > 0 where its indices are undefined.

    ``eta`` (6,) are the means of 1/K, NaN where a pose isn't reached, ``printed`` (6,) those of the
    printed design.
    """
    impossible = possible(design)
    if impossible > 0.0:
        return UNDEFINED, Limits(impossible), 0.0
    reach, travel, cosine, near, at_home, aspect = node_extremes(
        corners, task.xy, task.tilt, task.spin, layout, design.L * design.L, state, out
    )
    unreached = 0.0
    if not reach < 1.0:
        unreached = UNREACHED + reach - 1.0
    elif not abs(at_home) > SINGULAR * design.R**3:
        unreached, aspect = UNREACHED, 0.0
    elif not math.isfinite(eta.sum()):
        unreached = UNREACHED
    if unreached > 0.0:
        eta[:] = math.nan
    four = eta[0] / printed[0] * (eta[1] / printed[1]) * (eta[3] / printed[3])
    four *= eta[5] / printed[5]
    indices = Indices(
        eta_omega=eta[0],
        eta_v=eta[1],
        eta_alpha=eta[2],
        eta_a=eta[3],
        eta_F=eta[4],
        eta_I=eta[5],
        balanced=four**0.25,
        balanced5=(four * (eta[2] / printed[2])) ** 0.2,
        stroke=travel + 2.0 * task.z,
        rod_tilt=math.asin(min(1.0, reach)),
        s_cone=math.acos(cosine if not cosine > 1.0 else 1.0),  # NaN out of reach
        clearance=near,
        spacing=2.0 * design.r_B * math.sin(0.5 * design.phi_A),
        aspect=aspect,
        reach=reach,
    )
    return indices, Limits(dimensions=impossible), unreached


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    layouts: FloatArray,
    means: FloatArray,
    printed: FloatArray,
    corners: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill the rows of ``Indices`` and ``Limits`` and unreached (n,) of designs (n, 5)."""
    for i in numba.prange(designs.shape[0]):
        state, out = np.empty(STATE * BLOCK), np.empty(PER_NODE * BLOCK)
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(DESIGN)[i, 0]
        row = own_row(i, printed.shape[0])
        indices, limits, unreached[i] = measure_one(
            design, task, means[i], printed[row], corners, layouts[i], state, out
        )
        write(table[i], indices)
        write(own[i], limits)


class Pus6Problem(DesignProblem):
    """Conditioning of the 6-PUS over a box of poses, by coefficients of first and second order.

    Maximise the geometric mean of four of the paper's six indices, each over that of the printed
    design, over L and R (r_B, phi_A and phi_C if they are freed), so that screws, rods and joints
    keep their limits all over the box, on one side of the direct singularity.
    """

    declared = PUS6
    options: Pus6Options
    task: Pus6Task

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        paper = Reference.load(self.declared.package)
        known = {**paper.optima, **self.reference.optima}
        self.scale = known[self.objectives[0].name].value
        self._printed_design = np.array([[paper.design[v.name] for v in self.all_variables]])
        self._unit = unit_poses(SAMPLINGS[self.options.sampling])
        self._nodes = nodes()
        self._skew = 1.0 if self.options.convention == "influence" else 0.0
        self._printed: dict[float, FloatArray] = {}  # characteristic length -> means (6,)

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        together = max(1, TOGETHER // len(self._unit))
        for first in range(0, len(designs), together):
            part = slice(first, first + together)
            some = tasks if len(tasks) == 1 else tasks[part]
            self._measure_some(designs[part], some, Measured(*(each[part] for each in rows)))

    def _measure_some(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        lengths = tasks[:, Pus6Task.names().index("characteristic_length")]
        printed = np.stack([self._printed_means(float(length)) for length in lengths])
        layouts, means = self._means(designs, tasks)
        measure(
            DESIGN_WORK * len(designs), designs, tasks, layouts, means, printed, self._nodes,
            rows.table, rows.own, rows.unreached,
        )  # fmt: skip

    def pieces(self, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        """Return the log objective and the limits of each leg and pair of rods at each node."""
        rows, full = super().pieces(designs, tasks), self.complete(designs)
        n, nodes = len(full), len(self._nodes)
        boxes, layouts = np.empty((n, 3)), np.empty((n, 6 * PER_LEG))
        set_out(0.2 * n, full, tasks, boxes, layouts, np.empty(n), np.empty(n))
        parts = np.empty((n, nodes, OF_NODE))
        take_apart(0.5 * n * nodes, full, tasks, self._nodes, layouts, parts)
        alone = rows[:, [0, *(1 + self.constraint_names.index(name) for name in ALONE)]]
        apart = parts.reshape(n, -1)
        undefined = ~np.isfinite(apart).all(axis=1) | (rows[:, 0] >= CAP)
        apart[undefined] = rows[undefined, 1:].max(axis=1, keepdims=True)
        return np.concatenate([alone, apart], axis=1)

    def _means(self, designs: FloatArray, tasks: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return layouts (n, 30) and means of the six indices (n, 6) of complete designs (n, 5)."""
        n, poses = len(designs), len(self._unit)
        boxes, layouts = np.empty((n, 3)), np.empty((n, 6 * PER_LEG))
        squares, lengths, means = np.empty(n), np.empty(n), np.empty((n, ETAS))
        set_out(0.2 * n, designs, tasks, boxes, layouts, squares, lengths)
        if self.options.workspace == "paper":
            for k in range(n):
                L, length = float(designs[k, 0]), float(lengths[k])
                found = averages(layouts[k], L, length, self._skew, self.options.same_aspect)
                means[k] = found.means
            return layouts, means
        blocks, boxes = -(-poses // BLOCK), boxes[: len(tasks)]
        states = np.empty((len(boxes), blocks, STATE * BLOCK))
        place_batch(0.05 * poses * len(boxes), self._unit, boxes, states)
        tables = np.empty((n, blocks, LOCAL * BLOCK))
        tabulate(POSE_WORK * n * poses, states, layouts, squares, lengths, self._skew, tables)
        fill_means(0.002 * n * poses, tables, poses, means)
        return layouts, means

    def _printed_means(self, length: float) -> FloatArray:
        """Return the means (6,) of the printed design over the default box or the lattice."""
        if length not in self._printed:
            task = Pus6Task(characteristic_length=length).pack()[None]
            self._printed[length] = self._means(self._printed_design, task)[1][0]
        return self._printed[length]

    def _grid(self) -> FloatArray | None:
        """Return the paper's grid: 121 designs."""
        return paper_designs()

    def atlas_columns(
        self, evaluation: Evaluation
    ) -> dict[str, tuple[FloatArray | BoolArray, str]]:
        """Return counts, normalised means and Pareto sets over the paper's lattice."""
        if self.options.workspace != "paper":
            return {}
        return columns(self.complete(evaluation.designs), self.task, self.options)

    def _mechanism(self, design: FloatArray, task: Pus6Task) -> Pus6:
        return Pus6(
            **super().sizes(design),
            tool=task.tool,
            xy=task.xy,
            z=task.z,
            tilt=task.tilt,
            spin=task.spin,
            characteristic_length=task.characteristic_length,
        )

    def index_maps(self, machine: Mechanism, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., 6), of the problem's convention."""
        assert isinstance(machine, Pus6)
        return machine.chosen_maps(pose, self.options.convention)

    def sizes(self, design: FloatArray) -> dict[str, float]:
        """Return the lengths of a complete design."""
        named = super().sizes(design)
        return {name: named[name] for name in LENGTHS}

    def explain_dimensions(self, design: FloatArray) -> str:
        """Say in words that a complete design makes no machine, and what is allowed."""
        if dimensions_violation(tuple(self.sizes(design).values()), SMALLEST) > 0.0:
            return super().explain_dimensions(design)
        return explain_angles(super().sizes(design))

    def explain_own(self, design: FloatArray, task: Any, broken: list[str]) -> list[str]:
        """Say nothing: the dimensions are the only limit of its own."""
        del design, task, broken
        return []


class Pus6LayoutProblem(Pus6Problem):
    """A 6-PUS for its tool: the angles of both hexagons are searched as well.

    Maximise the same mean over L, R, phi_A and phi_C, so that screws, rods and joints keep their
    limits all over the box of the tool's tip.
    """

    declared = PUS6_LAYOUT

    def _grid(self) -> FloatArray | None:
        return None  # it is ours
