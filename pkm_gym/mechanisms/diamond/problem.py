"""The Diamond's design problem: variables, task, indices, constraints, the paper's grid."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.indices import angle_of_sine
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
from pkm_gym.core.sampling import unit_nodes
from pkm_gym.core.task import Task, Variable, quantity
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.diamond.dynamics import (
    INERTIA_NAMES,
    cycle_indices,
    lumped_inertia,
)
from pkm_gym.mechanisms.diamond.indices import workspace_indices
from pkm_gym.mechanisms.diamond.kinematics import (
    REACH_MARGIN,
    arm_angle_range,
    reach_margins,
    smallest_sine_beta,
)
from pkm_gym.mechanisms.diamond.limits import explain
from pkm_gym.mechanisms.diamond.mechanism import Diamond

REFERENCE = Reference.load("pkm_gym.mechanisms.diamond")

# A ratio outside this range makes no machine.
SMALLEST_RATIO, LARGEST_RATIO = 1e-3, 1e3

# The unreached measure of a design that makes no machine: its log merit is the worst, 7.
NO_MACHINE = 1e30


@dataclass(frozen=True)
class DiamondTask(Task):
    """What the Diamond must do; the defaults are the paper's task."""

    b: float = quantity(0.8, "m", "width of the workspace", legal=(0.1, 2.0), family=(0.4, 1.2))
    h_ratio: float = quantity(
        0.15, "", "height over width of the workspace", legal=(0.1, 0.4), family=(0.15, 0.2)
    )
    delta: float = quantity(1.0, "", "b / (2 (e + l1))", legal=(0.5, 2.0))
    payload: float = quantity(0.0, "kg", "carried mass", legal=(0.0, 10.0), family=(0.0, 2.0))
    sigma_low: float = quantity(
        0.6, "", "lower bound of sigma_min", legal=(0.2, 1.2), family=(0.6, 0.81), limit="lower"
    )
    sigma_high: float = quantity(
        1.5, "", "upper bound of sigma_max", legal=(1.2, 3.0), family=(1.35, 1.9), limit="upper"
    )
    lam_e_min: float = quantity(0.2, "", "smallest e/l1", legal=(0.0, 1.0), limit="lower")
    alpha_low: float = quantity(
        0.0,
        "rad",
        "smallest transmission angle between the rods, 0 = off",
        legal=(0.0, 1.5),
        family=(0.0, 1.15),
        limit="lower",
    )
    beta_low: float = quantity(
        0.0,
        "rad",
        "smallest transmission angle at the elbows, 0 = off",
        legal=(0.0, 1.5),
        family=(0.0, 0.85),
        limit="lower",
    )
    cycle_width_ratio: float = quantity(
        1.0, "", "width of the pick-and-place cycle over b", legal=(0.05, 1.0)
    )
    cycle_lift_ratio: float = quantity(
        25 / 305, "", "lift of the cycle over its width", legal=(0.005, 0.1)
    )
    cycle_time_ratio: float = quantity(
        1.0, "", "cycle time over 0.30 s sqrt(b / 0.8 m)", legal=(0.5, 10.0)
    )
    overlap: float = quantity(0.5, "", "overlap of lift and traverse", legal=(0.0, 0.95))


@dataclass(frozen=True)
class DiamondOptions(Options):
    """Options of the Diamond.

    Attributes:
        inertia: preset of paper.toml, "printed" or "uniform-arm".
        sampling: (columns, rows) on the right half of the workspace.
        cycle: report the cycle's indices; the objectives tau_peak and tau_rms imply it.
        cycle_samples: instants of the pick-and-place cycle.
    """

    inertia: str = "printed"
    sampling: tuple[int, int] = (32, 9)
    cycle: bool = False
    cycle_samples: int = 801

    def __post_init__(self) -> None:
        """Refuse illegal options."""
        check_known("inertia preset", [self.inertia], REFERENCE.data["inertia"])
        sizes = tuple(self.sampling)
        if len(sizes) != 2 or not all(isinstance(n, int) and 2 <= n <= 10_000 for n in sizes):
            raise ValueError(
                f"sampling is {self.sampling!r}: it must be (columns, rows), each from 2 to 10000"
            )
        object.__setattr__(self, "sampling", sizes)
        if not (isinstance(self.cycle_samples, int) and 11 <= self.cycle_samples <= 100_000):
            raise ValueError(
                f"cycle_samples is {self.cycle_samples!r}: it must be from 11 to 100000"
            )


