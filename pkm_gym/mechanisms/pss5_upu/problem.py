"""The paper's design problem of the 5-PSS/UPU: transmission and dexterity over a box of poses."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.dimensions import SMALLEST, all_of, dimensions_violation, positive
from pkm_gym.core.mechanism import IndexMap, Mechanism
from pkm_gym.core.merit import write
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Measured
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.declared import (
    DESIGN,
    LENGTHS,
    LEVELS,
    PSS5_UPU,
    RAIL_SHARE,
    SAMPLINGS,
    TASK,
    UNDEFINED,
    WEIGHTS,
    Design,
    Indices,
    Limits,
    Pss5UpuOptions,
    Pss5UpuTask,
)
from pkm_gym.mechanisms.pss5_upu.extremes import (
    COSINE,
    EXTREMES,
    HIGH,
    LOW,
    REACH,
    fill_ranges,
    nodes,
)
from pkm_gym.mechanisms.pss5_upu.indices import BOX, MEANS, POSE_WORK, fill_sums, unit_poses
from pkm_gym.mechanisms.pss5_upu.kinematics import LIMBS, PER_LIMB, home_height, lay_out
from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

UNREACHED = 1e-9
DESIGN_WORK = 15.0  # microseconds, of the ranges at the nodes
SHARED_OUT = 4  # parts of a single design's poses
K_V, K_W, K_LAMBDA, K_ETA, GTI, GTW = range(MEANS)


class SetOut(NamedTuple):
    """What the kernels take of n designs."""

    boxes: FloatArray  # (n, 7)
    layouts: FloatArray  # (n, 35)
    lengths: FloatArray  # (n,), L, m
    rails: FloatArray  # (n,), allowed way of the sliders, m
    radii: FloatArray  # (n,), r, m

    @classmethod
    def empty(cls, n: int) -> SetOut:
        """Return room for n designs."""
        shapes = (n, BOX), (n, LIMBS * PER_LIMB), (n,), (n,), (n,)
        return cls(*(np.empty(shape) for shape in shapes))


@kernel
def possible(n1: float, n2: float, n3: float, theta: float, lam0: float, n: float) -> float:
    """Return > 0 where the dimensions make no machine."""
    impossible = dimensions_violation((n1, n2, n3, theta), 1.0)
    impossible = max(impossible, dimensions_violation((n * n1, n * n2, n * n3), SMALLEST))
    if not (theta < 0.5 * math.pi and 0.0 < lam0 < 1.0):
        return 1.0
    return impossible


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
    """Fill what the kernels take of designs (n, 4) and their tasks: see ``SetOut``."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(DESIGN)[i, 0]
        n = task.n
        r, R, L = n * (3.0 - design.n2 - design.n3), n * design.n2, n * design.n3
        lay_out(layouts[i], r, R, design.theta, 0.0, 0.0, 0.0, 0.0)
        box = boxes[i]
        box[0], box[1] = 0.0, home_height(r, R, L, design.theta, design.lam0)
        box[2], box[3], box[4] = task.xy * n, task.xy * n, task.z * n
        box[5], box[6] = task.tilt, task.tilt
        lengths[i], radii[i], rails[i] = L, r, RAIL_SHARE * R / math.cos(design.theta)


@kernel
def composite(means: FloatArray) -> float:
    """Return F of the means (6,), with the weights that the paper prints, of raw indices."""
    return (
        WEIGHTS[0] * means[K_V] + WEIGHTS[1] * means[K_W] + WEIGHTS[2] * means[K_LAMBDA]
        + WEIGHTS[3] * means[K_ETA]
    )  # fmt: skip


@kernel
def unreached_by(reach: float, means: FloatArray) -> float:
    """Return > 0 where a pose is out of reach, and the means (6,) undefined with it."""
    unreached = 0.0
    if not reach > 0.0:
        unreached = UNREACHED - reach if reach <= 0.0 else 1.0
    elif not math.isfinite(means.sum()):
        unreached = UNREACHED
    if unreached > 0.0:
        means[:] = math.nan
    return unreached


