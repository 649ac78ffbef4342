"""What the paper's averages hide: a convention, a unit of length, workspaces that differ."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.core.solve import polish
from pkm_gym.mechanisms import make_problem
from pkm_gym.mechanisms.pus6.atlas import FIVE, RADII, columns_of
from pkm_gym.mechanisms.pus6.figures.common import (
    COLORS,
    NUMBER,
    WIDE,
    WITHIN,
    box,
    draw_grid_map,
    lattice,
    mark_best,
    optimum,
    square,
)
from pkm_gym.mechanisms.pus6.mechanism import NAMES
from pkm_gym.plots.pictures import Picture
from pkm_gym.plots.style import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

SHOWN = (0.01, 0.05, 0.1, 0.2)  # m, characteristic lengths of the maps
LENGTHS = (0.005, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.2, 0.5)  # m, of the ranks
CONVENTIONS = {"influence": "-", "symmetric": "--"}
ROW = 1  # of L = 46 cm


def convention(problem: DesignProblem) -> Figure:
    """Draw eta_alpha in both conventions, and its share of the gains of an objective with it."""
    figure = plots.new_figure(WIDE, 3.5)
    alpha = plots.symbol("eta_alpha")
    plots.headline(
        figure,
        f"{alpha} depends on a convention, and rules every objective that holds it",
        "influence: limb screws, $S_i × S_j$ for i < j only, with a skew part that does no work; "
        "symmetric: the Hessian of the motion; right: gain, and share of the sum of logarithms",
    )
    axes = plots.panel(figure, (0.05, 0.2, 0.27, 0.58), y=alpha, title="the ten designs of Table 2")
    _draw_table(axes, problem)
    axes = plots.panel(
        figure, (0.39, 0.2, 0.22, 0.58), x="R (cm)", y=alpha, title="over one box, L = 46 cm"
    )
    for name, dashes in CONVENTIONS.items():
        values = square(box(convention=name)[:, NAMES.index("eta_alpha")])[ROW]
        axes.plot(
            100.0 * RADII, values, linestyle=dashes, color=COLORS["eta_alpha"], linewidth=1.5,
            label=name,
        )  # fmt: skip
    axes.set(xlim=(10.0, 20.0), ylim=(0.0, None))
    _at_printed(axes)
    plots.legend(axes, loc="lower left")
    axes = plots.panel(
        figure, (0.69, 0.2, 0.3, 0.58), y="over that of the printed design",
        title="optima of balanced5, one box",
    )  # fmt: skip
    _draw_gains(axes)
    return figure


def units(problem: DesignProblem) -> Figure:
    """Draw eta_F for several units of length, and the rank of the printed design."""
    del problem
    figure = plots.new_figure(WIDE, 3.1)
    force, at = plots.symbol("eta_F"), NUMBER
    plots.headline(
        figure,
        f"The ranking by {force}, force and torque, flips with the unit of length",
        "angular rows are measured with a characteristic length: 1 cm gives the paper's numbers "
        "and its verdict on its own design; colours from the least to the largest of each map",
    )
    for k, length in enumerate(SHOWN):
        values = lattice(length)["eta_F"]
        axes = plots.panel(
            figure, (0.045 + 0.184 * k, 0.15, 0.145, 0.58), x="L (cm)",
            y="" if k else "R (cm)",
        )  # fmt: skip
        draw_grid_map(axes, square(values))
        mark_best(axes, square(values))
        axes.set_xticks(range(45, 56, 5))
        text = f"printed {values[at]:.4f}, largest {values.max():.4f}"
        axes.text(0.0, 1.015, text, transform=axes.transAxes, **words("small", color="faint"))
        axes.set_title(f"{100.0 * length:g} cm", **words("text", weight="bold"), loc="left", pad=14)
        if k == 0:
            plots.legend(axes, loc="center right")
    axes = plots.panel(
        figure, (0.82, 0.15, 0.17, 0.58), x="characteristic length (cm)",
        y="rank of the printed design",
    )  # fmt: skip
    ranks = [1 + int((lattice(x)["eta_F"] > lattice(x)["eta_F"][at]).sum()) for x in LENGTHS]
    axes.semilogx(
        100.0 * np.array(LENGTHS), ranks, marker="o", markersize=4, linewidth=1.4,
        color=plots.STYLE["lines"][0],
    )  # fmt: skip
    axes.set_ylim(121.0, 1.0)
    axes.set_yticks((1, 20, 40, 60, 80, 100, 121))
    axes.set_xticks((0.5, 1, 5, 10, 50), ("0.5", "1", "5", "10", "50"))
    axes.minorticks_off()
    axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
    return figure


def trend(problem: DesignProblem) -> Figure:
    """Draw indices over R, as averages over different workspaces and over one box."""
    del problem
    atlas, names = lattice(), ("eta_omega", "eta_alpha", "eta_v", "eta_I")
    figure = plots.new_figure(WIDE, 3.1)
    plots.headline(
        figure,
        "Averages over workspaces that differ reverse the trend in R (L = 46 cm)",
        "solid: over what each design reaches of the paper's lattice; dashed: over one box that "
        "all reach (±5 cm, ±10 deg); dotted: the printed R",
    )
    axes = plots.panel(
        figure,
        (0.045, 0.15, 0.15, 0.62),
        x="R (cm)",
        y="thousands of poses",
        title="what is counted",
    )
    counted, beyond = square(atlas.poses)[ROW], square(atlas.beyond)[ROW]
    x = 100.0 * RADII
    axes.plot(x, 1e-3 * counted, color=plots.STYLE["ink"], linewidth=1.6)
    axes.fill_between(
        x, 0.0, 1e-3 * counted * beyond, color=plots.STYLE["bad"], alpha=0.35, linewidth=0.0
    )
    axes.text(12.3, 7.2, "beyond the\nsingularity", **words("small", color="bad"))
    axes.set(xlim=(10.0, 20.0), ylim=(0.0, None), xticks=range(10, 21, 2))
    _at_printed(axes)
    for k, name in enumerate(names):
        axes = plots.panel(
            figure, (0.25 + 0.19 * k, 0.15, 0.145, 0.62), x="R (cm)", title=plots.symbol(name)
        )
        color, column = COLORS[name], NAMES.index(name)
        axes.plot(x, square(atlas[name])[ROW], color=color, linewidth=1.7, label="lattice")
        axes.plot(x, square(box()[:, column])[ROW], color=color, linewidth=1.7, linestyle="--",
                  label="one box")  # fmt: skip
        axes.set(xlim=(10.0, 20.0), xticks=range(10, 21, 2))
        axes.margins(y=0.12)
        _at_printed(axes)
        if k == 0:
            plots.legend(axes, loc="lower right")
    return figure


PICTURES = {
    "convention": Picture("angular acceleration in two conventions", convention),
    "units": Picture("force and torque in several units of length", units),
    "trend": Picture("trends over different workspaces and over one box", trend),
}


def _at_printed(axes: Axes) -> None:
    axes.axvline(19.0, color=plots.STYLE["faint"], linewidth=0.9, linestyle=":")


def _draw_table(axes: Axes, problem: DesignProblem) -> None:
    """Draw eta_alpha of Table 2 and in both conventions."""
    columns = problem.reference.table("table2.columns", list[str])
    rows = np.array(problem.reference.table("table2.rows", list[list[float]]))
    at = (11 * (rows[:, 0] - 45) + rows[:, 1] - 10).astype(int)
    printed, x = rows[:, columns.index("eta_alpha")], np.arange(len(rows))
    axes.plot(x, printed, linestyle="none", marker="_", markersize=13, color=plots.STYLE["ink"],
              markeredgewidth=2.0, label="printed", zorder=4)  # fmt: skip
    for (name, _), marker in zip(CONVENTIONS.items(), ("o", "s"), strict=True):
        values = lattice(convention=name)["eta_alpha"][at]
        worst = 100.0 * np.abs(values / printed - 1.0).max()
        axes.plot(
            x, values, linestyle="none", marker=marker, markersize=5, color=COLORS["eta_alpha"],
            markerfacecolor=COLORS["eta_alpha"] if marker == "o" else "white",
            label=f"{name}, within {worst:.1f} %",
        )  # fmt: skip
    axes.set_xticks(x, [f"({L:.0f}, {R:.0f})" for L, R in rows[:, :2]], rotation=60)
    axes.set_ylim(0.04, 0.19)
    plots.legend(axes, loc="upper left")


@cache
def _gains() -> dict[str, FloatArray]:
    """Return the five indices of the optima of balanced5 over those of the printed design."""
    gains = {}
    for title, name, within in (
        ("the grid's range", "pus6", True), ("our range", "pus6", False),
        ("angles free", "pus6_layout", False),
    ):  # fmt: skip
        bounds = WITHIN if within else {}
        problem = make_problem(name, objective="balanced5", bounds=bounds)
        best = polish(problem, optimum(name, within=within)[None], radius=1.0)[0]
        indices = problem.evaluate(best[None]).indices
        printed = box()[NUMBER, columns_of(FIVE)]
        gains[title] = np.array([indices[each][0] for each in FIVE]) / printed
    return gains


def _draw_gains(axes: Axes) -> None:
    """Draw what each index gains, and the share of eta_alpha in the logarithm of the product."""
    for k, (name, gains) in enumerate(_gains().items()):
        for j, (index, gain) in enumerate(zip(FIVE, gains, strict=True)):
            axes.bar(
                k + 0.16 * (j - 2), gain - 1.0, 0.14, bottom=1.0, color=COLORS[index],
                label=plots.symbol(index) if k == 0 else None,
            )  # fmt: skip
        alpha = FIVE.index("eta_alpha")
        share = np.log(gains[alpha]) / np.log(gains).sum()
        axes.text(
            k, gains[alpha] + 0.05, f"×{gains[alpha]:.2f}, {100.0 * share:.0f} %", ha="center",
            **words("small"),
        )  # fmt: skip
        axes.text(k, 0.79, name, ha="center", **words("small"))
    axes.axhline(1.0, color=plots.STYLE["ink"], linewidth=0.8)
    axes.set(xlim=(-0.5, 2.5), ylim=(0.9, 3.6), xticks=[])
    plots.legend(axes, loc="upper left", ncols=5, columnspacing=0.8, handlelength=1.0)