INDICES = (
    Index("tau_G", "N m/(m/s^2)", "largest drive torque per unit of platform acceleration"),
    Index("sigma_max", "", "largest singular value of l1 J"),
    Index("sigma_min", "", "smallest singular value of l1 J"),
    Index("condition", "", "worst condition number of J"),
    Index("alpha_min", "rad", "smallest transmission angle between the rods"),
    Index("beta_min", "rad", "smallest transmission angle at the elbows"),
    Index("arm_angle_min", "rad", "smallest arm angle of limb 1"),
    Index("arm_angle_max", "rad", "largest arm angle of limb 1"),
)
CYCLE_INDICES = (
    Index("tau_peak", "N m", "peak drive torque over the cycle"),
    Index("tau_rms", "N m", "rms torque of the worse drive over the cycle"),
    Index("power_peak", "W", "peak power of a drive over the cycle"),
    Index("speed_peak", "rad/s", "peak arm rate over the cycle"),
)
OBJECTIVE_CODES = {"tau_G": 0, "tau_peak": 1, "tau_rms": 2, "condition": 3}


@kernel
def dimensions_from_ratios(
    lam_e: float, lam_l: float, gap: float, b: float, delta: float
) -> tuple[float, float, float, float]:
    """Return e, l1, l2, H in metres: l1 = b / (2 delta (1 + lam_e)), lam_H = lam_l - 1 + gap."""
    l1 = b / (2.0 * delta * (1.0 + lam_e))
    return lam_e * l1, l1, lam_l * l1, (lam_l - 1.0 + gap) * l1


@kernel
def dimensions_violation(lam_e: float, lam_l: float, gap: float) -> float:
    """Return > 0 where the ratios make no machine: from 1e-3, beyond any tolerance, to 1."""
    lam_H = lam_l - 1.0 + gap
    smallest = min(lam_e, lam_l, lam_H)
    largest = max(lam_e, lam_l, lam_H)
    if not (math.isfinite(lam_e) and math.isfinite(lam_l) and math.isfinite(gap)):
        return 1.0
    excess = max(SMALLEST_RATIO - smallest, largest / LARGEST_RATIO - 1.0)
    return excess if excess <= 0.0 else min(1.0, excess + SMALLEST_RATIO)


@kernel
def task_scale(task: FloatArray, inertia: FloatArray, objective: int) -> float:
    """Return the first objective's estimate at the task's optimum, up to a constant factor.

    Eq. (12) at fixed ratios and transmission angles, those of the paper's task's optimum; for the
    cycle times its acceleration, width / time^2; the condition number depends on no scale.
    """
    if objective == 3:
        return 1.0
    b, delta, payload = task[0], task[2], task[3]
    _, l1, l2, _ = dimensions_from_ratios(0.58, 2.3, 0.4, b, delta)
    I_A, m, _ = lumped_inertia(l1, l2, payload, inertia)
    eta = m * l1 * l1 / I_A
    tau_G = I_A / l1 * math.sqrt(0.9 * eta * eta + 2.0 * eta + 1.6)
    if objective == 0:
        return tau_G
    width, _, time, _ = cycle_path(task)
    return tau_G * width / time**2


@kernel
def cycle_path(task: FloatArray) -> tuple[float, float, float, float]:
    """Return width (m), lift (m), time (s) and overlap of the task's pick-and-place cycle."""
    b, width_ratio, lift_ratio, time_ratio, overlap = task[0], task[9], task[10], task[11], task[12]
    width = width_ratio * b
    return width, lift_ratio * width, time_ratio * 0.30 * math.sqrt(b / 0.8), overlap


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    inertia: FloatArray,
    x_nodes: FloatArray,
    y_nodes: FloatArray,
    cycle_samples: int,
    objective: int,
    table: FloatArray,
    violations: FloatArray,
    unreached: FloatArray,
    scales: FloatArray,
) -> None:
    """Fill indices (n, 8 or 12), violations (n, 9), unreached and scales (n,) of designs (n, 3)."""
    for i in numba.prange(designs.shape[0]):
        task = tasks[own_row(i, tasks.shape[0])]
        scales[i] = task_scale(task, inertia, objective)
        scratch = np.empty((4, x_nodes.shape[0]))
        unreached[i] = measure_one(
            designs[i], task, inertia, x_nodes, y_nodes, cycle_samples, scratch, table[i],
            violations[i],
        )  # fmt: skip


