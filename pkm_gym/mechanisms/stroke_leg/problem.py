"""The paper's design problem: dexterity of the leg over a rectangle of theta and varphi."""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from pkm_gym.core.compile import batch_kernel, kernel, own_row
from pkm_gym.core.dimensions import SMALLEST, dimensions_violation
from pkm_gym.core.merit import write
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Measured
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.stroke_leg.alike import middle_of_arc
from pkm_gym.mechanisms.stroke_leg.declared import (
    DESIGN,
    GRID_NODES,
    STROKE_LEG,
    TASK,
    UNDEFINED,
    Design,
    Indices,
    Limits,
    StrokeLegOptions,
    StrokeLegTask,
)
from pkm_gym.mechanisms.stroke_leg.indices import (
    condition_moments,
    crank_ranges,
    least_condition,
    reference_moments,
    sample_rule,
    smallest_gap,
    tolerance_weighted,
    worst_force,
)
from pkm_gym.mechanisms.stroke_leg.kinematics import (
    cylinder_range,
    dead_point_margins,
    frame_side,
)
from pkm_gym.mechanisms.stroke_leg.mechanism import angles_violation, explain_angles
from pkm_gym.mechanisms.stroke_leg.workspace import StrokeLeg

# A crank nearer than this to its dead line counts as across it, rad.
DEAD = 1e-9


@kernel
def measure_one(
    design: Design,
    task: StrokeLegTask,
    by_area: bool,
    refined: bool,
    mu: FloatArray,
    across: FloatArray,
    along: FloatArray,
    sample: FloatArray,
) -> tuple[Indices, Limits, float]:
    """Return one design's indices, own limits, and > 0 where a crank crosses its dead line."""
    impossible = dimensions_violation((design.l1, design.l3, design.l6, design.l5), SMALLEST)
    impossible = max(impossible, angles_violation(design.phi, design.th3, design.gamma))
    if impossible > 0.0:
        return UNDEFINED, Limits(impossible), 0.0
    ob, theta_b = frame_side(design.l3, design.l6, design.th3)
    links = (design.l1, ob, theta_b, design.l5, design.l6, design.phi, design.gamma)
    theta_min, theta_max, swing = task.theta_min, task.theta_max, task.swing
    low, high = theta_min - swing, theta_max + swing
    A_short, A_long, D_short, D_long = dead_point_margins(low, high, low, high, links)
    a_min, a_max, d_min, d_max = crank_ranges(theta_min, theta_max, swing, links)
    l2_min, l2_max = cylinder_range(design.l1, ob, a_min, a_max)
    l4_min, l4_max = cylinder_range(design.l5, design.l6, d_min, d_max)

    eta_P = sigma = eta_DL = lam = dexterity = force = math.nan
    margin = min(A_short, A_long, D_short, D_long)
    unreached = DEAD + max(0.0, -margin) if margin < DEAD else 0.0
    if unreached == 0.0:
        eta_P, sigma, eta_DL = condition_moments(
            theta_min, theta_max, swing, links, by_area, across, along, sample
        )
        if refined:
            eta_DL = least_condition(theta_min, theta_max, swing, links, along)
        lam = tolerance_weighted(eta_P, sigma / GRID_NODES, eta_DL, mu)
        mean, deviation = reference_moments(theta_min, theta_max, by_area)
        dexterity = 0.5 * (eta_P / mean + sigma / deviation)
        force = worst_force(theta_min, theta_max, swing, task.l, links)
    indices = Indices(
        eta_P=eta_P,
        sigma=sigma,
        eta_FC=sigma / GRID_NODES,
        eta_DL=eta_DL,
        lambda_paper=lam,
        dexterity=dexterity,
        force=force,
        stroke2=l2_max - l2_min,
        stroke4=l4_max - l4_min,
        gap=smallest_gap(theta_min, theta_max, swing, links),
        dead_A_short=A_short,
        dead_A_long=A_long,
        dead_D_short=D_short,
        dead_D_long=D_long,
        l2_min=l2_min,
        l2_max=l2_max,
        l4_min=l4_min,
        l4_max=l4_max,
        extension=max(l2_max / l2_min, l4_max / l4_min),
    )
    return indices, Limits(dimensions=impossible), unreached


