"""Maps of the design space: an index over two names, the limits, the designs that matter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import TaskLike
from pkm_gym.core.types import FloatArray
from pkm_gym.plots.maps import colour_bar, hatch
from pkm_gym.plots.style import STYLE, label, legend, shown, symbol

MARKERS = {"paper": ("*", 11.0), "grid": ("D", 5.5), "polished": ("o", 7.0)}
LINE_STYLES = ("-", "--", ":")


@dataclass(frozen=True)
class Slice:
    """Designs on a grid over two names, all else held.

    Attributes:
        x: name of the horizontal axis, a variable or what ``from_dimensions`` takes.
        y: name of the vertical axis, likewise.
        x_values: array (columns,).
        y_values: array (rows,).
        evaluation: of the rows x columns designs, row by row.
    """

    x: str
    y: str
    x_values: FloatArray
    y_values: FloatArray
    evaluation: Evaluation

    @classmethod
    def of(
        cls,
        problem: DesignProblem,
        x: tuple[str, float, float],
        y: tuple[str, float, float],
        held: Mapping[str, float],
        *,
        task: TaskLike = None,
        columns: int = 161,
        rows: int = 161,
    ) -> Slice:
        """Evaluate a grid over ``x`` and ``y``, each (name, low, high), at the ``held`` values.

        Raises:
            ValueError: for names that together make no design.
        """
        chosen = problem.unpack(problem.pack(task))
        x_values, y_values = np.linspace(*x[1:], columns), np.linspace(*y[1:], rows)
        designs = [
            problem.design(problem.from_dimensions({**held, x[0]: u, y[0]: v}, chosen)[0])
            for v in y_values.tolist()
            for u in x_values.tolist()
        ]
        return cls(x[0], y[0], x_values, y_values, problem.evaluate(np.array(designs), chosen))

    def index(self, name: str) -> FloatArray:
        """Return an index over the grid (rows, columns), NaN where it is undefined."""
        return self._grid(self.evaluation.indices[name])

    def violation(self) -> FloatArray:
        """Return the worst constraint over the grid (rows, columns), feasible where <= 0."""
        return self._grid(self.evaluation.constraints.max(axis=1))

    def unit(self, name: str) -> str:
        """Return the unit of an index."""
        return next(i.unit for i in self.evaluation.problem.index_table if i.name == name)

    def _grid(self, values: FloatArray) -> FloatArray:
        return values.reshape(len(self.y_values), len(self.x_values))


def draw_slice(
    axes: Axes, cut: Slice, index: str, *, levels: Sequence[float], bar: bool = True
) -> ContourSet:
    """Draw an index over the slice in bands at ``levels`` (shown unit), grey where undefined."""
    values, _ = shown(cut.index(index), cut.unit(index))
    axes.set_facecolor(STYLE["undefined"])
    bands = axes.contourf(
        cut.x_values, cut.y_values, values, levels=levels, cmap=STYLE["map"], extend="both"
    )
    bands.set_rasterized(True)  # a vector format would show seams between the bands
    axes.contour(
        cut.x_values, cut.y_values, values, levels=levels, colors="white", linewidths=0.3, alpha=0.6
    )
    if bar:
        colour_bar(axes, bands, label(index, cut.unit(index)))
    return bands


def draw_infeasible(axes: Axes, cut: Slice) -> None:
    """Veil and hatch what breaks a limit."""
    place = cut.x_values, cut.y_values, cut.violation()
    axes.contourf(*place, levels=[0.0, np.inf], colors="white", alpha=0.5)
    hatch(axes, *place, 0.0, "ink", "////")


def draw_bounds(axes: Axes, cut: Slice, index: str, bounds: Sequence[float]) -> None:
    """Draw the lines on which an index has the given values (shown unit), with a legend."""
    values, _ = shown(cut.index(index), cut.unit(index))
    for bound, dashes in zip(bounds, cycle(LINE_STYLES)):
        style = {"linestyles": [dashes], "linewidths": 1.5, "colors": STYLE["bad"]}
        axes.contour(cut.x_values, cut.y_values, values, levels=[bound], **style)
        axes.plot([], [], linestyle=dashes, color=STYLE["bad"], label=f"{bound:g}")
    legend(axes, loc="lower right", title=symbol(index))


def draw_valley(axes: Axes, cut: Slice, index: str) -> None:
    """Draw where the index is least along each vertical line of the slice."""
    values = np.where(np.isnan(cut.index(index)), np.inf, cut.index(index))
    inside = np.isfinite(values).any(axis=0)
    least = cut.y_values[values.argmin(axis=0)]
    axes.plot(cut.x_values[inside], least[inside], color="white", linewidth=1.2, linestyle="--")


def mark(axes: Axes, points: Mapping[str, tuple[float, float]], **options: Any) -> None:
    """Mark designs and name them in a legend; "paper", "grid" or "polished" may begin a name."""
    for k, (name, (x, y)) in enumerate(points.items()):
        marker, size = MARKERS.get(name.partition(" ")[0], ("s", 6.0))
        axes.plot(
            x, y, linestyle="none", marker=marker, markersize=size, label=name, zorder=7,
            color=STYLE["lines"][k % len(STYLE["lines"])], markeredgecolor="white",
            markeredgewidth=0.9,
        )  # fmt: skip
    legend(axes, **options)