@kernel
def measure_one(
    design: FloatArray,
    task: FloatArray,
    inertia: FloatArray,
    x_nodes: FloatArray,
    y_nodes: FloatArray,
    cycle_samples: int,
    scratch: FloatArray,
    table: FloatArray,
    violations: FloatArray,
) -> float:
    """Fill one design's row of indices and violations; return > 0 where they are undefined."""
    b, h, delta, payload = task[0], task[0] * task[1], task[2], task[3]
    sigma_low, sigma_high, lam_e_min, alpha_low, beta_low = task[4:9]
    lam_e, lam_l, gap = design
    table[:] = math.nan

    violations[0] = dimensions_violation(lam_e, lam_l, gap)
    if violations[0] > 0.0:
        violations[1:] = 1.0 + violations[0]
        return NO_MACHINE
    e, l1, l2, H = dimensions_from_ratios(lam_e, lam_l, gap, b, delta)
    inner, outer = reach_margins(e, l1, l2, H, b, h)
    violations[1], violations[2] = -inner, -outer
    violations[6] = lam_e_min - lam_e
    short = -min(inner, outer)
    if short > -REACH_MARGIN:
        unreached = max(0.0, short) + REACH_MARGIN
        violations[3:6] = 1.0 + unreached
        violations[7:9] = 1.0 + unreached
        return unreached

    I_A, m, mr_A = lumped_inertia(l1, l2, payload, inertia)
    eta = m * l1 * l1 / I_A
    sigma_max, sigma_min, condition, sin_alpha, torque = workspace_indices(
        e, l1, l2, H, b, h, eta, x_nodes, y_nodes, scratch
    )
    table[0], table[1], table[2], table[3] = torque * I_A / l1, sigma_max, sigma_min, condition
    table[4] = angle_of_sine(sin_alpha)
    table[5] = angle_of_sine(smallest_sine_beta(e, l1, l2, H, b, h))
    table[6], table[7] = arm_angle_range(e, l1, l2, H, b, h)
    if cycle_samples > 0:
        width, lift, time, overlap = cycle_path(task)
        table[8], table[9], table[10], table[11] = cycle_indices(
            width, lift, time, overlap, -H - h, cycle_samples, e, l1, l2, I_A, m, mr_A
        )
    violations[3] = -sin_alpha
    violations[4], violations[5] = sigma_max - sigma_high, sigma_low - sigma_min
    violations[7], violations[8] = alpha_low - table[4], beta_low - table[5]
    return 0.0


