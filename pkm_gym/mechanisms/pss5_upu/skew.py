"""The skew design problem of the 5-PSS/UPU, ours: a layout that works."""

from __future__ import annotations

import math

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.merit import write
from pkm_gym.core.rows import Measured
from pkm_gym.core.tally import TALLY
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.clearances import ROD_RAIL, ROD_ROD, ROD_UPU, fill_clearances
from pkm_gym.mechanisms.pss5_upu.conditioning import fill_rcond
from pkm_gym.mechanisms.pss5_upu.declared import (
    LEAST_RCOND,
    PSS5_UPU_SKEW,
    RAIL_SHARE,
    SKEW_DESIGN,
    SKEW_TASK,
    SKEW_UNDEFINED,
    WEIGHTS,
    Limits,
    SkewDesign,
    SkewIndices,
    SkewOptions,
    SkewTask,
)
from pkm_gym.mechanisms.pss5_upu.extremes import (
    COSINE,
    DET,
    ETA,
    FORCE,
    HIGH,
    LOW,
    REACH,
    SKEW_EXTREMES,
    SWING,
    fill_quality,
)
from pkm_gym.mechanisms.pss5_upu.kinematics import home_height, lay_out, least_gap
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu
from pkm_gym.mechanisms.pss5_upu.problem import (
    GTI,
    GTW,
    K_ETA,
    K_LAMBDA,
    K_V,
    K_W,
    BoxProblem,
    SetOut,
    composite,
    possible,
    unreached_by,
)
from pkm_gym.mechanisms.pss5_upu.smooth import columns, take_apart

ENOUGH = 2.0 * LEAST_RCOND  # of a condition that holds nothing back
# Microseconds of a design.
QUALITY_WORK, CLEARANCE_WORK, RCOND_WORK, PIECES_WORK = 40.0, 110.0, 150.0, 300.0


@batch_kernel
def set_out(
    designs: FloatArray,
    tasks: FloatArray,
    boxes: FloatArray,
    layouts: FloatArray,
    lengths: FloatArray,
    rails: FloatArray,
    radii: FloatArray,
) -> None:
    """Fill what the kernels take of designs (n, 8) and their tasks: see ``SetOut``."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(SKEW_TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(SKEW_DESIGN)[i, 0]
        n = task.n
        r, R, L = n * (3.0 - design.n2 - design.n3), n * design.n2, n * design.n3
        lay_out(layouts[i], r, R, design.theta, design.a2, design.a3, design.b2, design.b3)
        box = boxes[i]
        box[0], box[1] = task.x0 * n, home_height(r, R, L, design.theta, design.lam0)
        box[2], box[3], box[4] = task.x * n, task.y * n, task.z * n
        box[5], box[6] = task.tilt_y, task.tilt_x
        lengths[i], radii[i] = L, r
        rails[i] = min(task.rail_length * n, RAIL_SHARE * R / math.cos(design.theta))


@kernel
def turnable(second: float, third: float) -> bool:
    """Return whether two offsets are angles within half a turn; NaN is none."""
    return abs(second) < math.pi and abs(third) < math.pi


@kernel
def measure_one(
    design: SkewDesign,
    task: SkewTask,
    means: FloatArray,
    found: FloatArray,
    clear: FloatArray,
    rcond: float,
    box: FloatArray,
    rail: float,
    r: float,
) -> tuple[SkewIndices, Limits, float]:
    """Return one design's indices, own limit, and > 0 where its indices are undefined."""
    n1 = 3.0 - design.n2 - design.n3
    impossible = possible(n1, design.n2, design.n3, design.theta, design.lam0, task.n)
    if not (turnable(design.a2, design.a3) and turnable(design.b2, design.b3)):
        impossible = 1.0
    if impossible > 0.0:
        return SKEW_UNDEFINED, Limits(impossible), 0.0
    unreached = unreached_by(found[REACH], means)
    lti_min, swing = min(found[COSINE], found[ETA]), math.acos(max(-1.0, min(1.0, found[SWING])))
    if unreached > 0.0:
        lti_min = swing = math.nan
    indices = SkewIndices(
        K_v=means[K_V],
        K_w=means[K_W],
        K_lambda=means[K_LAMBDA],
        K_eta=means[K_ETA],
        F=composite(means),
        gti=means[GTI],
        gtw=means[GTW],
        lti_min=lti_min,
        rcond=rcond,
        transmission=found[COSINE],
        slider_low=found[LOW],
        slider_high=found[HIGH],
        rod_rod=clear[ROD_ROD],
        rod_rail=clear[ROD_RAIL],
        rod_upu=clear[ROD_UPU],
        swing=swing,
        force=found[FORCE],
        height=(box[1] + box[4]) / task.n,
        gap=min(least_gap(design.a2, design.a3), least_gap(design.b2, design.b3)),
        clearance=min(clear[ROD_ROD], clear[ROD_RAIL], clear[ROD_UPU]),
        determinant=found[DET] / (r * r),
        rail_start=found[LOW] / task.n,
        rail_end=found[HIGH] / rail,
        reach=found[REACH],
        share=min(n1, design.n2, design.n3),
        platform=n1 / design.n2,
    )
    return indices, Limits(dimensions=impossible), unreached


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    means: FloatArray,
    found: FloatArray,
    clearances: FloatArray,
    rcond: FloatArray,
    boxes: FloatArray,
    rails: FloatArray,
    radii: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill the rows of ``SkewIndices`` and ``Limits`` and unreached (n,) of designs (n, 8)."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(SKEW_TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(SKEW_DESIGN)[i, 0]
        indices, limits, unreached[i] = measure_one(
            design, task, means[i], found[i], clearances[i], rcond[i], boxes[i], rails[i], radii[i]
        )
        write(table[i], indices)
        write(own[i], limits)