@batch_kernel
def measure(
    designs: FloatArray,
    tasks: FloatArray,
    by_area: bool,
    refined: bool,
    mu: FloatArray,
    across: FloatArray,
    along: FloatArray,
    table: FloatArray,
    own: FloatArray,
    unreached: FloatArray,
) -> None:
    """Fill the rows of ``Indices`` and ``Limits`` and unreached (n,) of designs (n, 7)."""
    for i in numba.prange(designs.shape[0]):
        sample = np.empty((3, along.shape[0]))
        task = tasks.view(TASK)[own_row(i, tasks.shape[0]), 0]
        design = designs.view(DESIGN)[i, 0]
        indices, limits, unreached[i] = measure_one(
            design, task, by_area, refined, mu, across, along, sample
        )
        write(table[i], indices)
        write(own[i], limits)


class StrokeLegProblem(DesignProblem):
    """Dexterity of the leg over its rectangle of opening and swing.

    Minimise the mean and the scatter of the Jacobian's condition number over l1 = l5, l3, l6, phi
    and th3 (or the paper's lambda, the mean alone, or the cylinders' force), so that both cranks
    keep clear of their dead lines, both cylinders of one kind fit, and their axes stay apart.
    """

    declared = STROKE_LEG
    options: StrokeLegOptions

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        chosen = self.options
        self._rule = sample_rule(chosen.sampling, chosen.nodes, chosen.points)
        self._mu = np.array(chosen.mu)
        poses = len(self._rule[0]) * len(self._rule[1])
        self._work = 1.5 + 0.008 * poses  # microseconds a design

    def _measure(self, designs: FloatArray, tasks: FloatArray, rows: Measured) -> None:
        by_area, refined = self.options.measure == "area", self.options.sampling == "gauss"
        measure(
            len(designs) * self._work, designs, tasks, by_area, refined, self._mu, *self._rule,
            rows.table, rows.own, rows.unreached,
        )  # fmt: skip

    def _mechanism(self, design: FloatArray, task: StrokeLegTask) -> StrokeLeg:
        return StrokeLeg(
            **super().sizes(design),
            l=task.l,
            theta_min=task.theta_min,
            theta_max=task.theta_max,
            swing=task.swing,
        )

    def _grid(self) -> FloatArray:
        """Return the paper's ranges in steps of ours, gamma and l5 as usual: 184,275 designs."""
        axes = [
            np.arange(v.low, v.high + 0.5 * v.step, v.step) if v.searched else np.zeros(1)
            for v in self.all_variables
        ]
        full = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))
        searched = [k for k, v in enumerate(self.all_variables) if v.searched]
        rows = np.repeat(self.space.defaults()[None], len(full), axis=0)
        rows[:, searched] = full[:, searched]
        named = rows.view(DESIGN)[:, 0]
        named["l5"] = named["l1"]
        return rows

    def one_of_alike(self, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        """Return the middle of the arc of designs alike that each of designs (n, d) is on."""
        return middle_of_arc(self, designs, tasks)

    def sizes(self, design: FloatArray) -> dict[str, float]:
        """Return the lengths of a complete design."""
        named = super().sizes(design)
        return {name: named[name] for name in ("l1", "l3", "l6", "l5")}

    def explain_dimensions(self, design: FloatArray) -> str:
        """Say in words that a complete design makes no machine, and what is allowed."""
        if dimensions_violation(tuple(self.sizes(design).values()), SMALLEST) > 0.0:
            return super().explain_dimensions(design)
        return explain_angles(super().sizes(design))

    def explain_own(self, design: FloatArray, task: Any, broken: list[str]) -> list[str]:
        """Say nothing: the dimensions are the only limit of its own."""
        del design, task, broken
        return []
