"""The space model, Fig. 4, and the atlases over it, Figs 5 and 6, of our model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator

from pkm_gym import plots
from pkm_gym.mechanisms.pss5_upu.atlas import (
    CORNERS,
    NAMES,
    own_composites,
    space_grid,
    to_plane,
    to_shares,
)
from pkm_gym.mechanisms.pss5_upu.declared import LEAST_SHARE, WEIGHTS
from pkm_gym.mechanisms.pss5_upu.figures.common import (
    WIDE,
    WIDTH,
    X_LABEL,
    Y_LABEL,
    mark,
    matters,
    space,
)
from pkm_gym.plots.maps import colour_bar, hatch
from pkm_gym.plots.pictures import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]  # it has no types

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

MEANINGS = {
    "K_v": "linear velocity",
    "K_w": "angular velocity",
    "K_lambda": "input transmission",
    "K_eta": "output transmission",
}
NOTE = (
    "means over the default task's box; hatched: a limit of ours is broken; grey: r or L under "
    "0.1 n, or a pose of the box out of reach"
)


def model(problem: DesignProblem) -> Figure:
    """Draw the triangle of ratios in space and in its plane, with the designs of Table 5."""
    figure = plots.new_figure(WIDTH, 3.75)
    plots.headline(
        figure,
        "The space model and its plane, as in Fig. 4 of the paper",
        "$n_1 + n_2 + n_3 = 3$, $n_1 ≤ n_2$; dots: the sizes of Table 5; dark: what our problem "
        "searches",
    )
    _draw_in_space(figure.add_axes((0.0, 0.0, 0.47, 0.88), projection="3d"))
    axes = plots.panel(figure, (0.55, 0.12, 0.43, 0.74), x=X_LABEL, y=Y_LABEL)
    axes.add_patch(Polygon(CORNERS, facecolor=plots.STYLE["rod"], alpha=0.25, zorder=1))
    _outline(axes)
    axes.add_patch(
        Polygon(_searched(problem), facecolor=plots.STYLE["rod"], alpha=0.45, zorder=1.5)
    )
    for k, place in enumerate(CORNERS):
        text = ("$(\\sqrt{3}, 0)$", "$(2\\sqrt{3}, 0)$", "$(\\sqrt{3}, 3)$")[k]
        shift = ((-5, -3), (5, -3), (7, -2))[k]
        plots.remark(axes, text, place, xytext=shift, ha=("right", "left", "left")[k])
    for k, (r, R, L, _) in enumerate(problem.reference.data["table5"]["dimensions"]):
        n = (r + R + L) / 3.0
        X, Y = to_plane([R / n, L / n])
        shift = ((-4, -12), (-4, 5), (6, -3))[k]
        plots.remark(axes, f"row {k + 1}", (float(X), float(Y)), xytext=shift)
    axes.set(xlim=(1.2, 4.0), ylim=(-0.3, 3.2))
    axes.set_aspect("equal", adjustable="box")
    for text, place, turn in (
        ("r = R", (1.64, 1.9), 90.0), ("r = 0", (2.72, 1.55), -60.0), ("L = 0", (2.6, -0.14), 0.0)
    ):  # fmt: skip
        axes.text(*place, text, rotation=turn, ha="center", va="center",
                  fontsize=plots.STYLE["small"], color=plots.STYLE["faint"])  # fmt: skip
    return figure


def maps(problem: DesignProblem) -> Figure:
    """Draw the four indices over the space model."""
    figure = plots.new_figure(WIDTH, 7.0)
    plots.headline(
        figure, "The four atlases, as in Fig. 5 of the paper, our model and our workspace", NOTE
    )
    for k, name in enumerate(NAMES):
        row, column = divmod(k, 2)
        axes = plots.panel(
            figure, (0.075 + 0.49 * column, 0.535 - 0.465 * row, 0.335, 0.365),
            x=X_LABEL if row else "", y="" if column else Y_LABEL,
            title=f"({'abcd'[k]}) {MEANINGS[name]}",
        )  # fmt: skip
        _draw_map(axes, space().index(name), plots.symbol(name))
        mark(axes, matters(problem))
        if k == 0:
            plots.legend(axes, loc="upper right")
    return figure


def composites(problem: DesignProblem) -> Figure:
    """Draw F with the paper's weights, and with those of our own feasible designs."""
    feasible = own_composites(problem.evaluate(space_grid()))[0]
    values = np.stack([space().index(name) for name in NAMES], axis=-1)
    figure = plots.new_figure(WIDE, 4.3)
    plots.headline(
        figure, "The composite, as in Fig. 6 of the paper, our model and our workspace", NOTE
    )
    both = (
        (f"the paper's weights: {_sum(WEIGHTS, 'K')}", space().index("F")),
        (f"of our feasible designs: {_sum(feasible.weights, 'Z')}", feasible.scores(values)),
    )
    for k, (title, shown) in enumerate(both):
        axes = plots.panel(
            figure, (0.055 + 0.49 * k, 0.115, 0.37, 0.72), x=X_LABEL, y="" if k else Y_LABEL,
            title=title,
        )  # fmt: skip
        _draw_map(axes, shown, "F")
        mark(axes, matters(problem))
        if k == 0:
            plots.legend(axes, loc="upper right")
    return figure


