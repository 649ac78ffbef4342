"""Index maps over the workspace of a design."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet
from matplotlib.patches import Polygon
from matplotlib.ticker import MaxNLocator

from pkm_gym.core.mechanism import IndexMap, Mechanism
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import Task
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.plots.machine import label_axes, outline
from pkm_gym.plots.style import STYLE, label, shown, style_ticks, words

COLUMNS, ROWS = 161, 33  # of the samples
BANDS = 48  # of colour
FLAT = 1e-3  # relative range of values that are shown alike


@dataclass(frozen=True)
class WorkspaceMaps:
    """Local indices of one machine on a grid over its workspace.

    Attributes:
        machine: the machine.
        x: array (rows, columns), mm.
        y: array (rows, columns), mm.
        placed: array (rows, columns), False where x and y are made up: no pose is known there.
        indices: the local indices, arrays (rows, columns), NaN out of reach.
        violations: broken constraint -> array (rows, columns), > 0 where it is broken.
    """

    machine: Mechanism
    x: FloatArray
    y: FloatArray
    placed: BoolArray
    indices: Mapping[str, IndexMap]
    violations: Mapping[str, FloatArray]

    @classmethod
    def of(
        cls, problem: DesignProblem, machine: Mechanism, task: Task, broken: Container[str]
    ) -> WorkspaceMaps:
        """Measure a machine over its workspace; only ``broken`` constraints are looked up."""
        poses = machine.workspace_grid(COLUMNS, ROWS)
        local = problem.local_violations(machine, poses, task)
        places = 1e3 * machine.drawn(poses)
        placed = np.asarray(np.isfinite(places).all(axis=-1))
        places[~placed] = places[placed].mean(axis=0) if placed.any() else 0.0
        return cls(
            machine,
            places[..., 0],
            places[..., 1],
            placed,
            problem.drawn_maps(machine, poses),
            {name: values for name, values in local.items() if name in broken},
        )

    @property
    def out_of_reach(self) -> BoolArray:
        """Array (rows, columns): where nothing can be measured."""
        return np.isnan(next(iter(self.indices.values())).values)

    def chosen(self, index: str | None) -> IndexMap:
        """Return the map of a design's index, or the first where the index has none."""
        return self.indices.get(index or "", next(iter(self.indices.values())))


def draw_map(axes: Axes, maps: WorkspaceMaps, index: IndexMap, *, detail: bool = True) -> None:
    """Draw a local index over the workspace: colours, and hatched what breaks a limit.

    Args:
        axes: where to draw, in mm.
        maps: the machine's maps.
        index: one of them.
        detail: contour lines, marks of the worst poses and a colour bar beside the axes, too.
    """
    label_axes(axes, maps.machine)
    axes.add_patch(
        Polygon(outline(maps.machine), facecolor=STYLE["undefined"], edgecolor="none", zorder=1)
    )
    if (maps.out_of_reach & maps.placed).any():
        unknown = np.ma.masked_where(~maps.placed, maps.out_of_reach.astype(float))
        hatch(axes, maps.x, maps.y, unknown, 0.5, "faint")
    if maps.out_of_reach.all():
        return
    values, _ = shown(index.values, index.unit)
    low, high = colour_range(values)
    bands = axes.contourf(
        maps.x, maps.y, values, levels=np.linspace(low, high, BANDS + 1), cmap=STYLE["map"],
        extend="max" if np.nanmax(values) > high else "neither", zorder=1.5,
    )  # fmt: skip
    bands.set_rasterized(True)  # a vector format would show seams between the bands
    _draw_broken(axes, maps)
    if detail:
        axes.set_xlim(maps.x.min(), maps.x.max())
        axes.set_ylim(maps.y.min(), maps.y.max())
        _draw_contours(axes, maps, np.clip(values, low, high))
        _mark_extremes(axes, maps, index)
        colour_bar(axes, bands, label(index.name, index.unit))


def colour_range(values: FloatArray) -> tuple[float, float]:
    """Return the range of the colours: all values, or to three times the median where none is 0.

    Values that are all alike have one colour.
    """
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    median = float(np.nanmedian(values))
    if low > 1e-6 * median > 0.0:
        high = min(high, 3.0 * median)
    return low, max(high, low + FLAT * abs(low), low + 1e-6)


def hatch(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    z: FloatArray,
    at: float,
    color: str,
    pattern: str = "/////",
) -> None:
    """Hatch where ``z`` exceeds ``at``, with a thin outline."""
    area = axes.contourf(x, y, z, levels=[at, np.inf], colors="none", hatches=[pattern], zorder=2.2)
    area.set(edgecolor=STYLE[color], linewidth=0.0, hatch_linewidth=0.4)
    axes.contour(x, y, z, levels=[at], colors=STYLE[color], linewidths=1.0, zorder=2.3)


def colour_bar(axes: Axes, bands: ContourSet, text: str) -> None:
    """Put a slim colour bar to the right of the axes."""
    levels = np.asarray(bands.levels)
    low, high = float(levels[0]), float(levels[-1])
    ticks = [tick for tick in MaxNLocator(5).tick_values(low, high) if low <= tick <= high]
    bar_axes = axes.inset_axes((1.025, 0.0, 0.028, 1.0))
    bar = axes.figure.colorbar(bands, cax=bar_axes, ticks=ticks)
    assert bar.solids is not None
    bar.solids.set_rasterized(True)
    style_ticks(bar_axes)
    bar.outline.set(linewidth=STYLE["thin"], edgecolor=STYLE["faint"])
    bar.set_label(text, **words("text"), labelpad=4)


def _draw_broken(axes: Axes, maps: WorkspaceMaps) -> None:
    if not maps.violations:
        return
    worst = np.max(np.stack(list(maps.violations.values())), axis=0)
    worst = np.ma.masked_where(maps.out_of_reach, worst)
    if (worst > 0.0).any():
        hatch(axes, maps.x, maps.y, worst, 0.0, "bad")


def _draw_contours(axes: Axes, maps: WorkspaceMaps, values: FloatArray) -> None:
    levels = MaxNLocator(5).tick_values(np.nanmin(values), np.nanmax(values))
    bright = np.nanmin(values) + 0.65 * np.ptp(values[np.isfinite(values)])
    colors = [STYLE["ink"] if level > bright else "white" for level in levels]
    lines = axes.contour(
        maps.x, maps.y, values, levels=levels, colors=colors, linewidths=0.6, alpha=0.8, zorder=2
    )
    axes.clabel(lines, fontsize=STYLE["small"] - 1.0, inline_spacing=2)


def _mark_extremes(axes: Axes, maps: WorkspaceMaps, index: IndexMap) -> None:
    """Mark the worst pose of the index, if it is an extreme, and of every broken limit."""
    at = index.worst()
    if at is not None:
        _mark(axes, maps, at, "ink", "o")
    for values in maps.violations.values():
        if np.nanmax(values, initial=0.0) > 0.0:
            _mark(axes, maps, int(np.nanargmax(values)), "bad", "X")


def _mark(axes: Axes, maps: WorkspaceMaps, at: int, color: str, marker: str) -> None:
    axes.plot(
        maps.x.ravel()[at], maps.y.ravel()[at], linestyle="none", marker=marker, markersize=6,
        color=STYLE[color], markeredgecolor="white", markeredgewidth=0.8, zorder=6, clip_on=False,
    )  # fmt: skip