class SkewProblem(BoxProblem):
    """A 5-PSS/UPU that isn't singular: the azimuths of its joints are searched as well.

    Maximise the mean of the least input and output transmission over eight variables, so that every
    pose of the box is reached, nothing collides, the sliders stay on their rails, joints and motors
    keep their limits, and no singularity lies within.
    """

    declared = PSS5_UPU_SKEW
    options: SkewOptions
    task: SkewTask

    def _set_out(self, designs: FloatArray, tasks: FloatArray) -> SetOut:
        out = SetOut.empty(len(designs))
        set_out(0.4 * len(designs), designs, tasks, *out)
        return out

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        n, out = len(designs), self._set_out(designs, tasks)
        means, found = self._means(out), self._ranges(out, SKEW_EXTREMES)
        clearances, rcond = np.empty((n, 3)), np.empty(n)
        at_nodes = self._nodes, out.boxes, out.layouts, out.lengths
        fill_quality(QUALITY_WORK * n, *at_nodes, self._upu, found)
        fill_clearances(CLEARANCE_WORK * n, *at_nodes, out.rails, self._upu, found, clearances)
        fill_rcond(RCOND_WORK * n, *at_nodes, out.radii, self._upu, math.inf, found, rcond)
        measure(
            0.3 * n, designs, tasks, means, found, clearances, rcond, out.boxes, out.rails,
            out.radii, rows.table, rows.own, rows.unreached,
        )  # fmt: skip

    def pieces(self, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        """Return the log objective and the limits node by node and limb by limb."""
        TALLY.designs += len(designs)
        full = np.ascontiguousarray(self.complete(designs))
        n, out = len(full), self._set_out(full, tasks)
        means, found = self._means(out), self._ranges(out, SKEW_EXTREMES)
        at_nodes = self._nodes, out.boxes, out.layouts, out.lengths
        rcond, rows = np.empty(n), np.empty((n, columns(len(self._nodes))))
        fill_rcond(RCOND_WORK * n, *at_nodes, out.radii, self._upu, ENOUGH, found, rcond)
        name = self.objectives[0].name
        if name == "lti_min":
            fill_quality(QUALITY_WORK * n, *at_nodes, self._upu, found)
        values = {
            "gti": means[:, GTI],
            "F": means[:, : len(WEIGHTS)] @ WEIGHTS,
            "lti_min": np.minimum(found[:, COSINE], found[:, ETA]),
        }[name]
        take_apart(
            PIECES_WORK * n, full, tasks, *at_nodes, out.rails, out.radii, self._upu,
            np.ascontiguousarray(values), means, found, rcond, rows,
        )  # fmt: skip
        return rows

    def explain_dimensions(self, design: FloatArray) -> str:
        """Say in words that a complete design makes no machine, and what is allowed."""
        for variable, value in zip(self.all_variables[4:], design[4:], strict=True):
            if not abs(value) < math.pi:
                return (
                    f"dimensions: {variable.name} = {np.degrees(value):.4g} deg makes no machine: "
                    "it must lie between -180 and 180 deg"
                )
        return super().explain_dimensions(design)

    def _mechanism(self, design: FloatArray, task: SkewTask) -> Pss5Upu:
        n1, n2, n3 = (task.n * share for share in self.sizes(design).values())
        theta, lam0, a2, a3, b2, b3 = (float(x) for x in design[2:8])
        return Pss5Upu(
            r=n1, R=n2, L=n3, theta=theta, lam0=lam0, a2=a2, a3=a3, b2=b2, b3=b3, upu=self._upu,
            x0=task.x0 * task.n, x=task.x * task.n, y=task.y * task.n, z=task.z * task.n,
            beta=task.tilt_y, gamma=task.tilt_x, rail=task.rail_length * task.n,
        )  # fmt: skip
