"""The Diamond's figures: Figs 3-8 of the paper with our model, the machine, our cycle's torque."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.core.solve import Solutions, solve_tasks
from pkm_gym.mechanisms import make_problem
from pkm_gym.mechanisms.diamond.cycle import driven
from pkm_gym.mechanisms.diamond.findings import INTERVALS, WINDOW
from pkm_gym.mechanisms.diamond.mechanism import Diamond
from pkm_gym.mechanisms.diamond.problem import SCAN, cycle_path, packed_task
from pkm_gym.mechanisms.diamond.region import Region, reachable_region
from pkm_gym.plots.pictures import Picture, machine_pictures

if TYPE_CHECKING:
    from collections.abc import Mapping

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from numpy.typing import ArrayLike

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

WIDTH = 7.2  # inches, a page's two columns
BOUNDS = {"sigma_max": ("^", "upper bound active"), "sigma_min": ("v", "lower bound active")}
CUT = ("o", "at the edge of our search box")

PRINTED = tuple(SCAN.lam_e)  # lam_e of the four curves of Fig. 7
SWEPT = np.union1d(np.round(np.arange(0.2, 0.7501, 0.025), 3), PRINTED)


def region(problem: DesignProblem, design: FloatArray | None = None) -> Figure:
    """Draw the reachable region of Fig. 3 for a design (d,), the printed one if not given.

    Raises:
        ValueError: for a design that makes no machine or doesn't reach the workspace.
    """
    chosen = problem.printed_design() if design is None else np.asarray(design, dtype=float)
    machine = problem.mechanism(chosen)
    assert isinstance(machine, Diamond)
    found = reachable_region(machine)
    low, high = np.degrees(found.angles)
    figure = plots.new_figure(WIDTH, 5.6)
    plots.headline(
        figure,
        "Reachable region and workspace, as in Fig. 3 of the paper, our model",
        f"{_ratios(problem, chosen)}; arms of the right limb from {low:.2f} to {high:.2f} deg; "
        f"the top edge is {'tangent' if found.tangent else 'not tangent'} to the upper arcs",
    )
    axes = plots.panel(figure, (0.085, 0.085, 0.9, 0.81))
    _draw_region(axes, machine, found)
    return figure


def torque_maps(problem: DesignProblem) -> Figure:
    """Draw tau_G over (lam_l, lam_H) for the three lam_e of Fig. 4."""
    figure = plots.new_figure(WIDTH, 2.75)
    plots.headline(
        figure,
        f"{plots.symbol('tau_G')} over the design space, as in Fig. 4 of the paper, our model",
        "inertia as printed; dashed: the least at each "
        f"{plots.symbol('lam_l')}; grey: out of reach",
    )
    levels = np.round(np.arange(0.38, 0.541, 0.01), 2).tolist()
    for k, lam_e in enumerate(SCAN.fig4):
        cut = plots.Slice.of(problem, *WINDOW, {"lam_e": lam_e}, columns=201, rows=201)
        axes = _map_panel(figure, k, 3, f"{plots.symbol('lam_e')} = {lam_e:g}")
        plots.draw_slice(axes, cut, "tau_G", levels=levels, bar=k == 2)
        plots.draw_valley(axes, cut, "tau_G")
    return figure


def sigma_maps(problem: DesignProblem) -> Figure:
    """Draw the extreme singular values over (lam_l, lam_H), with the bounds of Figs 5 and 6."""
    figure = plots.new_figure(WIDTH, 3.3)
    lam_e = SCAN.fig5_6
    plots.headline(
        figure,
        "Singular values over the design space, as in Figs 5 and 6 of the paper, our model",
        f"{plots.symbol('lam_e')} = {lam_e:g}; red: the bounds that the paper draws",
    )
    cut = plots.Slice.of(problem, *WINDOW, {"lam_e": lam_e}, columns=241, rows=241)
    upper = np.round(np.arange(1.2, 3.01, 0.1), 1).tolist()
    lower = np.round(np.arange(0.5, 1.01, 0.05), 2).tolist()
    for k, (index, levels, bounds) in enumerate(
        (("sigma_max", upper, SCAN.b_u), ("sigma_min", lower, SCAN.b_l))
    ):
        axes = _map_panel(figure, k, 2, f"{'largest' if k == 0 else 'smallest'} over the workspace")
        plots.draw_slice(axes, cut, index, levels=levels)
        plots.draw_bounds(axes, cut, index, bounds)
    return figure


def wedge(problem: DesignProblem) -> Figure:
    """Draw the feasible wedge at the printed lam_e, with the designs that matter."""
    reference = problem.reference
    lam_e = reference.design["lam_e"]
    figure = plots.new_figure(WIDTH, 3.3)
    plots.headline(
        figure,
        f"The feasible wedge at {plots.symbol('lam_e')} = {lam_e:g}, as in Fig. 8 of the paper, "
        "our model",
        "hatched: infeasible; at the apex the top edge and the bottom corner are on the bound",
    )
    apex = reference.optimum("tau_G_at_printed_lam_e").design
    designs = {"paper": reference.design, "grid": _best_on_grid(lam_e), "polished": apex}
    rows = np.array([problem.design(values) for values in designs.values()])
    torque = problem.evaluate(rows).objectives[:, 0]
    names = [f"{name}  {value:.4f}" for name, value in zip(designs, torque, strict=True)]
    torque_label = plots.label("tau_G", "N m/(m/s^2)")
    windows = (
        (("lam_l", 1.6, 3.4), ("lam_H", 0.8, 2.8)),
        (("lam_l", 2.42, 2.70), ("gap", 0.37, 0.45)),
    )
    for k, window in enumerate(windows):
        cut = plots.Slice.of(problem, *window, {"lam_e": lam_e}, columns=241, rows=241)
        axes = _map_panel(
            figure, k, 2, "all that is in reach" if k == 0 else "near the apex", y=cut.y
        )
        levels = np.arange(0.32, 0.401, 0.005) if k == 0 else np.arange(0.334, 0.3521, 0.001)
        plots.draw_slice(axes, cut, "tau_G", levels=levels.tolist())
        plots.draw_infeasible(axes, cut)
        points = [(values["lam_l"], _height(values, cut.y)) for values in designs.values()]
        plots.mark(
            axes, dict(zip(names, points, strict=True)), loc="upper left", title=torque_label
        )
    return figure


def intervals(problem: DesignProblem) -> Figure:
    """Draw the least tau_G against lam_e for the six intervals of Fig. 7, and the active bound."""
    figure = plots.new_figure(WIDTH, 4.2)
    plots.headline(
        figure,
        f"Least {plots.symbol('tau_G')} against {plots.symbol('lam_e')}, "
        "as in Fig. 7 of the paper, our model",
        "a line an interval of the singular values, ending where no design is feasible; dotted: "
        f"the four {plots.symbol('lam_e')} of the paper",
    )
    for k, preset in enumerate(("printed", "static")):
        box = (0.075 + 0.5 * k, 0.105, 0.415, 0.71)
        axes = plots.panel(
            figure, box, x=plots.label("lam_e", ""), y=plots.label("tau_G", "N m/(m/s^2)"),
            title=f"inertia preset “{preset}”",
        )  # fmt: skip
        _draw_intervals(axes, problem, _solved(preset))
    _explain_marks(axes)
    return figure


def cycle(problem: DesignProblem, design: FloatArray | None = None) -> Figure:
    """Draw a design's torque over the pick-and-place cycle, its parts, the torque-speed plane."""
    whose = "printed" if design is None else "given"
    machine = problem.mechanism(problem.printed_design() if design is None else design)
    assert isinstance(machine, Diamond)
    width, lift, time, overlap = cycle_path(packed_task(problem.task))
    found = driven(machine, problem.task)
    figure = plots.new_figure(WIDTH, 3.2)
    plots.headline(
        figure,
        f"Drive torque over our pick-and-place cycle, {whose} design, full model",
        f"{1e3 * width:.0f} mm across, {1e3 * lift:.1f} mm up, {time:g} s, overlap {overlap:g}",
    )
    parts = {name: part[:, 0] for name, part in found.parts.items()}
    _draw_torque(figure, 1e3 * found.time, found.total[:, 0], parts)
    _draw_torque_speed(figure, found.rates, found.total)
    return figure


