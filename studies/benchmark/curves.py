"""Figures of the benchmark: regret and share solved over evaluations, regret over pool size."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pkm_gym.benchmark.scoring import FLOOR, SCORED, WITHIN
from pkm_gym.benchmark.standings import AT, Entry
from pkm_gym.plots import STYLE, headline, legend, new_figure, panel, save

DPI = 150
WIDTH, HEIGHT, KEY = 4.0, 4.2, 1.8  # of a panel, of a figure, of the key to the lines, inches
PER_CENT = 100.0
TOP = 1.0  # regrets above this are drawn there
BAND = (0.1, 0.9)
LINES = tuple(product(("-", "--", ":"), STYLE["lines"]))


def save_curves(entries: Sequence[Entry], folder: Path) -> list[Path]:
    """Draw what the entries allow into a folder; return the files."""
    figures = {"regret": regret_figure(entries), "solved": solved_figure(entries)}
    if len({entry.setting.pool for entry in entries if entry.setting.pool}) > 1:
        figures["pool"] = pool_figure(entries)
    return [save(figure, folder / f"{name}.png", dpi=DPI) for name, figure in figures.items()]


def regret_figure(entries: Sequence[Entry]) -> Figure:
    """Draw the regret over evaluations: median over tasks, and where 80 % of the tasks lie."""
    tracks = sorted({entry.track for entry in entries})
    figure = new_figure(WIDTH * len(tracks) + KEY, HEIGHT)
    for i, track in enumerate(tracks):
        axes = _panel(figure, i, title=track)
        axes.set_yscale("log")
        axes.minorticks_off()
        axes.yaxis.set_major_formatter("{x:g}")
        axes.set_ylim(FLOOR * PER_CENT, TOP * PER_CENT)
        for entry, style in _styled(entries):
            if entry.track == track:
                _curve(axes, entry, style)
    figure.axes[0].set_ylabel("regret (% of the optimum)")
    _key(figure, entries)
    note = "median, and where 80 % of the tasks lie; at the top nothing feasible is found"
    _headline(figure, entries, "Regret against evaluations", note)
    return figure


def solved_figure(entries: Sequence[Entry]) -> Figure:
    """Draw the share of tasks solved over evaluations, for each limit of the regret."""
    figure = new_figure(WIDTH * len(WITHIN) + KEY, HEIGHT)
    for i, limit in enumerate(WITHIN):
        axes = _panel(figure, i, title=f"within {PER_CENT * limit:g} %")
        axes.set_ylim(-0.02, 1.02)
        for entry, style in _styled(entries):
            share = np.median((entry.regret <= limit).mean(axis=1), axis=0)
            axes.plot(_counts(entry), share, drawstyle="steps-post", **style)
    figure.axes[0].set_ylabel("share of the tasks")
    _key(figure, entries)
    _headline(figure, entries, "Tasks solved against evaluations", "all tracks")
    return figure


def pool_figure(entries: Sequence[Entry]) -> Figure:
    """Draw the median regret after 12 evaluations over the number of training tasks known."""
    figure = new_figure(5.2, HEIGHT)
    axes = panel(figure, (0.14, 0.12, 0.82, 0.72), x="training tasks known")
    methods = sorted({entry.setting.method for entry in entries if entry.setting.pool})
    for method, (dashes, colour) in zip(methods, LINES, strict=False):
        own = sorted(
            (entry.setting.pool, entry.median(min(SCORED, entry.setting.budget)))
            for entry in entries
            if entry.setting.method == method
        )
        sizes, medians = np.array(own).T
        axes.plot(
            sizes, PER_CENT * np.clip(medians, FLOOR, TOP), marker="o", markersize=4,
            linestyle=dashes, color=colour, label=method,
        )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(sorted({entry.setting.pool for entry in entries if entry.setting.pool}))
    axes.minorticks_off()
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
    axes.grid(color=STYLE["grid"], linewidth=STYLE["thin"])
    axes.set_ylabel(f"median regret after {SCORED} evaluations (%)")
    legend(axes, loc="best")
    _headline(figure, entries, "What a larger pool is worth", "transfer methods")
    return figure


def _panel(figure: Figure, i: int, *, title: str) -> Axes:
    width = WIDTH / figure.get_figwidth()
    box = (width * (i + 0.18), 0.12, 0.78 * width, 0.70)
    axes = panel(figure, box, x="evaluations", title=title)
    axes.set_xscale("log")
    axes.set_xticks(AT)
    axes.minorticks_off()
    axes.xaxis.set_major_formatter("{x:g}")
    axes.grid(color=STYLE["grid"], linewidth=STYLE["thin"])
    axes.set_axisbelow(True)
    return axes


def _curve(axes: Axes, entry: Entry, style: dict[str, Any]) -> None:
    quantiles = np.quantile(entry.regret, (BAND[0], 0.5, BAND[1]), axis=1, method="higher")
    low, middle, high = PER_CENT * np.clip(np.median(quantiles, axis=1), FLOOR, TOP)
    axes.plot(_counts(entry), middle, drawstyle="steps-post", **style)
    shade = {"color": style["color"], "alpha": 0.07, "linewidth": 0.0, "step": "post"}
    axes.fill_between(_counts(entry), low, high, **shade)


def _key(figure: Figure, entries: Sequence[Entry]) -> None:
    """Write which line is which, to the right of the panels."""
    lines = [Line2D([], [], label=entry.name, **style) for entry, style in _styled(entries)]
    place = {"loc": "upper left", "bbox_to_anchor": (1.03, 1.02)}
    legend(figure.axes[-1], handles=lines, **place)


def _counts(entry: Entry) -> Any:
    return np.arange(1, entry.setting.budget + 1)


def _styled(entries: Sequence[Entry]) -> list[tuple[Entry, dict[str, Any]]]:
    """Return each entry with its line, the same in every figure."""
    names = sorted({entry.name for entry in entries})
    lines = [LINES[names.index(entry.name) % len(LINES)] for entry in entries]
    return [
        (entry, {"linestyle": dashes, "color": colour, "linewidth": STYLE["line"]})
        for entry, (dashes, colour) in zip(entries, lines, strict=True)
    ]


def _headline(figure: Figure, entries: Sequence[Entry], title: str, note: str) -> None:
    setting = entries[0].setting
    tasks = max(len(entry.rows) for entry in entries)
    headline(figure, title, f"{setting.problem}, {setting.split}: {tasks} tasks; {note}")