PICTURES = {
    "fig4": Picture("the space model and its plane, as in Fig. 4", model),
    "fig5": Picture("four indices over the space model, as in Fig. 5", maps),
    "fig6": Picture("the composite over the space model, as in Fig. 6", composites),
}


def _sum(weights: Sequence[float] | FloatArray, letter: str) -> str:
    """Return a weighted sum of the indices in words."""
    terms = [f"{w:+.2f} ${letter}_{i}$" for i, w in enumerate(weights, 1)]
    return " ".join(terms).replace("-", "− ").replace("+", "+ ").removeprefix("+ ")


def _searched(problem: DesignProblem) -> FloatArray:
    """Return the outline (n, 2), X and Y, of the part of the triangle that is searched."""
    (n2_low, n3_low), (n2_high, n3_high) = problem.low, problem.high
    n2 = np.linspace(n2_low, n2_high, 91)
    top = np.minimum(n3_high, 3.0 - LEAST_SHARE - n2)
    bottom = np.maximum(n3_low, 3.0 - 2.0 * n2)  # n1 <= n2
    kept = bottom < top
    both = [np.stack([n2[kept], n3[kept]], axis=-1) for n3 in (top, bottom)]
    return to_plane(np.concatenate([both[0], both[1][::-1]]))


def _draw_in_space(axes: Axes3D) -> None:
    """Draw the plane of the ratios, and the triangle in it that r <= R leaves."""
    whole = np.array([(3.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 3.0), (3.0, 0.0, 0.0)])
    shares = to_shares(CORNERS)
    corners = np.column_stack([3.0 - shares.sum(axis=1), shares])
    axes.plot(*whole.T, color=plots.STYLE["faint"], linewidth=0.9)
    axes.plot_trisurf(*corners.T, color=plots.STYLE["rod"], alpha=0.45)
    axes.plot(*corners[[0, 1, 2, 0]].T, color=plots.STYLE["ink"], linewidth=1.3)
    axes.view_init(24.0, 32.0)
    axes.set(xlim=(0, 3), ylim=(0, 3), zlim=(0, 3))
    axes.set_box_aspect((1, 1, 1), zoom=0.86)
    axes.tick_params(labelsize=plots.STYLE["small"] - 1, pad=-2)
    axes.locator_params(nbins=4)
    small = {"fontsize": plots.STYLE["text"], "fontfamily": plots.STYLE["font"], "labelpad": -5}
    axes.set_xlabel("$n_1 = r/n$", **small)
    axes.set_ylabel("$n_2 = R/n$", **small)
    axes.set_zlabel("$n_3 = L/n$", **small)


def _draw_map(axes: Axes, values: FloatArray, bar: str) -> None:
    """Draw values (rows, columns) over X and Y in bands, what breaks a limit hatched."""
    place, broken = (space().X, space().Y), space().violation()
    levels = MaxNLocator(14).tick_values(np.nanmin(values), np.nanmax(values))
    axes.add_patch(Polygon(CORNERS, facecolor=plots.STYLE["undefined"], edgecolor="none"))
    bands = axes.contourf(*place, values, levels=levels, cmap=plots.STYLE["map"])
    bands.set_rasterized(True)  # a vector format would show seams between the bands
    axes.contour(*place, values, levels=levels, colors="white", linewidths=0.3, alpha=0.6)
    colour_bar(axes, bands, bar)
    axes.contourf(*place, broken, levels=[0.0, np.inf], colors="white", alpha=0.45)
    hatch(axes, *place, broken, 0.0, "ink", "////")
    _outline(axes)
    axes.set(xlim=(1.68, 3.52), ylim=(-0.06, 3.06))


def _outline(axes: Axes) -> None:
    """Outline the triangle."""
    ring = np.array([*CORNERS, CORNERS[0]]).T
    axes.plot(*ring, color=plots.STYLE["ink"], linewidth=1.1, zorder=4)