PICTURES = {
    "diamond": {
        **machine_pictures("diamond"),
        "fig3_region": Picture("the reachable region and the workspace, as in Fig. 3", region),
        "fig4_torque": Picture("tau_G over the design space, as in Fig. 4", torque_maps),
        "fig5_6_sigma": Picture(
            "singular values over the design space, as in Figs 5, 6", sigma_maps
        ),
        "fig7_intervals": Picture("least tau_G against lam_e, as in Fig. 7", intervals),
        "fig8_wedge": Picture("the feasible wedge at the printed lam_e, as in Fig. 8", wedge),
        "cycle": Picture("drive torque over our pick-and-place cycle", cycle, any_design=True),
    }
}


def _ratios(problem: DesignProblem, design: FloatArray) -> str:
    """Return lam_e, lam_l and lam_H of a design in words."""
    sizes = problem.sizes(problem.complete(design[None])[0])
    return ", ".join(f"{plots.symbol(name)} = {value:.4g}" for name, value in sizes.items())


def _draw_region(axes: Axes, machine: Diamond, found: Region) -> None:
    """Draw the machine with its four arcs, the elbows that they are about, and what they touch."""
    plots.draw_machine(axes, machine, poses=np.array([[0.0, -machine.H - 0.5 * machine.h]]))
    faint = plots.STYLE["faint"]
    names = ("B_1'", "B_2'", "B_1''", "B_2''"), ("P_1", "P_2", "Q_1", "Q_2")
    for k, (elbow, arc, touching) in enumerate(
        zip(1e3 * found.elbows, 1e3 * found.arcs, 1e3 * found.touching, strict=True)
    ):
        text = "about the elbows at their highest" if k < 2 else "about the elbows at their lowest"
        axes.plot(
            *arc.T, color=plots.STYLE["lines"][k // 2], linewidth=1.8, zorder=3.5,
            label=f"arcs {text}" if k % 2 == 0 else None,
        )  # fmt: skip
        axes.plot(
            *np.stack([elbow, touching]).T, color=faint, linewidth=0.8, linestyle="--", zorder=2.5
        )
        axes.plot(*elbow, marker="o", markersize=5, color="white", markeredgecolor=faint, zorder=5)
        side = "left" if elbow[0] > 0.0 else "right"
        away = 7 if side == "left" else -7
        plots.remark(axes, f"${names[0][k]}$", tuple(elbow), dot=False, xytext=(away, 4), ha=side)
        side, away = ("left", 6) if touching[0] > 0.0 else ("right", -6)
        plots.remark(
            axes, f"${names[1][k]}$", tuple(touching), xytext=(away, 5 if k < 2 else -11), ha=side
        )
    plots.legend(axes, loc="lower right")


def _height(values: Mapping[str, float], name: str) -> float:
    """Return gap or lam_H of named variables."""
    return values["gap"] + (values["lam_l"] - 1.0 if name == "lam_H" else 0.0)


def _best_on_grid(lam_e: float) -> Mapping[str, float]:
    """Return the best feasible design of the grid, its steps ours, at one lam_e."""
    problem = make_problem("diamond", fixed={"lam_e": lam_e})
    grid = problem.grid()
    assert grid is not None
    return problem.named(grid[problem.evaluate(grid).best()])


def _map_panel(figure: Figure, k: int, count: int, title: str, y: str = "lam_H") -> Axes:
    """Add the k-th of ``count`` panels over lam_l and ``y``; the last has room for a colour bar."""
    height = figure.get_figheight()
    bar = 0.105 if count == 2 else 0.0
    room = (0.995 if count == 2 else 0.9) / count
    box = (0.068 + room * k, 0.42 / height, room - 0.055 - bar, 1.0 - 1.12 / height)
    return plots.panel(
        figure,
        box,
        x=plots.label("lam_l", ""),
        y=plots.label(y, "") if k == 0 or count == 2 else "",
        title=title,
    )


def _solved(preset: str) -> list[Solutions]:
    """Solve the six intervals at every lam_e of the scan, in the box of lam_l and gap."""
    solved = []
    for lam_e in SWEPT.tolist():
        problem = make_problem("diamond", fixed={"lam_e": lam_e}, inertia=preset)
        rows = [problem.pack({"sigma_low": low, "sigma_high": high}) for low, high in INTERVALS]
        solved.append(solve_tasks(problem, np.array(rows)))
    return solved


def _draw_intervals(axes: Axes, problem: DesignProblem, solved: list[Solutions]) -> None:
    optima = np.array([solution.optima for solution in solved])
    active = np.array([solution.active for solution in solved])
    designs = np.array([solution.designs for solution in solved])  # lam_l, gap
    at_edge = np.isclose(designs, problem.low[1:]) | np.isclose(designs, problem.high[1:])
    cut = at_edge.any(axis=-1) & np.isfinite(optima)
    for lam_e in PRINTED:
        axes.axvline(lam_e, color=plots.STYLE["faint"], linewidth=0.8, linestyle=":", zorder=1)
    for j, (low, high) in enumerate(INTERVALS):
        color = plots.STYLE["lines"][j]
        axes.plot(SWEPT, optima[:, j], color=color, linewidth=1.2, label=f"[{low:g}, {high:g}]")
        marks = [
            (marker, active[:, j, problem.constraint_names.index(name)])
            for name, (marker, _) in BOUNDS.items()
        ]
        for marker, at in [*marks, (CUT[0], cut[:, j])]:
            _draw_marks(axes, SWEPT[at], optima[at, j], marker, color)
    plots.legend(axes, loc="upper right", title="interval")


def _explain_marks(axes: Axes) -> None:
    """Give the legend of the marks, in place of the curves'."""
    handles = [
        _draw_marks(axes, [], [], marker, plots.STYLE["faint"], label=text)
        for marker, text in (*BOUNDS.values(), CUT)
    ]
    plots.legend(axes, loc="upper right", handles=handles)


def _draw_marks(
    axes: Axes, x: ArrayLike, y: ArrayLike, marker: str, color: str, label: str | None = None
) -> Line2D:
    """Draw marks of one kind; that of a cut curve is a ring about the others."""
    ring = marker == CUT[0]
    (line,) = axes.plot(
        x, y, linestyle="none", marker=marker, markersize=9.0 if ring else 4.5, color=color,
        fillstyle="none" if ring else "full", markeredgewidth=0.9, label=label,
    )  # fmt: skip
    return line


def _draw_torque(
    figure: Figure, t: FloatArray, total: FloatArray, parts: Mapping[str, FloatArray]
) -> None:
    """Draw one drive's torque over time, and what it is made of."""
    axes = plots.panel(
        figure, (0.075, 0.14, 0.46, 0.64), x="time (ms)", y="torque (N·m)", title="right drive"
    )
    for (name, values), color in zip(parts.items(), plots.STYLE["lines"], strict=False):
        axes.plot(t, values, color=color, linewidth=1.0, label=name)
    axes.plot(t, total, color=plots.STYLE["ink"], linewidth=1.8, label="total")
    peak = int(np.abs(total).argmax())
    rms = float(np.sqrt(np.trapezoid(total**2, t) / t[-1]))
    axes.axhline(rms, color=plots.STYLE["faint"], linewidth=0.8, linestyle="--")
    peak_text = f"peak {abs(total[peak]):.2f} N·m"
    plots.remark(axes, peak_text, (t[peak], total[peak]), xytext=(-7, 2), ha="right")
    plots.remark(axes, f"rms {rms:.2f} N·m", (t[-1], rms), xytext=(-52, 4), ha="right", dot=False)
    axes.set_xlim(t[0], t[-1])
    plots.legend(axes, loc="lower left")


def _draw_torque_speed(figure: Figure, rates: FloatArray, torques: FloatArray) -> None:
    """Draw both drives in the torque-speed plane, what a motor is chosen by."""
    axes = plots.panel(figure, (0.635, 0.14, 0.35, 0.64), x="arm rate (rad/s)", y="torque (N·m)")
    for k, name in enumerate(("right drive", "left drive")):
        axes.plot(
            rates[:, k], torques[:, k], color=plots.STYLE["lines"][k], linewidth=1.4, label=name
        )
    power = np.abs(rates * torques)
    at, limb = np.unravel_index(power.argmax(), power.shape)
    plots.remark(
        axes,
        f"{power.max():.0f} W",
        (rates[at, limb], torques[at, limb]),
        xytext=(-7, 2),
        ha="right",
    )
    plots.legend(axes, loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2)
