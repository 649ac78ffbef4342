"""Figures of the leg's indices: over the workspace (Fig. 4), over each variable (Fig. 5)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.stroke_leg.figures.leg import WIDTH, printed_leg
from pkm_gym.mechanisms.stroke_leg.workspace import StrokeLeg
from pkm_gym.plots.maps import colour_bar, hatch

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import BoolArray, FloatArray

PRINTED_RANGES = {"eta_P": (4.0544, 7.9328), "eta_FC": (0.07151, 0.16766), "eta_DL": (1.002, 1.701)}
SWEPT = ("l1", "l6", "l3", "phi", "th3")  # Fig. 5 (a) to (e)
NARROW = np.radians(15.0)  # swing with which most of the sweeps keeps off the dead line
FAR = np.radians(60.0)  # swing of the map, so that both dead lines can be seen


def condition(problem: DesignProblem) -> Figure:
    """Draw the condition number of the printed design with its dead lines, and cuts through it."""
    machine = printed_leg(problem)
    figure = plots.new_figure(WIDTH, 3.7)
    across = _share_across(machine)
    plots.headline(
        figure,
        "Condition number of the printed design, as in Fig. 4 of the paper, our model",
        f"hatched: a crank is across its dead line, A on {100.0 * across:.1f} % of the crown "
        "(outlined); the paper sees neither that nor the asymmetry",
    )
    axes = plots.panel(figure, (0.085, 0.13, 0.5, 0.7), x="x (mm)", y="z (mm)")
    _draw_condition(axes, machine)
    axes = plots.panel(
        figure, (0.745, 0.13, 0.24, 0.68), x="swing (deg)", y=plots.label("eta", ""),
        title="along the swing",
    )  # fmt: skip
    swing = np.linspace(-30.0, 30.0, 241)
    for theta, color in zip((30, 45, 60, 70), plots.STYLE["lines"], strict=False):
        opening = np.radians(np.stack([np.full_like(swing, theta), swing], axis=-1))
        eta = machine.index_maps(machine.foot(opening))["eta_P"].values
        axes.plot(swing, eta, color=color, linewidth=1.4, label=rf"$\theta$ = {theta}°")
    axes.axvline(0.0, color=plots.STYLE["faint"], linewidth=0.7, linestyle="--")
    axes.set(ylim=(0.8, 8.0), xlim=(-30.0, 30.0))
    plots.legend(axes, loc="upper left")
    return figure


def _share_across(machine: StrokeLeg) -> float:
    """Return on which share of the rectangle A is across its dead line: a corner is cut off."""
    corner = machine.foot(np.array([machine.theta_max, machine.swing]))
    crossed = max(0.0, -float(machine.dead_point_angles(corner)["dead_A_short"]))
    return 0.25 * crossed**2 / (machine.swing * (machine.theta_max - machine.theta_min))


def _draw_condition(axes: Axes, machine: StrokeLeg) -> None:
    """Draw the condition number in the foot's plane, beyond the crown so that dead lines show."""
    theta, swing = np.meshgrid(np.radians(np.linspace(8.0, 82.0, 223)), np.linspace(-FAR, FAR, 361))
    poses = machine.foot(np.stack([theta, swing], axis=-1))
    x, z = 1e3 * poses[..., 0], 1e3 * poses[..., 1]
    eta = machine.local_indices(poses)["eta"]
    levels = np.concatenate([np.arange(1.0, 4.01, 0.25), np.arange(4.5, 8.01, 0.5)])
    axes.set_facecolor(plots.STYLE["undefined"])
    bands = axes.contourf(x, z, eta, levels=levels, cmap=plots.STYLE["map"], extend="max")
    bands.set_rasterized(True)  # a vector format would show seams between the bands
    lines = axes.contour(x, z, eta, levels=[1.1, 1.5, 2, 3, 5], colors="white", linewidths=0.6)
    axes.clabel(lines, fontsize=plots.STYLE["small"] - 1.0, inline_spacing=2)
    angles = machine.dead_point_angles(poses)
    for crank in "AD":
        margin = np.minimum(angles[f"dead_{crank}_short"], angles[f"dead_{crank}_long"])
        axes.contourf(x, z, margin, levels=[-np.inf, 0.0], colors="white", alpha=0.6)
        hatch(axes, x, z, -margin, 0.0, "bad")
    for text, place in (("A across OB", (-700.0, -230.0)), ("D across OC", (370.0, -130.0))):
        axes.text(
            *place, text, fontsize=plots.STYLE["small"], color=plots.STYLE["bad"], ha="center",
            va="center", fontfamily=plots.STYLE["font"],
        )  # fmt: skip
    axes.plot(*1e3 * machine.workspace().T, color=plots.STYLE["ink"], linewidth=1.4)
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(-900.0, 900.0), ylim=(-1040.0, -70.0))
    colour_bar(axes, bands, plots.label("eta", ""))


