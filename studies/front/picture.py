"""A picture of a front: each pair of objectives, the designs beside it, the reference point."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pkm_gym.core.types import FloatArray
from pkm_gym.plots import STYLE, headline, label, legend, new_figure, panel, shown
from pkm_gym.studies.front.front import Front, signs_of
from pkm_gym.studies.front.report import Marked

SIDE, LEFT, BELOW, ABOVE, APART = 3.4, 0.75, 0.55, 0.65, 0.75  # inches
KEY = 2.1  # of the legend's width
MOST = 3  # panels side by side
MARKERS = {"paper": ("*", 12.0), "optimum": ("D", 6.5), "preferred": ("s", 6.5)}


def front_figure(front: Front, marks: list[Marked]) -> Figure:
    """Draw the front over each pair of objectives, with the designs beside it."""
    problem = front.problem
    pairs = list(combinations(range(len(problem.objectives)), 2))
    columns = min(MOST, len(pairs))
    rows = -(-len(pairs) // columns)
    wide = LEFT + columns * SIDE + (columns - 1) * APART + KEY
    tall = ABOVE + rows * SIDE + (rows - 1) * APART + BELOW
    figure = new_figure(wide, tall)
    names = ", ".join(f"{o.name} ({o.direction})" for o in problem.objectives)
    share = f", {front.share:.3f} of the box up to the optima" if np.isfinite(front.share) else ""
    note = f"{len(front.found)} designs, hypervolume {front.hypervolume:.4g}{share}"
    headline(figure, f"{problem.name}: the front of {names}", note)
    for k, (x, y) in enumerate(pairs):
        row, column = divmod(k, columns)
        left = LEFT + column * (SIDE + APART)
        low = BELOW + (rows - 1 - row) * (SIDE + APART)
        box = (left / wide, low / tall, SIDE / wide, SIDE / tall)
        first, second = problem.objectives[x], problem.objectives[y]
        axes = panel(
            figure, box, x=label(first.name, first.unit), y=label(second.name, second.unit)
        )
        _draw(axes, front, marks, (x, y))
        if k == columns - 1:
            legend(axes, loc="upper left", bbox_to_anchor=(1.02, 1.0), borderaxespad=0.0)
    return figure


def _draw(axes: Axes, front: Front, marks: list[Marked], pair: tuple[int, int]) -> None:
    """Draw one pair: what is feasible, the front, the designs beside it, the reference."""
    problem, at = front.problem, list(pair)

    def places(losses: FloatArray) -> FloatArray:
        values = (losses * signs_of(problem))[..., at]
        units = [problem.objectives[k].unit for k in at]
        return np.stack([shown(values[..., k], unit)[0] for k, unit in enumerate(units)])

    reference = np.array([front.reference[o.name] for o in problem.objectives])
    corner = places(reference * signs_of(problem))
    known = [places(mark.evaluation.objectives[0] * signs_of(problem)) for mark in marks]
    axes.plot(
        *places(front.feasible), ".", color=STYLE["faint"], markersize=3, alpha=0.4,
        label="feasible trials", zorder=1,
    )  # fmt: skip
    if len(problem.objectives) == 2:  # the front in the order of the first: what it dominates
        way = "steps-post" if problem.objectives[0].sign > 0.0 else "steps-pre"
        axes.plot(*places(front.losses), drawstyle=way, color=STYLE["lines"][0], linewidth=0.8)
    axes.plot(
        *places(front.losses), "o", color=STYLE["lines"][0], markersize=4.5,
        markeredgecolor="white", markeredgewidth=0.5, label="front", zorder=4,
    )  # fmt: skip
    axes.plot(
        *corner, "+", color=STYLE["ink"], markersize=9, label="reference point", zorder=3
    )  # fmt: skip
    for k, (mark, place) in enumerate(zip(marks, known, strict=True)):
        marker, size = MARKERS[mark.kind]
        colour = STYLE["lines"][k % (len(STYLE["lines"]) - 1) + 1]  # the first is the front's
        broken = "" if mark.evaluation.feasible[0] else ", infeasible"
        axes.plot(
            *place, marker, markersize=size, color=colour, markeredgecolor="white",
            markeredgewidth=0.8, label=f"{mark.name}{broken}", zorder=6,
        )  # fmt: skip
    _frame(
        axes, np.column_stack([places(front.losses), corner[:, None], *[p[:, None] for p in known]])
    )


def _frame(axes: Axes, points: FloatArray) -> None:
    """Show the front and what is marked; feasible trials far off stay outside."""
    finite = points[:, np.isfinite(points).all(axis=0)]
    low, high = finite.min(axis=1), finite.max(axis=1)
    room = 0.06 * np.where(high > low, high - low, np.maximum(abs(high), 1.0))
    axes.set_xlim(low[0] - room[0], high[0] + room[0])
    axes.set_ylim(low[1] - room[1], high[1] + room[1])
