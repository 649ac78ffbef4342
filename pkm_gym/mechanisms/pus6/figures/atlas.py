"""The paper's six maps, Figs 3-8, and its two tables, each beside what comes out."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.patches import Rectangle

from pkm_gym import plots
from pkm_gym.mechanisms.pus6.atlas import LENGTHS, RADII
from pkm_gym.mechanisms.pus6.claims import BEST, FIGURES, claims
from pkm_gym.mechanisms.pus6.figures.common import (
    TITLES,
    WIDE,
    WIDTH,
    draw_grid_map,
    lattice,
    lines_below,
    maps_of,
    mark_best,
    scale_grid,
    signed,
    square,
)
from pkm_gym.mechanisms.pus6.mechanism import NAMES
from pkm_gym.plots.pictures import Picture
from pkm_gym.plots.style import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]  # it has no types

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

AZIMUTH = -125.0  # deg, that a surface is seen from; eta_F falls where the others rise
DIVERGING = "RdBu_r"


def index_map(problem: DesignProblem, name: str) -> Figure:
    """Draw an index over the paper's grid: averages over its lattice, and over one box."""
    maps, number = maps_of(problem), FIGURES[name]
    said = [claim for claim in claims(maps) if claim.claim.startswith(f"Fig. {number}:")]
    tall = 3.45 + 0.33 * len(said)
    figure = plots.new_figure(WIDE, tall)
    plots.headline(
        figure,
        f"{plots.symbol(name)}, {TITLES[name]}, as in Fig. {number} of the paper, our model",
        "the paper's averages are over a workspace that changes with the design (its lattice, as "
        "reconstructed); dashed: where the paper sees the best",
    )
    low, high = 1.0 - 3.35 / tall, 2.85 / tall
    whole, same = maps.over_lattice(name), maps.over_box(name)
    surface = figure.add_axes((0.012, low, 0.3, high), projection="3d", computed_zorder=False)
    _draw_surface(surface, whole, name)
    for k, (values, title) in enumerate(
        ((whole, "over the paper's lattice"), (same, "over one box that all designs reach"))
    ):
        axes = plots.panel(
            figure, (0.36 + 0.325 * k, low + 0.36 / tall, 0.22, high - 0.58 / tall), x="L (cm)",
            y="R (cm)", title=title,
        )  # fmt: skip
        draw_grid_map(axes, values, bar="")
        _outline(axes, name)
        mark_best(axes, values)
        if k == 0:
            plots.legend(axes, loc="lower right")
    lines = []
    for claim in said:
        both = f"“{claim.claim.partition(': ')[2]}”  →  {claim.verdict}", f"      {claim.ours}"
        lines += [line.replace(name, plots.symbol(name)) for line in both]
    lines_below(figure, lines)
    return figure


def overview(problem: DesignProblem) -> Figure:
    """Draw all six indices over the paper's grid: averages over its lattice, and over one box."""
    maps = maps_of(problem)
    figure = plots.new_figure(WIDE, 7.2)
    plots.headline(
        figure,
        "The six indices over the paper's 121 designs, as in Figs 3 to 8 of the paper, our model",
        "first and third column: averages over the paper's lattice, a workspace that changes with "
        "the design; others: over one box that all designs reach; star: printed; dot: largest",
    )
    for k, name in enumerate(NAMES):
        row, pair = divmod(k, 2)
        both = (f"{plots.symbol(name)}, {TITLES[name]}", maps.over_lattice(name)), (
            f"{plots.symbol(name)}, one box", maps.over_box(name)
        )  # fmt: skip
        for column, (title, values) in enumerate(both, 2 * pair):
            axes = plots.panel(
                figure, (0.045 + 0.243 * column, 0.685 - 0.308 * row, 0.165, 0.215),
                x="L (cm)" if row == 2 else "", y="" if column else "R (cm)", title=title,
            )  # fmt: skip
            draw_grid_map(axes, values, bar="")
            mark_best(axes, values)
    return figure


def counts(problem: DesignProblem) -> Figure:
    """Draw the counted poses of all designs, and how far they are from Table 1."""
    printed = np.array(problem.reference.table("table1.counts", list[list[float]]))
    ours = square(lattice().poses)
    off = 100.0 * (ours / printed - 1.0)
    figure = plots.new_figure(WIDTH, 3.7)
    plots.headline(
        figure,
        "Counted poses of the 121 designs, beside Table 1 of the paper",
        f"{ours.sum():,.0f} poses in all, printed {printed.sum():,.0f}; error rms "
        f"{np.sqrt((off**2).mean()):.2f} %, worst {signed(off.flat[np.abs(off).argmax()])} %; the "
        "lattice's ranges were identified from it",
    )
    axes = plots.panel(
        figure, (0.07, 0.115, 0.285, 0.69), x="L (cm)", y="R (cm)", title="poses, ours"
    )
    draw_grid_map(axes, 1e-3 * ours, bar="thousands of poses")
    axes = plots.panel(
        figure,
        (0.53, 0.115, 0.455, 0.69),
        x="L (cm)",
        y="R (cm)",
        title="ours over printed − 1, %",
    )
    _draw_cells(axes, off)
    return figure


