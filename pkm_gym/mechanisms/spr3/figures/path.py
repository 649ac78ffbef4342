"""The path of Fig. 2, and the legs along it: lengths, speeds, and how the limbs turn."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.spr3.figures.common import WIDTH, draw_legs, printed, printed_numbers
from pkm_gym.mechanisms.spr3.path import (
    GatePath,
    Motion,
    best_place,
    largest_cylinder,
    motion,
    needed_range,
)
from pkm_gym.plots.pictures import Picture

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray
    from pkm_gym.mechanisms.spr3.mechanism import Spr3

GAMMAS = (0.0, 30.0, 60.0, 90.0)  # deg, of the path's plane
CORNERS = ((-1, 1), (-1, -1), (1, -1), (1, 1))  # of P1 ... P4 on the page, right and up


def path(problem: DesignProblem) -> Figure:
    """Draw the path, printed and the largest that fits, in its plane and from above, as Fig. 2."""
    machine = printed(problem)
    theirs = best_place(machine, *printed_numbers(problem, "path_R", "path_h"))
    ours = largest_path(machine, 0.0)
    shortest, longest = needed_range(machine, theirs)
    figure = plots.new_figure(WIDTH, 3.6)
    plots.headline(
        figure,
        "The path in a plane through the z axis, as in Fig. 2 of the paper, our model",
        "the printed one, at the height (ours) where it fits best, needs legs of "
        f"{shortest:.2f} to {longest:.2f} m; the largest that fits: R {1e3 * ours.radius:.1f} mm",
    )
    plane = plots.panel(
        figure, (0.085, 0.135, 0.52, 0.69), x="x (mm)", y="z (mm)", title=r"$\gamma$ = 0 deg"
    )
    plane.fill(*(1e3 * machine.workspace().T), color=plots.STYLE["grid"], label="workspace")
    above = plots.panel(
        figure, (0.7, 0.135, 0.285, 0.69), x="x (mm)", y="y (mm)", title="from above"
    )
    for each, color, style, name in (
        (theirs, plots.STYLE["bad"], "--", "printed"),
        (ours, plots.STYLE["good"], "-", "largest that fits"),
    ):
        plane.plot(*(1e3 * each.corners[:, [0, 2]].T), color=color, linestyle=style, label=name)
        turn = np.linspace(0.0, 2.0 * np.pi, 181)
        above.plot(
            1e3 * each.radius * np.cos(turn), 1e3 * each.radius * np.sin(turn), color=color,
            linestyle=style, linewidth=1.0,
        )  # fmt: skip
    for k, (corner, (right, up)) in enumerate(zip(theirs.corners, CORNERS, strict=True)):
        at = (1e3 * corner[0], 1e3 * corner[2])
        side = "left" if right > 0 else "right"
        plots.remark(plane, f"$P_{k + 1}$", at, xytext=(6 * right, 6 * up), ha=side, va="center")
    for gamma in GAMMAS:
        x, y = (1e3 * theirs.radius * f(np.radians(gamma)) for f in (np.cos, np.sin))
        above.plot((-x, x), (-y, y), color=plots.STYLE["faint"], linewidth=0.7)
        above.annotate(
            f"{gamma:.0f}°", (1.1 * x, 1.1 * y), ha="center", va="center",
            fontsize=plots.STYLE["small"], fontfamily=plots.STYLE["font"],
        )  # fmt: skip
    for axes in (plane, above):
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.12)
    plots.legend(plane, loc="upper center", ncols=3)
    return figure


def leg_lengths(problem: DesignProblem) -> Figure:
    """Draw the legs' lengths along the path at four gammas."""
    return _path_figure(problem, "Leg lengths along the largest path that fits", _lengths)


def leg_rates(problem: DesignProblem) -> Figure:
    """Draw the legs' rates along the path at four gammas."""
    return _path_figure(problem, "Leg rates along the largest path that fits", _rates)


def limb_spins(problem: DesignProblem) -> Figure:
    """Draw how the limbs turn about themselves along the path at four gammas. Eq. (19)."""
    return _path_figure(problem, "Limbs' spin along the largest path that fits, eq. (19)", _spins)


def limb_swings(problem: DesignProblem) -> Figure:
    """Draw how the limbs turn across themselves along the path at four gammas. Eq. (16)."""
    return _path_figure(problem, "Limbs' swing along the largest path that fits, eq. (16)", _swings)


PICTURES = {
    "fig2_path": Picture("the path, as in Fig. 2", path),
    "path_lengths": Picture("leg lengths along the path", leg_lengths),
    "path_rates": Picture("leg rates along the path", leg_rates),
    "limb_swings": Picture("how the limbs swing along the path, eq. (16)", limb_swings),
    "limb_spins": Picture("how the limbs spin along the path, eq. (19)", limb_spins),
}


def largest_path(machine: Spr3, gamma: float) -> GatePath:
    """Return the largest path that fits at every gamma, in the plane of one, rad."""
    radius, height, z_c = largest_cylinder(machine)
    return GatePath(radius, z_c + 0.5 * height, z_c - 0.5 * height, gamma)


def _lengths(moved: Motion) -> tuple[str, FloatArray]:
    return "leg length (mm)", 1e3 * moved.lengths


def _rates(moved: Motion) -> tuple[str, FloatArray]:
    return "leg rate (mm/s)", 1e3 * moved.rates


def _spins(moved: Motion) -> tuple[str, FloatArray]:
    return "spin (deg/s)", np.degrees(moved.spins)


def _swings(moved: Motion) -> tuple[str, FloatArray]:
    return "swing (deg/s)", np.degrees(moved.swings)


def _path_figure(
    problem: DesignProblem, title: str, shown: Callable[[Motion], tuple[str, FloatArray]]
) -> Figure:
    """Draw the legs along the largest feasible path, a panel a gamma."""
    machine, path = printed(problem), largest_path(printed(problem), 0.0)
    theirs = printed_numbers(problem, "path_R", "path_h")
    shortest, longest = needed_range(machine, best_place(machine, *theirs))
    speed, acceleration = printed_numbers(problem, "speed", "acceleration")
    figure = plots.new_figure(WIDTH, 4.6)
    plots.headline(
        figure,
        f"{title}, our model",
        f"R {1e3 * path.radius:.1f} mm, h {1e3 * (path.z_start - path.z_across):.1f} mm from z "
        f"{1e3 * path.z_across:.1f} mm (ours); the paper's ({theirs[0]:g} m, {theirs[1]:g} m) "
        f"needs legs of {shortest:.2f} to {longest:.2f} m and does not fit",
    )
    panels: list[Axes] = []
    for k, gamma in enumerate(GAMMAS):
        along = replace(path, gamma=float(np.radians(gamma)))
        moved = motion(machine, along, speed, acceleration)
        name, values = shown(moved)
        row, column = divmod(k, 2)
        axes = plots.panel(
            figure,
            (0.08 + 0.485 * column, 0.515 - 0.42 * row, 0.42, 0.33),
            x="time (s)" if row else "",
            y="" if column else name,
            title=f"$\\gamma$ = {gamma:g} deg{_coincident(values)}",
        )
        if panels:
            axes.sharey(panels[0])
        draw_legs(axes, moved.times, values)
        panels.append(axes)
    plots.legend(panels[1], loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
    return figure


def _coincident(values: FloatArray) -> str:
    """Say which two legs share their curve in values (n, 3), if any do."""
    for one, other in ((0, 1), (0, 2), (1, 2)):
        if np.allclose(values[:, one], values[:, other], rtol=0.0, atol=1e-6):
            return f", legs {one + 1} and {other + 1} alike"
    return ""
