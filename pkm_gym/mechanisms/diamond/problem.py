"""The Diamond's design problem: its kernels over a task, and what only it can say."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, formula, kernel, own_row
from pkm_gym.core.dimensions import all_of, dimensions_violation, positive
from pkm_gym.core.indices import angle_of_sine
from pkm_gym.core.merit import write
from pkm_gym.core.planar import out_of_reach, reach_margins, smallest_sine_beta
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reach import ReachLimits
from pkm_gym.core.reference import Reference
from pkm_gym.core.rows import Dimension, Measured
from pkm_gym.core.sampling import unit_nodes
from pkm_gym.core.task import Task
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.declared import (
    DESIGN,
    DIAMOND,
    TASK,
    UNDEFINED,
    Design,
    DiamondOptions,
    DiamondTask,
    Indices,
)
from pkm_gym.mechanisms.diamond.dynamics import INERTIA_NAMES, cycle_indices, lumped_inertia
from pkm_gym.mechanisms.diamond.extremes import LAYERS, Workspace, workspace_indices
from pkm_gym.mechanisms.diamond.kinematics import arm_angle_range
from pkm_gym.mechanisms.diamond.masses import PRINTED, chosen_inertia, numbers, presets
from pkm_gym.mechanisms.diamond.mechanism import Diamond

REFERENCE = Reference.load("pkm_gym.mechanisms.diamond")


@dataclass(frozen=True)
class Scan:
    """What the paper draws: ratios of its figures, and limits."""

    lam_e: list[float]
    fig4: list[float]
    fig5_6: float
    b_l: list[float]
    b_u: list[float]


SCAN = REFERENCE.table("scan", Scan)

TORQUES = {"tau_G": 0, "tau_peak": 1, "tau_rms": 2}  # objectives that go with the task's sizes
NO_TORQUE = 3
LENGTHS = ("e", "l1", "l2", "H")
AS_PRINTED = (
    "inertia=printed counts arms and rods as the paper's tables do, 1/12 of an arm and 2/3 of a "
    "rod; uniform ones are 1/3 and 1: inertia=static"
)


@kernel
def dimensions_from_ratios(
    lam_e: float, lam_l: float, gap: float, b: float, delta: float
) -> tuple[float, float, float, float]:
    """Return e, l1, l2, H in metres: l1 = b / (2 delta (1 + lam_e)), lam_H = lam_l - 1 + gap."""
    l1 = b / (2.0 * delta * (1.0 + lam_e))
    return lam_e * l1, l1, lam_l * l1, (lam_l - 1.0 + gap) * l1


@kernel
def task_scale(task: DiamondTask, inertia: FloatArray, objective: int) -> float:
    """Return the first objective's estimate at the task's optimum, up to a constant factor.

    Eq. (12) at fixed ratios and transmission angles, those of the paper's task's optimum; for the
    cycle times its acceleration, width / time^2; what is a pure number depends on no scale.
    """
    if objective == NO_TORQUE:
        return 1.0
    _, l1, l2, _ = dimensions_from_ratios(0.58, 2.3, 0.4, task.b, task.delta)
    I_A, m, _ = lumped_inertia(l1, l2, task.payload, inertia)
    eta = m * l1 * l1 / I_A
    tau_G = I_A / l1 * math.sqrt(0.9 * eta * eta + 2.0 * eta + 1.6)
    if objective == 0:
        return tau_G
    width, _, time, _ = cycle_path(task)
    return tau_G * width / time**2


@kernel
def cycle_path(task: DiamondTask) -> tuple[float, float, float, float]:
    """Return width (m), lift (m), time (s) and overlap of the task's pick-and-place cycle."""
    width, time = task.cycle_width_ratio * task.b, 0.30 * math.sqrt(task.b / 0.8)
    return width, task.cycle_lift_ratio * width, task.cycle_time_ratio * time, task.overlap