class DiamondProblem(DesignProblem):
    """Dynamic dimensional synthesis of the Diamond (Zhang et al. 2010, section 2.3).

    Minimise tau_G over lam_e, lam_l and gap with l1 = b / (2 delta (1 + lam_e)), so that the
    workspace stays in reach, in the lower assembly mode, with sigma_low <= sigma <= sigma_high,
    lam_e >= lam_e_min and, where asked for, least transmission angles.
    """

    name = "diamond"
    title = "2-DOF translational pick-and-place robot"
    version = 1
    package = "pkm_gym.mechanisms.diamond"
    task_type = DiamondTask
    options_type = DiamondOptions
    all_variables = (
        Variable("lam_e", 0.2, 0.75, "", "e / l1"),
        Variable("lam_l", 1.2, 3.6, "", "l2 / l1"),
        Variable("gap", 0.1, 0.7, "", "lam_H - lam_l + 1, lam_H = H / l1"),
    )
    all_objectives = (
        Objective("tau_G", "minimise", "N m/(m/s^2)", worst=100.0),
        Objective("tau_peak", "minimise", "N m", worst=1e5),
        Objective("tau_rms", "minimise", "N m", worst=1e5),
        Objective("condition", "minimise", "", worst=20.0),
    )
    constraint_names = (
        "dimensions",
        "reach_inner",
        "reach_outer",
        "assembly",
        "sigma_max",
        "sigma_min",
        "spacing",
        "alpha",
        "beta",
    )
    dimension_names = ("e", "l1", "l2", "H", "lam_H")
    penalty_weight = 5.0
    options: DiamondOptions

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        columns, rows = self.options.sampling
        preset = REFERENCE.data["inertia"][self.options.inertia]
        self._inertia = np.array([preset[name] for name in INERTIA_NAMES])
        self._nodes = unit_nodes(columns), unit_nodes(rows)
        self._cycle_samples = self.options.cycle_samples if self.options.cycle else 0
        self._objective = OBJECTIVE_CODES[self.objectives[0].name]
        paper_scale = task_scale(DiamondTask().pack(), self._inertia, self._objective)
        optimum = REFERENCE.optima[self.objectives[0].name].value
        self._anchor = optimum / paper_scale
        self._work = 0.012 * columns * rows + 0.1 * self._cycle_samples  # microseconds a design

    def _chosen_indices(self) -> tuple[Index, ...]:
        if any(objective.name in ("tau_peak", "tau_rms") for objective in self.objectives):
            self.options = replace(self.options, cycle=True)
        return INDICES + (CYCLE_INDICES if self.options.cycle else ())

    def _measure(self, designs: FloatArray, tasks: FloatArray) -> Measurement:
        n = len(designs)
        table = np.empty((n, len(self.index_names)))
        violations = np.empty((n, len(self.constraint_names)))
        unreached, scales = np.empty(n), np.empty(n)
        measure(
            n * self._work, designs, tasks, self._inertia, *self._nodes, self._cycle_samples,
            self._objective, table, violations, unreached, scales,
        )  # fmt: skip
        scales *= self._anchor
        return Measurement(table, violations, unreached, scales)

    def _mechanism(self, design: FloatArray, task: DiamondTask) -> Diamond:
        lam_e, lam_l, gap = map(float, design)
        if dimensions_violation(lam_e, lam_l, gap) > 0.0:
            raise ValueError(
                f"lam_e = {lam_e:g}, lam_l = {lam_l:g}, lam_H = {lam_l - 1.0 + gap:g} make no "
                f"machine: each must lie between {SMALLEST_RATIO:g} and {LARGEST_RATIO:g}"
            )
        e, l1, l2, H = dimensions_from_ratios(lam_e, lam_l, gap, task.b, task.delta)
        I_A, m, mr_A = lumped_inertia(l1, l2, task.payload, self._inertia)
        return Diamond(
            e=e, l1=l1, l2=l2, H=H, b=task.b, h=task.h_ratio * task.b, I_A=I_A, m=m, mr_A=mr_A
        )

    def derived(self, design: FloatArray, task: TaskLike = None) -> dict[str, Dimension]:
        """Return lam_H, e, l1, l2, H and the lumped inertias of a design (d,)."""
        machine = self.mechanism(design, task)
        assert isinstance(machine, Diamond)
        lengths = {name: Dimension(getattr(machine, name), "m") for name in ("e", "l1", "l2", "H")}
        return {"lam_H": Dimension(machine.H / machine.l1, ""), **lengths}

    def from_dimensions(
        self, dimensions: Mapping[str, float], task: DiamondTask
    ) -> tuple[dict[str, float], dict[str, float]]:
        """Turn e, l1, l2, H (m), or lam_H beside the ratios, into ratios and delta."""
        values = dict(dimensions)
        lengths = {name: values.pop(name) for name in ("e", "l1", "l2", "H") if name in values}
        if lengths:
            missing = [name for name in ("e", "l1", "l2", "H") if name not in lengths]
            if missing or values:
                what = f"lacks {', '.join(missing)}" if missing else f"also has {', '.join(values)}"
                raise ValueError(f"a design in lengths needs just e, l1, l2 and H: it {what}")
            e, l1, l2, H = lengths.values()
            if not all(0.0 < length < math.inf for length in lengths.values()):
                raise ValueError(
                    f"e, l1, l2, H are {e:g}, {l1:g}, {l2:g}, {H:g} m: all must be finite and > 0"
                )
            ratios = {"lam_e": e / l1, "lam_l": l2 / l1, "gap": (H - l2) / l1 + 1.0}
            return ratios, {"delta": task.b / (2.0 * (e + l1))}
        if "lam_H" in values:
            if "gap" in values or "lam_l" not in values:
                raise ValueError("lam_H needs lam_l beside it, and no gap")
            values["gap"] = values.pop("lam_H") - values["lam_l"] + 1.0
        return values, {}

    def explain_limits(self, design: FloatArray, task: DiamondTask, broken: list[str]) -> list[str]:
        """Say in words, a line a broken limit, where in the workspace and by how much."""
        full = self._complete_one(design)
        if "dimensions" in broken:
            ratios = ", ".join(f"{x:g}" for x in full)
            allowed = f"between {SMALLEST_RATIO:g} and {LARGEST_RATIO:g}"
            return [
                f"dimensions: {ratios} make no machine; lam_e, lam_l and lam_H must lie {allowed}"
            ]
        return explain(self._mechanism(full, task), task, broken)

    def _grid(self) -> FloatArray:
        """Return lam_e as the paper scans it, lam_l and lam_H in steps of 0.02 over the box."""
        _, lam_l, gap = self.all_variables
        steps_l = np.arange(round((lam_l.high - lam_l.low) / 0.02) + 1)
        steps_g = np.arange(round((gap.high - gap.low) / 0.02) + 1)
        mesh = np.meshgrid(
            REFERENCE.data["scan"]["lam_e"],
            np.round(lam_l.low + 0.02 * steps_l, 10),
            np.round(gap.low + 0.02 * steps_g, 10),
            indexing="ij",
        )
        return np.stack([axis.ravel() for axis in mesh], axis=1)
