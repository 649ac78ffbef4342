"""The picture of tolerances: the objective's spread, where it comes from, what limits break."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pkm_gym.plots import STYLE, headline, label, legend, new_figure, panel, shown, symbol
from pkm_gym.studies.buildable.tolerance import Tolerances

WIDTH, HEIGHT = 10.5, 3.8  # inches
BINS = 40
FEWEST = 4  # rows of bars that there is room for
PER_CENT = 100.0


def tolerance_figure(found: Tolerances) -> Figure:
    """Draw what errors of the dimensions make of a design's machines."""
    problem = found.nominal.problem
    first = problem.objectives[0]
    figure = new_figure(WIDTH, HEIGHT, dpi=150)
    title = f"{problem.name}: {found.machines:,} machines with errors"
    headline(figure, title, f"yield {PER_CENT * found.share:.1f} %: so many hold every limit")
    _spread(panel(figure, (0.05, 0.16, 0.36, 0.62), x=label(first.name, first.unit)), found)
    own = found.objective
    bars = {"alone": own.first, "with others": own.total}
    axes = panel(figure, (0.47, 0.16, 0.2, 0.62), x="share of the variance (%)")
    _bars(axes, list(found.sigma), bars, f"whose errors make {symbol(first.name)} vary")
    axes = panel(figure, (0.78, 0.16, 0.2, 0.62), x="machines that break it (%)")
    broken = sorted(found.broken, key=lambda name: found.broken[name])[::-1]
    _bars(axes, broken, {"": found.broken}, "limits")
    return figure


def _spread(axes: Axes, found: Tolerances) -> None:
    """Draw the objective of machines that hold every limit, and of those that don't."""
    unit = found.nominal.problem.objectives[0].unit
    values, _ = shown(found.values, unit)
    known = np.isfinite(values)
    edges = np.histogram_bin_edges(values[known], BINS).tolist()
    parts = [values[known & found.feasible], values[known & ~found.feasible]]
    axes.hist(
        parts, edges, stacked=True, color=[STYLE["good"], STYLE["bad"]],
        label=["hold every limit", "break one"],
    )  # fmt: skip
    nominal, _ = shown(found.objective.nominal, unit)
    line = {"color": STYLE["ink"], "linewidth": STYLE["line"]}
    axes.axvline(nominal, linestyle="--", label="without errors", **line)
    axes.set_ylabel("machines")
    axes.set_title("")
    legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)


def _bars(axes: Axes, names: Sequence[str], parts: dict[str, dict[str, float]], title: str) -> None:
    """Draw bars of shares, one row a name, the parts side by side."""
    axes.set_title(title, fontsize=STYLE["text"], color=STYLE["ink"], loc="left", pad=20)
    top, thick = max(len(names), FEWEST), 0.8 / len(parts)
    rows = top - 1 - np.arange(len(names))
    for i, ((part, shares), colour) in enumerate(zip(parts.items(), STYLE["lines"], strict=False)):
        widths = [PER_CENT * max(shares.get(name, 0.0), 0.0) for name in names]
        axes.barh(rows + 0.4 - thick * (i + 0.5), widths, thick, color=colour, label=part)
    axes.set_yticks(rows, [symbol(name) for name in names])
    axes.set_xlim(left=0.0)
    axes.set_ylim(-0.6, top - 0.4)
    if not names:
        axes.set_axis_off()
        axes.text(0.0, 0.5, "none", transform=axes.transAxes, fontsize=STYLE["text"])
    if len(parts) > 1:
        legend(axes, loc="lower left", bbox_to_anchor=(0.0, 0.98), ncols=2)