def packed_task(task: Task) -> Any:
    """Return a task as the record that kernels read."""
    return task.pack().view(TASK)[0]


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    inertia: FloatArray,
    u: FloatArray,
    v: FloatArray,
    cycle_samples: int,
    objective: int,
    anchor: float,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
    scales: FloatArray,
) -> None:
    """Fill the rows of ``Indices``, ``ReachLimits``, unreached and scales of designs (n, 3)."""
    for i in numba.prange(designs.shape[0]):
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(DESIGN)[i, 0]
        scales[i] = anchor * task_scale(task, inertia, objective)
        layers = np.empty((LAYERS, v.shape[0], u.shape[0]))
        indices, limits, unreached[i] = measure_one(
            design, task, inertia, u, v, cycle_samples, layers
        )
        write(table[i], indices)
        write(own[i], limits)


@formula
def measure_one(
    design: Design,
    task: DiamondTask,
    inertia: FloatArray,
    u: FloatArray,
    v: FloatArray,
    cycle_samples: int,
    layers: FloatArray,
) -> tuple[Indices, ReachLimits, float]:
    """Return one design's indices, own limits, and > 0 where it is out of reach."""
    lam_H = design.lam_l - 1.0 + design.gap
    impossible = dimensions_violation((design.lam_e, design.lam_l, lam_H), 1.0)
    if impossible > 0.0:
        return UNDEFINED, ReachLimits(impossible, math.nan, math.nan), 0.0
    b, h = task.b, task.b * task.h_ratio
    e, l1, l2, H = dimensions_from_ratios(design.lam_e, design.lam_l, design.gap, b, task.delta)
    inner, outer = reach_margins(e, l1, l2, H, b, h)
    limits = ReachLimits(dimensions=impossible, reach_inner=-inner, reach_outer=-outer)
    unreached = out_of_reach(inner, outer)
    if unreached > 0.0:
        return UNDEFINED, limits, unreached

    I_A, m, mr_A = lumped_inertia(l1, l2, task.payload, inertia)
    eta = m * l1 * l1 / I_A
    sigma_max, sigma_min, condition, sin_alpha, torque = workspace_indices(
        Workspace(e, l1, l2, H, b, h, eta), u, v, layers
    )
    lowest, highest = arm_angle_range(e, l1, l2, H, b, h)
    tau_peak = tau_rms = power_peak = speed_peak = math.nan
    if cycle_samples > 0:
        width, lift, time, overlap = cycle_path(task)
        tau_peak, tau_rms, power_peak, speed_peak = cycle_indices(
            width, lift, time, overlap, -H - h, cycle_samples, e, l1, l2, I_A, m, mr_A
        )
    indices = Indices(
        tau_G=torque * I_A / l1,
        sigma_max=sigma_max,
        sigma_min=sigma_min,
        condition=condition,
        alpha_min=angle_of_sine(sin_alpha),
        beta_min=angle_of_sine(smallest_sine_beta(e, l1, l2, H, b, h)),
        arm_angle_min=lowest,
        arm_angle_max=highest,
        tau_peak=tau_peak,
        tau_rms=tau_rms,
        power_peak=power_peak,
        speed_peak=speed_peak,
        sin_alpha=sin_alpha,
    )
    return indices, limits, 0.0