@kernel
def measure_one(
    design: Design, task: Pss5UpuTask, means: FloatArray, found: FloatArray, rail: float
) -> tuple[Indices, Limits, float]:
    """Return one design's indices, own limit, and > 0 where its indices are undefined."""
    n1 = 3.0 - design.n2 - design.n3
    impossible = possible(n1, design.n2, design.n3, design.theta, design.lam0, task.n)
    if impossible > 0.0:
        return UNDEFINED, Limits(impossible), 0.0
    unreached = unreached_by(found[REACH], means)
    indices = Indices(
        K_v=means[K_V],
        K_w=means[K_W],
        K_lambda=means[K_LAMBDA],
        K_eta=means[K_ETA],
        F=composite(means),
        gti=means[GTI],
        gtw=means[GTW],
        transmission=found[COSINE],
        slider_low=found[LOW],
        slider_high=found[HIGH],
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
    rails: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill the rows of ``Indices`` and ``Limits`` and unreached (n,) of designs (n, 4)."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(DESIGN)[i, 0]
        indices, limits, unreached[i] = measure_one(design, task, means[i], found[i], rails[i])
        write(table[i], indices)
        write(own[i], limits)


class BoxProblem(DesignProblem):
    """What both problems share: means over a sample of a box, extremes at its nodes."""

    options: Pss5UpuOptions

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        self._unit = unit_poses(SAMPLINGS[self.options.sampling])
        self._nodes = nodes(LEVELS[self.options.nodes])
        self._upu = 1.0 if self.options.yaw == "upu" else 0.0

    @abstractmethod
    def _set_out(self, designs: FloatArray, tasks: FloatArray) -> SetOut:
        """Return what the kernels take of complete designs."""

    def _means(self, out: SetOut) -> FloatArray:
        """Return the means (n, 6) of K_v, K_w, K_lambda, K_eta, LTI, and the good share."""
        n, poses = len(out.boxes), len(self._unit)
        parts = SHARED_OUT if n < SHARED_OUT else 1
        sums = np.empty((n, parts, MEANS))
        fill_sums(
            POSE_WORK * n * poses, self._unit, out.boxes, out.layouts, out.lengths, self._upu,
            parts, sums,
        )  # fmt: skip
        return np.asarray(sums.sum(axis=1) / poses)

    def _ranges(self, out: SetOut, columns: int) -> FloatArray:
        """Return what is found at the nodes (n, columns), REACH to HIGH filled."""
        found = np.empty((len(out.boxes), columns))
        fill_ranges(
            DESIGN_WORK * len(found), self._nodes, out.boxes, out.layouts, out.lengths, self._upu,
            found,
        )  # fmt: skip
        return found

    def from_dimensions(
        self, dimensions: Mapping[str, float], task: Any
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Turn r, R, L (m) into shares and n, beside angles and lam0 as they are."""
        del task
        values = {k: x for k, x in dimensions.items() if k not in LENGTHS}
        given = {k: x for k, x in dimensions.items() if k in LENGTHS or k in ("n2", "n3")}
        if not (lengths := all_of(LENGTHS, given, "m")):
            return dict(dimensions), {}
        r, R, L = positive(lengths, "m")
        n = (r + R + L) / 3.0
        return {**values, "n2": R / n, "n3": L / n}, {"n": n}

    def sizes(self, design: FloatArray) -> dict[str, float]:
        """Return the shares of a complete design."""
        named = super().sizes(design)
        return {"n1": 3.0 - named["n2"] - named["n3"], "n2": named["n2"], "n3": named["n3"]}

    def explain_dimensions(self, design: FloatArray) -> str:
        """Say in words that a complete design makes no machine, and what is allowed."""
        shares, named = self.sizes(design), super().sizes(design)
        if dimensions_violation(tuple(shares.values()), 1.0) > 0.0:
            return super().explain_dimensions(design)
        return (
            f"dimensions: theta = {np.degrees(named['theta']):.4g} deg and lam0 = "
            f"{named['lam0']:.4g} make no machine: theta must lie between 0 and 90 deg, lam0 "
            "between 0 and 1"
        )

    def explain_own(self, design: FloatArray, task: Any, broken: list[str]) -> list[str]:
        """Say nothing: the dimensions are the only limit of its own."""
        del design, task, broken
        return []

    def index_maps(self, machine: Mechanism, pose: FloatArray) -> dict[str, IndexMap]:
        """Return the local indices at poses (..., 5) that this problem knows."""
        known = {index.name for index in self.declared.index_table}
        maps = super().index_maps(machine, pose)
        return {name: found for name, found in maps.items() if name in known}


class Pss5UpuProblem(BoxProblem):
    """Transmission of the 5-PSS/UPU over a box of poses, in the paper's five-fold layout.

    Maximise the mean of the least input and output transmission over the space model's n2 and n3
    (theta and lam0 if they are freed), so that every pose is reached with rods well off their rails
    and the sliders on them. The layout is singular at home, whatever the design.
    """

    declared = PSS5_UPU
    task: Pss5UpuTask

    def _set_out(self, designs: FloatArray, tasks: FloatArray) -> SetOut:
        out = SetOut.empty(len(designs))
        set_out(0.3 * len(designs), designs, tasks, *out)
        return out

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        out = self._set_out(designs, tasks)
        means, found = self._means(out), self._ranges(out, EXTREMES)
        measure(
            0.1 * len(designs), designs, tasks, means, found, out.rails, rows.table, rows.own,
            rows.unreached,
        )  # fmt: skip

    def _mechanism(self, design: FloatArray, task: Pss5UpuTask) -> Pss5Upu:
        n1, n2, n3 = (task.n * share for share in self.sizes(design).values())
        theta, lam0 = (float(x) for x in design[2:4])
        return Pss5Upu(
            r=n1, R=n2, L=n3, theta=theta, lam0=lam0, upu=self._upu,
            x=task.xy * task.n, y=task.xy * task.n, z=task.z * task.n,
            beta=task.tilt, gamma=task.tilt,
        )  # fmt: skip