def sweeps(problem: DesignProblem) -> Figure:
    """Draw the three indices over each variable about the printed design, as Fig. 5."""
    figure = plots.new_figure(10.0, 5.4)
    plots.headline(
        figure,
        "Indices over each variable about the printed design, as in Fig. 5 of the paper, our model",
        "lines: swing ±15 deg, hatched where A crosses its dead line; dots: a 1 deg grid on the "
        "paper's ±30 deg, across the dead line; dashed: the printed extremes",
    )
    rows = tuple(PRINTED_RANGES)
    for column, name in enumerate(SWEPT):
        variable = next(v for v in problem.variables if v.name == name)
        values = np.linspace(variable.low, variable.high, 121)
        shown, _ = plots.shown(values, variable.unit)
        indices, defined = _swept(problem, name, values)
        raw = _raw_indices(problem, name, values[::4])
        for row, index in enumerate(rows):
            box = (0.062 + 0.19 * column, 0.645 - 0.282 * row, 0.162, 0.235)
            axes = plots.panel(
                figure, box, x=plots.label(name, variable.unit) if row == 2 else "",
                y=plots.symbol(index) if column == 0 else "",
                title=f"({'abcde'[column]})" if row == 0 else "",
            )  # fmt: skip
            _draw_sweep(axes, shown, indices[index], defined)
            axes.plot(
                shown[::4], raw[index], linestyle="none", marker=".", markersize=3,
                color=plots.STYLE["faint"],
            )  # fmt: skip
            for at in PRINTED_RANGES[index]:
                axes.axhline(at, color=plots.STYLE["bad"], linewidth=0.9, linestyle="--")
            axes.axvline(
                plots.shown(problem.reference.design[name], variable.unit)[0],
                color=plots.STYLE["ink"], linewidth=0.6, linestyle=":",
            )  # fmt: skip
            _scale_sweep(axes, index)
            axes.set_xlim(shown[0], shown[-1])
            if row < 2:
                axes.set_xticklabels([])
            if column:
                axes.set_yticklabels([])
    return figure


def _swept(
    problem: DesignProblem, name: str, values: FloatArray
) -> tuple[dict[str, FloatArray], BoolArray]:
    """Return the indices over one variable with the narrow swing, and where they are defined."""
    rows = np.repeat(problem.printed_design()[None], len(values), axis=0)
    rows[:, [v.name for v in problem.variables].index(name)] = values
    found = problem.evaluate(rows, problem.task.replace(swing=NARROW)).indices
    return {key: found[key] for key in PRINTED_RANGES}, np.isfinite(found["eta_P"])


def _raw_indices(problem: DesignProblem, name: str, values: FloatArray) -> dict[str, FloatArray]:
    """Return what a grid of 1 deg gives on the paper's rectangle, a dead line or not."""
    found = []
    for value in values.tolist():
        machine = problem.mechanism(problem.design({**problem.reference.design, name: value}))
        assert isinstance(machine, StrokeLeg)
        eta = machine.local_indices(machine.workspace_grid(61, 61))["eta"]
        found.append((eta.mean(), eta.std() / 61.0, eta.min()))
    return dict(zip(PRINTED_RANGES, np.array(found).T, strict=True))


def _draw_sweep(axes: Axes, x: FloatArray, y: FloatArray, defined: BoolArray) -> None:
    """Draw a curve, and hatch where it is undefined."""
    axes.plot(x, y, color=plots.STYLE["lines"][0], linewidth=1.6, zorder=4)
    axes.fill_between(
        x, 0.0, 1.0, where=~defined, transform=axes.get_xaxis_transform(), facecolor="none",
        edgecolor=plots.STYLE["faint"], hatch="/////", linewidth=0.0, alpha=0.5, zorder=1,
    )  # fmt: skip


def _scale_sweep(axes: Axes, index: str) -> None:
    """Give all sweeps of an index one scale, wide enough for the printed extremes."""
    scales = {
        "eta_P": ((1.8, 9.0), (2, 3, 4, 6, 8)),
        "eta_FC": ((0.008, 0.5), (0.01, 0.03, 0.1, 0.3)),
        "eta_DL": ((0.97, 1.8), (1.0, 1.2, 1.4, 1.6, 1.8)),
    }
    limits, ticks = scales[index]
    if index != "eta_DL":
        axes.set_yscale("log")
    axes.set_ylim(limits)
    axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
    axes.minorticks_off()