def table(problem: DesignProblem) -> Figure:
    """Draw the errors of the six indices at the ten designs of Table 2."""
    maps = maps_of(problem)
    rows = maps.printed()
    ours = lattice().means[[int(11 * (L - 45) + R - 10) for L, R in rows]]
    printed = np.array([[row[name] for name in NAMES] for row in rows.values()])
    off = 100.0 * (ours / printed - 1.0)
    figure = plots.new_figure(WIDTH, 3.9)
    plots.headline(
        figure,
        "Indices of ten designs, beside Table 2 of the paper",
        f"ours over printed − 1 (above), ours (below); {plots.symbol('eta_alpha')} fits in the "
        "influence-coefficient convention only",
    )
    axes = plots.panel(figure, (0.1, 0.03, 0.885, 0.76))
    axes.imshow(off, cmap=DIVERGING, vmin=-5.0, vmax=5.0, aspect="auto")
    for (row, column), value in np.ndenumerate(off):
        middle: dict[str, Any] = {"ha": "center", "va": "center"}
        axes.text(column, row - 0.12, f"{signed(value)} %", **middle, **words("text"))
        axes.text(column, row + 0.27, f"{ours[row, column]:.5f}", **middle, **words("small"))
    names = [f"{plots.symbol(name)}, {TITLES[name]}" for name in NAMES]
    axes.set_xticks(range(6), [name.replace(", ", "\n") for name in names])
    axes.xaxis.tick_top()
    axes.set_yticks(range(len(rows)), [f"({L:g}, {R:g})" for L, R in rows])
    axes.tick_params(length=0)
    axes.text(-0.62, -0.72, "(L, R), cm", ha="right", **words("small"))
    return figure


PICTURES = {
    "atlas": Picture("the six maps over the paper's lattice and over one box", overview),
    **{
        f"fig{FIGURES[name]}": Picture(
            f"{TITLES[name]} over the paper's grid, as in Fig. {FIGURES[name]}",
            partial(index_map, name=name),
        )
        for name in NAMES
    },
    "table1": Picture("counted poses beside Table 1", counts),
    "table2": Picture("indices beside Table 2", table),
}


def _draw_surface(axes: Axes3D, values: FloatArray, name: str) -> None:
    """Draw values (11, 11) as the paper does."""
    L, R = np.meshgrid(100.0 * LENGTHS, 100.0 * RADII, indexing="ij")
    axes.plot_surface(
        L, R, values, cmap=plots.STYLE["map"], edgecolor=plots.STYLE["ink"], linewidth=0.2,
        rstride=1, cstride=1,
    )  # fmt: skip
    axes.view_init(28.0, AZIMUTH + 180.0 * (name == "eta_F"))
    axes.set_box_aspect((1.0, 1.0, 0.75), zoom=0.82)
    small = {"fontsize": plots.STYLE["small"], "fontfamily": plots.STYLE["font"]}
    axes.set_xlabel("L (cm)", labelpad=-3, **small)
    axes.set_ylabel("R (cm)", labelpad=-3, **small)
    axes.set_zlabel(plots.symbol(name), labelpad=-1, **small)
    axes.tick_params(labelsize=plots.STYLE["small"] - 1, pad=-1)
    axes.locator_params(nbins=5)


def _outline(axes: Axes, name: str) -> None:
    """Draw the region in which the paper sees the best, at least half a step wide."""
    (left, right), (bottom, top) = (
        (100.0 * low - 0.3 * (low == high), 100.0 * high + 0.3 * (low == high))
        for low, high in BEST[name]
    )
    axes.add_patch(
        Rectangle(
            (left, bottom), right - left, top - bottom, fill=False, linestyle="--",
            edgecolor=plots.STYLE["bad"], linewidth=1.5, zorder=5, clip_on=False,
        )
    )  # fmt: skip


def _draw_cells(axes: Axes, off: FloatArray) -> None:
    """Draw errors (11, 11), rows L, in percent, each in its cell."""
    axes.imshow(
        off.T, origin="lower", extent=(44.5, 55.5, 9.5, 20.5), cmap=DIVERGING, vmin=-2.5,
        vmax=2.5, aspect="auto",
    )  # fmt: skip
    for (row, column), value in np.ndenumerate(off):
        place = {"ha": "center", "va": "center", **words("small")}
        axes.text(45 + row, 10 + column, signed(value), **place)
    scale_grid(axes)
    axes.set(xlim=(44.5, 55.5), ylim=(9.5, 20.5))
