"""Figures of the leg itself: with its workspace (Fig. 3), and beside the verified optimum."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.core.mechanism import Link
from pkm_gym.mechanisms.stroke_leg.mechanism import Leg
from pkm_gym.mechanisms.stroke_leg.workspace import StrokeLeg
from pkm_gym.plots.machine import draw_links

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

WIDTH = 7.2  # inches, a page's two columns
PRINTED_EXTENT = (1200.0, 500.0)  # mm, of Fig. 3, as the text says


def workspace(problem: DesignProblem) -> Figure:
    """Draw the crown of the stated rectangle, its exact extent and the printed one."""
    machine = printed_leg(problem)
    crown = 1e3 * machine.workspace()
    (left, bottom), (right, top) = crown.min(axis=0), crown.max(axis=0)
    figure = plots.new_figure(WIDTH, 5.4)
    plots.headline(
        figure,
        "Workspace of the leg, as in Fig. 3 of the paper, our model",
        f"exact {right - left:.2f} mm by {top - bottom:.2f} mm; dashed: the printed "
        f"{PRINTED_EXTENT[0]:.0f} mm by {PRINTED_EXTENT[1]:.0f} mm: no part of it is as wide",
    )
    axes = plots.panel(figure, (0.09, 0.09, 0.89, 0.8), x="x (mm)", y="z (mm)")
    axes.fill(*crown.T, color=plots.STYLE["lines"][5], alpha=0.3, linewidth=0.0, zorder=1)
    net = 1e3 * machine.workspace_grid(61, 61)
    for line in (*net[10:60:10], *net[:, 10:60:10].swapaxes(0, 1)):
        axes.plot(*line.T, color=plots.STYLE["lines"][0], linewidth=0.5, alpha=0.6, zorder=1.5)
    axes.plot(*crown.T, color=plots.STYLE["ink"], linewidth=1.2, zorder=2)
    wide, high = PRINTED_EXTENT
    box = np.array([(-1, 0), (1, 0), (1, 2), (-1, 2), (-1, 0)]) * (0.5 * wide, 0.5 * high)
    axes.plot(
        *(box + np.array([0.0, bottom])).T, color=plots.STYLE["bad"], linestyle="--", linewidth=1.1
    )
    pose = machine.foot(np.array([np.radians(45.0), 0.0]))
    draw_leg(axes, machine, pose, alpha=0.9)
    for theta, varphi, text, side in (
        (15, 0, r"$\theta$ = 15°", "center"),
        (45, -30, r"$\theta$ = 45°", "left"),
        (75, -30, r"$\theta$ = 75°", "left"),
        (64, 30, "swing 30°", "right"),
        (64, -30, "swing −30°", "left"),
    ):
        place = 1e3 * machine.foot(np.radians((theta, varphi)))
        shift = {"left": (6, -3), "right": (-6, -3), "center": (0, 5)}[side]
        plots.remark(axes, text, tuple(place), xytext=shift, ha=side, dot=False)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.04)
    axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
    axes.set_axisbelow(True)
    return figure


def comparison(problem: DesignProblem) -> Figure:
    """Draw the printed design and the verified optimum side by side, with what they measure."""
    optimum = problem.design(next(iter(problem.reference.optima.values())).design)
    figure = plots.new_figure(WIDTH, 5.2)
    plots.headline(
        figure,
        "Printed design and verified optimum, to scale",
        "at the middle of the rectangle; a plate is one body, crank and upper link",
    )
    designs = {"printed": problem.printed_design(), "verified optimum": optimum}
    for k, (title, design) in enumerate(designs.items()):
        machine = problem.mechanism(design)
        assert isinstance(machine, StrokeLeg)
        axes = plots.panel(
            figure, (0.09 + 0.48 * k, 0.09, 0.42, 0.78), x="x (mm)",
            y="" if k else "z (mm)", title=title,
        )  # fmt: skip
        pose = machine.foot(np.array([0.25 * np.pi, 0.0]))
        draw_leg(axes, machine, pose)
        _letter(axes, machine, pose)
        axes.plot(*1e3 * machine.workspace().T, color=plots.STYLE["faint"], linewidth=0.8)
        axes.set_aspect("equal", adjustable="box")
        axes.set(xlim=(-540.0, 540.0), ylim=(-1040.0, 320.0))
        axes.text(
            0.02, 0.99, _measured(problem, design), transform=axes.transAxes, va="top",
            fontsize=plots.STYLE["small"], fontfamily=plots.STYLE["font"], linespacing=1.4,
        )  # fmt: skip
    return figure


def printed_leg(problem: DesignProblem) -> StrokeLeg:
    """Return the leg that the paper prints."""
    return leg_of(problem, None)


def leg_of(problem: DesignProblem, design: FloatArray | None) -> StrokeLeg:
    """Return the leg of a design (d,), of the printed one if none is given."""
    machine = problem.mechanism(problem.printed_design() if design is None else design)
    assert isinstance(machine, StrokeLeg)
    return machine


def draw_leg(
    axes: Axes, machine: Leg, pose: FloatArray, *, at: float = 0.0, alpha: float = 1.0,
    layer: float = 5,
) -> None:  # fmt: skip
    """Draw the leg with its hip ``at`` x, m, in mm."""
    links = tuple(
        Link(link.role, link.points + np.array([at, 0.0])) for link in machine.links(pose)
    )
    draw_links(axes, links, alpha=alpha, layer=layer)
    for link in links:
        if link.role == "base":
            axes.plot(
                *1e3 * link.points.T, color=plots.STYLE["base"], linewidth=6, alpha=0.25 * alpha,
                marker="o", markersize=7, solid_capstyle="round", zorder=layer - 0.5,
            )  # fmt: skip


def _letter(axes: Axes, machine: Leg, pose: FloatArray) -> None:
    """Write the joints' letters beside them."""
    shifts = {"O": (-13, -3), "A": (-11, 3), "D": (-11, -10), "B": (6, 2), "C": (7, -3)}
    for letter, point in machine.points(pose).items():
        shift = shifts.get(letter, (6 if point[0] > -1e-9 else -11, -3))
        plots.remark(axes, letter, tuple(1e3 * point), dot=False, xytext=shift)


def _measured(problem: DesignProblem, design: FloatArray) -> str:
    """Return a design's numbers as lines."""
    evaluation = problem.evaluate(design[None])
    named = [plots.shown(value, v.unit) for v, value in zip(problem.variables, design, strict=True)]
    sizes = ", ".join(
        f"{plots.symbol(v.name)} {value:.4g}{'°' if unit == 'deg' else ''}"
        for v, (value, unit) in zip(problem.variables, named, strict=True)
    )
    broken = int((evaluation.constraints[0] > 0.0).sum())
    if broken:
        return f"{sizes}\n{broken} limits broken; indices undefined\nacross the dead line"
    indices = {name: float(values[0]) for name, values in evaluation.indices.items()}
    return (
        f"{sizes}\nfeasible: {plots.symbol('eta_P')} {indices['eta_P']:.4f}, "
        f"{plots.symbol('sigma')} {indices['sigma']:.4f},\n"
        f"{plots.symbol('lam')} {indices['lambda_paper']:.4f}, force {indices['force']:.1f}"
    )
