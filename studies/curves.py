"""Figures of the benchmark: regret and share solved over evaluations, regret over pool size."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pkm_gym.benchmark.scoring import FLOOR, SCORED, WITHIN
from pkm_gym.benchmark.standings import Entry
from pkm_gym.plots import STYLE, headline, legend, new_figure, panel, save

DPI = 150
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
    figure = new_figure(4.2 * len(tracks) + 0.6, 4.4)
    for i, track in enumerate(tracks):
        axes = _panel(figure, i, len(tracks), title=track)
        axes.set_yscale("log")
        axes.set_ylim(FLOOR * PER_CENT, TOP * PER_CENT)
        for entry, style in _styled(entries):
            if entry.track == track:
                _curve(axes, entry, style)
        legend(axes, loc="lower left")
    figure.axes[0].set_ylabel("regret (% of the optimum)")
    _headline(figure, entries, "Regret against evaluations", "median and 10 to 90 % of the tasks")
    return figure


def solved_figure(entries: Sequence[Entry]) -> Figure:
    """Draw the share of tasks solved over evaluations, for each limit of the regret."""
    figure = new_figure(4.2 * len(WITHIN) + 0.6, 4.4)
    for i, limit in enumerate(WITHIN):
        axes = _panel(figure, i, len(WITHIN), title=f"within {PER_CENT * limit:g} %")
        axes.set_ylim(-0.02, 1.02)
        for entry, style in _styled(entries):
            share = np.median((entry.regret <= limit).mean(axis=1), axis=0)
            axes.plot(_counts(entry), share, label=entry.name, **style)
    figure.axes[0].set_ylabel("share of the tasks")
    legend(figure.axes[0], loc="upper left")
    _headline(figure, entries, "Tasks solved against evaluations", "all tracks")
    return figure


def pool_figure(entries: Sequence[Entry]) -> Figure:
    """Draw the median regret after 12 evaluations over the number of training tasks known."""
    figure = new_figure(5.2, 4.4)
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
    axes.set_ylabel(f"median regret after {SCORED} evaluations (%)")
    legend(axes, loc="best")
    _headline(figure, entries, "What a larger pool is worth", "transfer methods")
    return figure


def _panel(figure: Figure, i: int, n: int, *, title: str) -> Axes:
    width = 1.0 / n
    box = (width * i + 0.055, 0.12, width - 0.075, 0.70)
    axes = panel(figure, box, x="evaluations", title=title)
    axes.set_xscale("log")
    axes.set_xticks([1, 2, 4, 8, 12, 24, 60, 120, 300], minor=False)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    axes.grid(color=STYLE["grid"], linewidth=STYLE["thin"])
    axes.set_axisbelow(True)
    return axes


def _curve(axes: Axes, entry: Entry, style: dict[str, Any]) -> None:
    quantiles = np.quantile(entry.regret, (BAND[0], 0.5, BAND[1]), axis=1, method="higher")
    low, middle, high = PER_CENT * np.clip(np.median(quantiles, axis=1), FLOOR, TOP)
    axes.plot(_counts(entry), middle, label=entry.name, **style)
    axes.fill_between(_counts(entry), low, high, color=style["color"], alpha=0.07, linewidth=0.0)


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
    how = entries[0].setting
    tasks = max(len(entry.rows) for entry in entries)
    headline(figure, title, f"{how.problem}, {how.split}: {tasks} tasks; {note}")
