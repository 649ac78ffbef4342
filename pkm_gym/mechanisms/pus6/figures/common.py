"""What several of the figures show: the atlas, the box beside it, optima, maps over L and R."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import MaxNLocator

from pkm_gym import plots
from pkm_gym.core.solve import solve_tasks
from pkm_gym.mechanisms import make_problem
from pkm_gym.mechanisms.pus6.atlas import LENGTHS, RADII, Atlas, lattice_atlas
from pkm_gym.mechanisms.pus6.claims import SQUARE, Maps, best_of
from pkm_gym.mechanisms.pus6.mechanism import NAMES, Pus6
from pkm_gym.plots.maps import colour_bar

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

WIDTH = 7.2  # inches, a page's two columns
WIDE = 10.0
TITLES = {
    "eta_omega": "angular velocity",
    "eta_v": "linear velocity",
    "eta_alpha": "angular acceleration",
    "eta_a": "linear acceleration",
    "eta_F": "force and torque",
    "eta_I": "inertia force",
}
COLORS = dict(zip(NAMES, ("#0072b2", "#56b4e9", "#d55e00", "#e69f00", "#8a8a8a", "#009e73"),
                  strict=True))  # fmt: skip
PRINTED = (0.46, 0.19)  # L and R, m
NUMBER = 20  # of the printed design among the 121, from 0
WITHIN = {"L": (0.45, 0.55), "R": (0.10, 0.20)}  # the range of the paper's grid


@cache
def lattice(length: float = 0.01, convention: str = "influence") -> Atlas:
    """Return the atlas of the 121 designs."""
    return lattice_atlas(characteristic_length=length, convention=convention)


@cache
def box(length: float = 0.01, convention: str = "influence") -> FloatArray:
    """Return the means (121, 6) over the default task's box."""
    problem = make_problem("pus6", task={"characteristic_length": length}, convention=convention)
    indices = problem.evaluate(lattice().designs[:, :2]).indices
    return np.stack([indices[name] for name in NAMES], axis=-1)


def maps_of(problem: DesignProblem) -> Maps:
    """Return what the paper's statements are about."""
    return Maps(lattice(), box(), problem.reference)


@cache
def optimum(name: str, *, within: bool = False) -> FloatArray:
    """Return the optimum (d,) of a problem's default task, recorded or solved.

    ``within`` the range of the paper's grid: solved.
    """
    problem = make_problem(name, bounds=WITHIN if within else {})
    recorded = [] if within else list(problem.reference.optima.values())
    if recorded and recorded[0].objective == problem.objectives[0].name:
        return problem.design(recorded[0].design)
    return np.asarray(solve_tasks(problem, problem.pack(None)[None]).designs[0])


def printed(problem: DesignProblem) -> Pus6:
    """Return the machine that the paper prints."""
    return machine(problem, problem.printed_design())


def machine(problem: DesignProblem, design: FloatArray) -> Pus6:
    """Return the machine of a design."""
    made = problem.mechanism(design)
    assert isinstance(made, Pus6)
    return made


def draw_grid_map(axes: Axes, values: FloatArray, *, bar: str | None = None) -> None:
    """Draw values (11, 11), rows L, over the paper's grid in bands, with a ``bar`` of that name."""
    x, y = 100.0 * LENGTHS, 100.0 * RADII
    levels = np.asarray(MaxNLocator(15).tick_values(values.min(), values.max()))
    bands = axes.contourf(x, y, values.T, levels=levels, cmap=plots.STYLE["map"])
    bands.set_rasterized(True)  # a vector format would show seams between the bands
    axes.contour(x, y, values.T, levels=levels, colors="white", linewidths=0.3, alpha=0.6)
    scale_grid(axes)
    if bar is not None:
        colour_bar(axes, bands, bar)


def scale_grid(axes: Axes) -> None:
    """Give axes over L and R the paper's range and steps, cm."""
    axes.set(xlim=(45.0, 55.0), ylim=(10.0, 20.0))
    axes.set_xticks(range(45, 56, 2))
    axes.set_yticks(range(10, 21, 2))


def mark_best(axes: Axes, values: FloatArray, text: str = "largest") -> None:
    """Mark the printed design and where values (11, 11) are largest."""
    place = {text: best_of(values), "printed": PRINTED}
    mark(axes, {name: (100.0 * L, 100.0 * R) for name, (L, R) in place.items()})


def mark(axes: Axes, points: Mapping[str, tuple[float, float]]) -> None:
    """Mark designs by name: a star for "printed", other signs for others."""
    others = iter(("o", "D", "s"))
    for name, place in points.items():
        star = name == "printed"
        sign, size, color = ("*", 10.0, "#d55e00") if star else (next(others), 5.5, "white")
        axes.plot(
            *place, linestyle="none", marker=sign, markersize=size, color=color, label=name,
            markeredgecolor=plots.STYLE["ink"], markeredgewidth=0.9, zorder=7, clip_on=False,
        )  # fmt: skip


def signed(value: float) -> str:
    """Return a number with one decimal and its sign."""
    return f"{round(float(value), 1) + 0.0:+.1f}".replace("-", "−").replace("+0.0", "0.0")


def square(values: FloatArray) -> FloatArray:
    """Return values (121,) as (11, 11), rows L."""
    return values.reshape(SQUARE)


def lines_below(figure: Figure, lines: list[str], bottom: float = 0.14) -> None:
    """Write lines of words upwards from ``bottom`` inches, the last one lowest."""
    tall = figure.get_figheight()
    for k, line in enumerate(reversed(lines)):
        figure.text(
            0.012, (bottom + 0.165 * k) / tall, line, fontsize=plots.STYLE["small"],
            color=plots.STYLE["ink"], fontfamily=plots.STYLE["font"],
        )  # fmt: skip
