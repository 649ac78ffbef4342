"""What the paper's statements are about: its Figs 4-7, computed with our model.

The maps of Figs 4-6 are over our window of (lam_l, lam_H) in our steps; *regular* designs are those
whose sigma_max is at most 2, the largest bound that the paper draws.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, solve_tasks
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.mechanisms import make_problem
from pkm_gym.mechanisms.diamond.declared import DiamondTask
from pkm_gym.mechanisms.diamond.problem import SCAN

WINDOW = (("lam_l", 1.2, 2.8), ("lam_H", 0.6, 2.4))  # of the maps of Figs 4-6, ours
STEP = 0.02  # of the maps, ours
VALLEY = (1.4, 2.6)  # lam_l between which lines are fitted to valleys, ours
REGULAR = 2.0
INTERVALS = tuple((round(0.4 + 0.1 * k, 1), round(1.3 + 0.1 * k, 1)) for k in range(6))


@dataclass(frozen=True)
class Map:
    """Indices over (lam_l, lam_H) at one lam_e: arrays (columns, rows), NaN out of reach."""

    lam_l: FloatArray
    lam_H: FloatArray  # noqa: N815 (symbol of the paper)
    tau_G: FloatArray
    sigma_max: FloatArray
    sigma_min: FloatArray

    @classmethod
    def of(cls, problem: DesignProblem, lam_e: float) -> Map:
        """Evaluate the window."""
        x, y = (np.round(np.arange(low, high + 0.5 * STEP, STEP), 10) for _, low, high in WINDOW)
        lam_l, lam_H = (axis.ravel() for axis in np.meshgrid(x, y, indexing="ij"))
        designs = np.stack([np.full_like(lam_l, lam_e), lam_l, lam_H - lam_l + 1.0], axis=1)
        found = problem.evaluate(designs).indices
        grid = (found[name].reshape(len(x), -1) for name in ("tau_G", "sigma_max", "sigma_min"))
        return cls(x, y, *grid)

    @property
    def regular(self) -> BoolArray:
        """Which designs are regular."""
        return self.sigma_max <= REGULAR

    def rising(self, name: str, axis: int) -> float:
        """Return which share of the steps between regular designs along an axis raises an index."""
        inside = self.regular if axis == 0 else self.regular.T
        steps = np.diff(getattr(self, name), axis=axis)
        steps = steps if axis == 0 else steps.T
        return float((steps[inside[1:] & inside[:-1]] > 0.0).mean())

    def valley(self, name: str) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return lam_l, lam_H and the least of an index over lam_H, (n,) each."""
        chosen = (self.lam_l >= VALLEY[0] - 1e-9) & (self.lam_l <= VALLEY[1] + 1e-9)
        values = np.nan_to_num(getattr(self, name), nan=np.inf)[chosen]
        return self.lam_l[chosen], self.lam_H[values.argmin(axis=1)], values.min(axis=1)

    def line(self, name: str) -> str:
        """Return the line through a valley in words, with its correlation."""
        lam_l, lam_H, _ = self.valley(name)
        slope, offset = np.polyfit(lam_l, lam_H, 1)
        r = np.corrcoef(lam_l, lam_H)[0, 1]
        return f"lam_H = {slope:.3f} lam_l - {-offset:.3f} (r = {r:.3f})"

    def ranges(self, kept: BoolArray) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the ranges of lam_l and lam_H that some kept design has."""
        spans = (self.lam_l[kept.any(axis=1)], self.lam_H[kept.any(axis=0)])
        first, second = ((float(x.min()), float(x.max())) for x in spans)
        return first, second


class Findings:
    """What the statements are about, computed when asked for."""

    def __init__(self) -> None:
        self.problem = make_problem("diamond")

    @cached_property
    def maps(self) -> dict[float, Map]:
        """Figs 4-6: lam_e -> map."""
        return {lam_e: Map.of(self.problem, lam_e) for lam_e in SCAN.fig4}

    @property
    def last(self) -> Map:
        """The map of Figs 5 and 6."""
        return self.maps[SCAN.fig5_6]

    @cached_property
    def grid(self) -> FloatArray:
        """The designs (n, 3) of the grid with the paper's lam_e, its other steps ours."""
        designs = self.problem.grid()
        assert designs is not None
        return designs

    def solved(self, preset: str) -> dict[float, Solutions]:
        """Fig. 7: lam_e -> optima of the six intervals."""
        found = {}
        for lam_e in SCAN.lam_e:
            problem = make_problem("diamond", fixed={"lam_e": lam_e}, inertia=preset)
            rows = [problem.pack({"sigma_low": a, "sigma_high": b}) for a, b in INTERVALS]
            found[lam_e] = solve_tasks(problem, np.array(rows))
        return found

    @cached_property
    def printed(self) -> dict[float, Solutions]:
        """Fig. 7 with the inertia as printed."""
        return self.solved("printed")

    def feasible(self, low: float, high: float) -> FloatArray:
        """Return how many of the grid's designs are feasible in an interval, by lam_e (4,)."""
        task = DiamondTask(sigma_low=low, sigma_high=high)
        kept = self.problem.evaluate(self.grid, task).feasible
        lam_e = np.array(SCAN.lam_e)
        return np.asarray((kept & (self.grid[:, 0] == lam_e[:, None])).sum(axis=1))
