"""Indices of designs beside what the motors of their simulated machines do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure


INDICES = ("tau_G", "tau_peak")


@dataclass(frozen=True)
class Validation:
    """Indices of designs beside what the motors of their twins did.

    Attributes:
        predicted: name of an index -> its values (n,).
        units: name of an index -> its unit.
        peaks: array (n,), the largest motor torque, N m.
        errors: array (n,), the largest distance from the path, m.
    """

    predicted: dict[str, FloatArray]
    units: dict[str, str]
    peaks: FloatArray
    errors: FloatArray

    def rank(self, index: str) -> float:
        """Return Spearman's rank correlation of an index with the measured peaks."""
        from scipy.stats import spearmanr

        return float(spearmanr(self.predicted[index], self.peaks).statistic)

    def ratio(self, index: str) -> tuple[float, float, float]:
        """Return least, median and largest ratio of the measured peak to an index."""
        ratios = self.peaks / self.predicted[index]
        return float(ratios.min()), float(np.median(ratios)), float(ratios.max())


def validate(
    problem: DesignProblem, n: int, seed: int, progress: Callable[[], None] = lambda: None
) -> Validation:
    """Simulate n random feasible designs; ``progress`` is called after each."""
    from pkm_gym.twin.check import random_designs
    from pkm_gym.twin.drive import computed_torque

    designs = random_designs(problem, n, seed)
    indices = problem.evaluate(designs).indices
    peaks, errors = np.empty(n), np.empty(n)
    for k, design in enumerate(designs):
        drive = computed_torque(problem.mechanism(design))
        peaks[k], errors[k] = drive.peak, drive.errors.max()
        progress()
    units = {index.name: index.unit for index in problem.index_table}
    return Validation(
        {name: indices[name] for name in INDICES}, {i: units[i] for i in INDICES}, peaks, errors
    )


def scatter(measured: Validation) -> Figure:
    """Draw the measured peaks over each index."""
    from pkm_gym import plots

    figure = plots.new_figure(8.0, 3.6)
    plots.headline(
        figure,
        "Peak motor torque of the simulated machines, against two indices",
        f"{len(measured.peaks)} random feasible designs, our pick-and-place cycle, "
        "computed torque, uniform rods",
    )
    for k, name in enumerate(INDICES):
        axes = plots.panel(
            figure,
            (0.075 + 0.5 * k, 0.135, 0.40, 0.62),
            x=plots.label(name, measured.units[name]),
            y="measured peak (N·m)",
            title=f"rank correlation {measured.rank(name):.3f}",
        )
        axes.scatter(
            measured.predicted[name], measured.peaks, s=9, color=plots.STYLE["rod"], alpha=0.8
        )
        if measured.units[name] == "N m":
            axes.axline((measured.peaks.min(),) * 2, slope=1.0, color=plots.STYLE["faint"], lw=0.8)
    return figure
