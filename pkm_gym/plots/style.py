"""The one style of all pictures: colours, sizes, axes, how names and units are written."""

from __future__ import annotations

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

# Set on every artist by hand: rcParams are global, and a thread must not see another's.
STYLE: dict[str, Any] = {
    "font": "DejaVu Sans",
    "text": 8.0,
    "small": 7.0,
    "title": 10.0,
    "ink": "#222222",
    "faint": "#8a8a8a",
    "grid": "#e3e3e3",
    "undefined": "#ececec",
    "map": "viridis",
    "good": "#00795a",
    "bad": "#c8450a",
    "base": "#3a3a3a",
    "arm": "#16324f",
    "rod": "#4f86b8",
    "cylinder": "#9c3f6b",
    "platform": "#e69f00",
    "lines": ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"),
    "line": 1.4,
    "thin": 0.7,
    "dpi": 100,
}

GREEK = {
    "alpha": r"\alpha",
    "beta": r"\beta",
    "delta": r"\delta",
    "eta": r"\eta",
    "gamma": r"\gamma",
    "lam": r"\lambda",
    "lambda": r"\lambda",
    "mu": r"\mu",
    "omega": r"\omega",
    "phi": r"\varphi",
    "psi": r"\psi",
    "sigma": r"\sigma",
    "tau": r"\tau",
    "th": r"\theta",
    "theta": r"\theta",
}
SHOWN_UNITS = {"m": (1e3, "mm"), "rad": (180.0 / math.pi, "deg")}


def new_figure(width: float, height: float, *, dpi: float | None = None) -> Figure:
    """Return an empty figure of ``width`` x ``height`` inches on a canvas of its own."""
    figure = Figure(figsize=(width, height), dpi=dpi or STYLE["dpi"], facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def panel(
    figure: Figure,
    box: tuple[float, float, float, float],
    *,
    x: str = "",
    y: str = "",
    title: str = "",
) -> Axes:
    """Add axes in ``box`` (left, bottom, width, height, shares of the figure), labelled."""
    axes = figure.add_axes(box, facecolor="white")
    axes.set_xlabel(x, **words("text"), labelpad=3)
    axes.set_ylabel(y, **words("text"), labelpad=3)
    if title:
        axes.set_title(title, **words("text", weight="bold"), loc="left", pad=5)
    style_ticks(axes)
    return axes


def style_ticks(axes: Axes) -> None:
    """Give the axes' ticks and frame the common look."""
    axes.tick_params(
        labelsize=STYLE["small"],
        labelfontfamily=STYLE["font"],
        labelcolor=STYLE["ink"],
        color=STYLE["faint"],
        length=3,
        width=STYLE["thin"],
        pad=2,
    )
    for name, spine in axes.spines.items():
        spine.set(color=STYLE["faint"], linewidth=STYLE["thin"])
        if name in ("top", "right"):
            spine.set_visible(False)


def words(size: str = "text", *, color: str = "ink", weight: str = "normal") -> dict[str, Any]:
    """Return the keyword arguments of a text: ``size`` and ``color`` name entries of STYLE."""
    return {
        "fontsize": STYLE[size],
        "color": STYLE[color],
        "fontweight": weight,
        "fontfamily": STYLE["font"],
    }


def symbol(name: str) -> str:
    """Return a name as mathematics: ``lam_e`` gives the Greek letter with its index."""
    stem, _, index = name.partition("_")
    letters = stem.rstrip("0123456789")
    if letters not in GREEK and len(letters) != 1:
        return name.replace("_", " ")
    stem, digits = letters, stem[len(letters) :]
    if len(index) > 1:
        index = GREEK.get(index, rf"\mathrm{{{index.replace('_', '~')}}}")
    index = digits or index
    return f"${GREEK.get(stem, stem)}{f'_{{{index}}}' if index else ''}$"


def shown(value: Any, unit: str) -> tuple[Any, str]:
    """Return a value (number or array) and its unit as people read them: mm, deg, m/s²."""
    factor, name = SHOWN_UNITS.get(unit, (1.0, unit))
    return value if factor == 1.0 else factor * value, name.replace("^2", "²").replace(
        "^3", "³"
    ).replace(" m", "·m")


def label(name: str, unit: str) -> str:
    """Return an axis label: the symbol and, where there is one, the unit."""
    unit = shown(0.0, unit)[1]
    return f"{symbol(name)} ({unit})" if unit else symbol(name)


def headline(figure: Figure, title: str, note: str = "") -> None:
    """Write what the figure shows at its top left, and a line of detail under it."""
    height = figure.get_figheight()
    figure.text(0.012, 1.0 - 0.2 / height, title, **words("title", weight="bold"))
    figure.text(0.012, 1.0 - 0.38 / height, note, **words("small", color="faint"))


def remark(
    axes: Axes, text: str, at: tuple[float, float], *, dot: bool = True, **options: Any
) -> None:
    """Write a few words beside a point of a curve, marked by a dot; ``options`` place them."""
    if dot:
        axes.plot(*at, marker="o", markersize=4, color=STYLE["ink"], clip_on=False, zorder=6)
    place = {"xytext": (6, 5), "textcoords": "offset points", **options}
    axes.annotate(text, at, zorder=7, **place, **words("small"))


def legend(axes: Axes, **options: Any) -> None:
    """Draw the common legend."""
    drawn = axes.legend(fontsize=STYLE["small"], framealpha=0.9, edgecolor="none", **options)
    for text in [*drawn.get_texts(), drawn.get_title()]:
        text.set(**words("small"))
