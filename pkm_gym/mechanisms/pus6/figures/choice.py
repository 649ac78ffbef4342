"""Which design the averages choose, and what a search finds on one box beyond the paper's grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Rectangle

from pkm_gym import plots
from pkm_gym.mechanisms.pus6.atlas import FIVE, columns_of, lattice_atlas
from pkm_gym.mechanisms.pus6.figures.common import (
    NUMBER,
    WIDE,
    draw_grid_map,
    lattice,
    mark,
    optimum,
    square,
)
from pkm_gym.mechanisms.pus6.mechanism import NAMES
from pkm_gym.plots.maps import colour_bar
from pkm_gym.plots.pictures import Picture
from pkm_gym.plots.style import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem

STEP = 0.005  # m, of the map beyond the paper's grid


def pareto(problem: DesignProblem) -> Figure:
    """Draw the least of the five normalised indices, the Pareto set, and what its designs trade."""
    del problem
    atlas, at = lattice(), NUMBER
    kept = atlas.pareto()
    figure = plots.new_figure(WIDE, 3.9)
    plots.headline(
        figure,
        "Which design the paper's averages choose: the max-min of five indices is (46, 19)",
        f"each index normalised, 0 to 1 over the 121 designs; force and torque aside; "
        f"{kept.sum()} designs are not dominated in these five, {atlas.pareto(NAMES).sum()} "
        "in all six",
    )
    axes = plots.panel(
        figure, (0.055, 0.115, 0.29, 0.7), x="L (cm)", y="R (cm)",
        title="least of the five normalised indices",
    )  # fmt: skip
    draw_grid_map(axes, square(atlas.balanced), bar="")
    L, R = 100.0 * atlas.designs[kept, :2].T
    axes.plot(
        L, R, linestyle="none", marker="o", markersize=9, markerfacecolor="none", clip_on=False,
        markeredgecolor=plots.STYLE["ink"], markeredgewidth=1.1, zorder=6, label="not dominated",
    )  # fmt: skip
    mark(axes, {"printed": (46.0, 19.0)})
    axes.set(xlim=(44.6, 55.0), ylim=(10.0, 20.4))
    plots.legend(axes, loc="lower left")
    beside = plots.panel(
        figure, (0.5, 0.115, 0.345, 0.7), y="normalised index", title="what they trade"
    )
    shares = atlas.normalised[:, columns_of((*FIVE, "eta_F"))]
    beside.plot(shares[~kept].T, color=plots.STYLE["grid"], linewidth=0.7, zorder=1)
    for k in np.flatnonzero(kept):
        if k != at:
            L, R = np.round(100.0 * atlas.designs[k, :2]).astype(int)
            beside.plot(shares[k], linewidth=1.1, label=f"({L}, {R})", zorder=3)
    beside.plot(
        shares[at], color=plots.STYLE["ink"], linewidth=2.4, marker="*", markersize=9,
        markerfacecolor="#d55e00", label="(46, 19)", zorder=5,
    )  # fmt: skip
    level = atlas.balanced[at]
    beside.axhline(level, color=plots.STYLE["bad"], linewidth=0.9, linestyle="--", zorder=2)
    beside.text(
        5.03, level, f"{level:.4f}", color=plots.STYLE["bad"], va="center",
        **{key: value for key, value in words("small").items() if key != "color"},
    )  # fmt: skip
    beside.axvspan(4.5, 5.0, color=plots.STYLE["grid"], alpha=0.5, linewidth=0.0, zorder=0)
    beside.set_xticks(range(6), [*map(plots.symbol, FIVE), f"{plots.symbol('eta_F')}\n(aside)"])
    beside.set(xlim=(0.0, 5.0), ylim=(-0.02, 1.02))
    plots.legend(beside, loc="center left", bbox_to_anchor=(1.09, 0.5), title="(L, R), cm")
    return figure


def search(problem: DesignProblem) -> Figure:
    """Draw both balances beyond the paper's grid, with the optima that a search finds."""
    low, high = problem.low, problem.high
    L, R = (np.arange(a, b + 1e-9, STEP) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(L, R), axis=-1).reshape(-1, 2)
    figure = plots.new_figure(WIDE, 3.9)
    plots.headline(
        figure,
        "What is found beyond the paper's grid",
        "dashed: the paper's grid; left, its own averages, over workspaces that change with the "
        "design; right, ours, over one box, hatched where a limit is broken",
    )
    axes = plots.panel(
        figure, (0.055, 0.115, 0.335, 0.7), x="L (cm)", y="R (cm)",
        title="least of the five, normalised by the grid",
    )  # fmt: skip
    found = lattice_atlas(problem.complete(grid), over=lattice())
    balanced = found.balanced.reshape(len(R), len(L))
    bands = axes.contourf(
        100.0 * L, 100.0 * R, balanced, levels=np.arange(-0.4, 1.01, 0.1),
        cmap=plots.STYLE["map"], extend="min",
    )  # fmt: skip
    bands.set_rasterized(True)  # a vector format would show seams between the bands
    colour_bar(axes, bands, "least of the five")
    best = 100.0 * grid[found.balanced.argmax()]
    largest = f"largest on 5 mm steps  {found.balanced.max():.3f}"
    mark(axes, {"printed": (46.0, 19.0), largest: tuple(best)})
    beside = plots.panel(
        figure, (0.555, 0.115, 0.335, 0.7), x="L (cm)", y="R (cm)", title="balanced, one box"
    )
    cut = plots.Slice("L", "R", 100.0 * L, 100.0 * R, problem.evaluate(grid))
    plots.draw_slice(beside, cut, "balanced", levels=np.arange(0.8, 1.101, 0.02).tolist())
    plots.draw_infeasible(beside, cut)
    points = {"printed": (46.0, 19.0)}
    for name, within in (("best in the grid's range", True), ("best in ours", False)):
        design = optimum(problem.name, within=within)
        value = problem.evaluate(design[None]).indices["balanced"][0]
        points[f"{name}  {value:.3f}"] = (100.0 * design[0], 100.0 * design[1])
    mark(beside, points)
    for each in (axes, beside):
        _frame(each)
        plots.legend(each, loc="lower right")
    return figure


PICTURES = {
    "pareto": Picture("the max-min design and the Pareto set of the averages", pareto),
    "search": Picture("what is found beyond the paper's grid", search),
}


def _frame(axes: Axes) -> None:
    """Outline the paper's grid."""
    axes.add_patch(
        Rectangle(
            (45.0, 10.0), 10.0, 10.0, fill=False, linestyle="--", edgecolor="white",
            linewidth=1.4, zorder=5,
        )
    )  # fmt: skip
    axes.set(xlim=(40.0, 55.0), ylim=(8.0, 22.0))