class DiamondProblem(DesignProblem):
    """Dynamic dimensional synthesis of the Diamond (Zhang et al. 2010, section 2.3).

    Minimise tau_G over lam_e, lam_l and gap with l1 = b / (2 delta (1 + lam_e)), so that the
    workspace stays in reach, in the lower assembly mode, with sigma_low <= sigma <= sigma_high,
    lam_e >= lam_e_min and, where asked for, least transmission angles.
    """

    declared = DIAMOND
    drive_option = "motor"
    options: DiamondOptions

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        columns, rows = self.options.sampling
        self.inertia = chosen_inertia(self.options)
        self._inertia = np.array(numbers(self.inertia, INERTIA_NAMES))
        if self.options.own_masses and self.options.inertia == PRINTED:
            self.notes = (*self.notes, AS_PRINTED)
        self._nodes = unit_nodes(columns), unit_nodes(rows)
        self._cycle_samples = self.options.cycle_samples if self.options.cycle else 0
        self._objective = TORQUES.get(self.objectives[0].name, NO_TORQUE)
        printed = np.array(numbers(presets()[PRINTED], INERTIA_NAMES))
        paper_scale = task_scale(packed_task(DiamondTask()), printed, self._objective)
        self._anchor = REFERENCE.optimum(self.objectives[0].name).value / paper_scale
        self._work = (
            2.0 + 0.012 * columns * rows + 0.1 * self._cycle_samples
        )  # microseconds a design

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        measure(
            len(designs) * self._work, designs, tasks, self._inertia, *self._nodes,
            self._cycle_samples, self._objective, self._anchor, *rows,
        )  # fmt: skip

    def _mechanism(self, design: FloatArray, task: DiamondTask) -> Diamond:
        lam_e, lam_l, gap = map(float, design)
        e, l1, l2, H = dimensions_from_ratios(lam_e, lam_l, gap, task.b, task.delta)
        I_A, m, mr_A = lumped_inertia(l1, l2, task.payload, self._inertia)
        own = self.inertia
        rod = own.m_rod + own.mu2 * l2
        return Diamond(
            e=e, l1=l1, l2=l2, H=H, b=task.b, h=task.h_ratio * task.b, I_A=I_A, m=m, mr_A=mr_A,
            rod=rod, rod_elbow=own.rod_elbow * rod, rod_platform=own.rod_platform * rod,
            drive_inertia=own.motor,
        )  # fmt: skip

    def cycle(self, task: DiamondTask) -> dict[str, Dimension]:
        """Return width, lift, time and overlap of the task's pick-and-place cycle."""
        units = {"cycle_width": "m", "cycle_lift": "m", "cycle_time": "s", "overlap": ""}
        path = cycle_path(packed_task(task))
        return {k: Dimension(x, unit) for (k, unit), x in zip(units.items(), path, strict=True)}

    def from_dimensions(
        self, dimensions: Mapping[str, float], task: DiamondTask
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Turn e, l1, l2, H (m), or lam_H beside the ratios, into ratios and delta."""
        if lengths := all_of(LENGTHS, dimensions, "m"):
            e, l1, l2, H = positive(lengths, "m")
            ratios = {"lam_e": e / l1, "lam_l": l2 / l1, "gap": (H - l2) / l1 + 1.0}
            return ratios, {"delta": task.b / (2.0 * (e + l1))}
        values = dict(dimensions)
        if "lam_H" in values:
            if "gap" in values or "lam_l" not in values:
                raise ValueError("lam_H needs lam_l beside it, and no gap")
            values["gap"] = values.pop("lam_H") - values["lam_l"] + 1.0
        return values, {}

    def explain_own(self, design: FloatArray, task: DiamondTask, broken: list[str]) -> list[str]:
        """Say in words what keeps the limbs from the workspace."""
        return self._mechanism(design, task).explain_reach(broken)

    def sizes(self, design: FloatArray) -> dict[str, float]:
        """Return lam_e, lam_l and lam_H of a complete design."""
        lam_e, lam_l, gap = map(float, design)
        return {"lam_e": lam_e, "lam_l": lam_l, "lam_H": lam_l - 1.0 + gap}

    def _grid(self) -> FloatArray:
        """Return lam_e as the paper scans it, lam_l and gap in steps of ours over the box."""
        own = [
            np.round(v.low + v.step * np.arange(round((v.high - v.low) / v.step) + 1), 10)
            for v in self.all_variables
            if not v.scanned
        ]
        mesh = np.meshgrid(SCAN.lam_e, *own, indexing="ij")
        return np.stack([axis.ravel() for axis in mesh], axis=1)
