"""The leg's figures: Figs 3-8 of the paper with our model, the machine, thrust against flow."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.core.mechanism import Link
from pkm_gym.core.solve import solve_tasks
from pkm_gym.mechanisms.stroke_leg.mechanism import Leg
from pkm_gym.mechanisms.stroke_leg.step import TROT, Step
from pkm_gym.mechanisms.stroke_leg.workspace import StrokeLeg
from pkm_gym.plots.machine import draw_links
from pkm_gym.plots.maps import colour_bar, hatch
from pkm_gym.plots.pictures import Animation, Picture, machine_pictures

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import BoolArray, FloatArray

WIDTH = 7.2  # inches, a page's two columns
PRINTED_EXTENT = (1200.0, 500.0)  # mm, of Fig. 3, as the text says
PRINTED_RANGES = {"eta_P": (4.0544, 7.9328), "eta_FC": (0.07151, 0.16766), "eta_DL": (1.002, 1.701)}
SWEPT = ("l1", "l6", "l3", "phi", "th3")  # Fig. 5 (a) to (e)
NARROW = np.radians(15.0)  # swing with which most of the sweeps keeps off the dead line
FAR = np.radians(60.0)  # swing of the map, so that both dead lines can be seen
ERROR = 1.6  # 1e-6 m/s, of Fig. 8
LEGS = ("left front", "right front", "left rear", "right rear")
HIPS = {"front": 0.55, "rear": -0.55}  # m, along the body
GAIT_RATES = np.linspace(0.1, 0.16, 5)
FPS = 20.0


def workspace(problem: DesignProblem) -> Figure:
    """Draw the crown of the stated rectangle, its exact extent and the printed one."""
    machine = _printed(problem)
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
    _draw_leg(axes, machine, pose, alpha=0.9)
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


def condition(problem: DesignProblem) -> Figure:
    """Draw the condition number of the printed design with its dead lines, and cuts through it."""
    machine = _printed(problem)
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


def trot(problem: DesignProblem) -> Figure:
    """Draw which feet stand over two periods, and the robot at four instants."""
    machine, step = _printed(problem), Step()
    figure = plots.new_figure(WIDTH, 6.6)
    plots.headline(
        figure,
        "The trot, as in Fig. 6 of the paper, our model",
        f"printed design; diagonal legs in step: period {step.period:g} s, stride "
        f"{1e3 * step.stride:.0f} mm, lift {1e3 * step.lift:.0f} mm, duty {step.duty:g} (a step "
        "of ours: the paper prints none)",
    )
    axes = plots.panel(
        figure, (0.115, 0.72, 0.865, 0.165), x="time (s)", title="feet on the ground"
    )
    for row, phase in enumerate(TROT):
        color = plots.STYLE["lines"][0 if phase == 0.0 else 1]
        starts = step.period * (np.arange(-1, 3) + 1.0 - step.duty - phase)
        spans = [(start, step.duty * step.period) for start in starts.tolist()]
        axes.broken_barh(spans, (3 - row - 0.36, 0.72), facecolor=color)
    axes.set_yticks(range(4), LEGS[::-1])
    axes.set(xlim=(0.0, 2.0 * step.period), ylim=(-0.6, 3.6))
    axes.locator_params(axis="x", nbins=5)
    for k, time in enumerate((0.0, 0.25, 0.5, 0.75)):
        row, column = divmod(k, 2)
        axes = plots.panel(
            figure, (0.015 + 0.495 * column, 0.345 - 0.335 * row, 0.475, 0.285),
            title=f"t = {time * step.period:g} s",
        )  # fmt: skip
        draw_robot(axes, machine, step, time * step.period)
    return figure


def trot_frames(problem: DesignProblem) -> Iterator[Figure]:
    """Draw a period of the trot, a figure a frame."""
    machine, step = _printed(problem), Step()
    for time in np.arange(0.0, step.period, 1.0 / FPS).tolist():
        figure = plots.new_figure(6.4, 3.9)
        axes = plots.panel(figure, (0.0, 0.0, 1.0, 1.0))
        draw_robot(axes, machine, step, time)
        yield figure


def speeds(problem: DesignProblem) -> Figure:
    """Draw lengths and speeds of both cylinders over a step, as Fig. 7."""
    machine, step = _printed(problem), Step()
    times = np.linspace(0.0, step.period, 801)
    foot = step.motion(times)
    lengths = 1e3 * machine.inverse_kinematics(foot.position)
    rates = 1e3 * np.einsum("nij,nj->ni", machine.inverse_jacobian(foot.position), foot.velocity)
    figure = plots.new_figure(WIDTH, 3.3)
    plots.headline(
        figure,
        "Cylinders over a step, as in Fig. 7 of the paper, our model",
        f"printed design; cycloid of {1e3 * step.stride:.0f} mm stride and "
        f"{1e3 * step.lift:.0f} mm lift, hip {1e3 * step.hip_height:.0f} mm high, foot up to "
        f"{1e3 * np.linalg.norm(foot.velocity, axis=-1).max():.0f} mm/s (a step of ours)",
    )
    for k, (name, values) in enumerate(
        (("piston speed (mm/s)", rates), ("cylinder length (mm)", lengths))
    ):
        axes = plots.panel(figure, (0.082 + 0.5 * k, 0.14, 0.4, 0.68), x="time (s)", y=name)
        _shade_swing(axes, step)
        for limb, (letters, color) in enumerate(
            zip(("AB, $l_2$", "CD, $l_4$"), plots.STYLE["lines"], strict=False)
        ):
            axes.plot(times, values[:, limb], color=color, linewidth=1.5, label=letters)
            if k == 0:
                at = int(np.abs(values[:, limb]).argmax())
                text = f"{abs(values[at, limb]):.1f} mm/s"
                below = values[at, limb] < 0.0
                plots.remark(
                    axes, text, (times[at], values[at, limb]), ha="center",
                    xytext=(0, -11 if below else 6),
                )  # fmt: skip
        axes.set_xlim(0.0, step.period)
        axes.margins(y=0.24)
        axes.locator_params(axis="x", nbins=5)
        plots.legend(axes, loc="lower right" if k == 0 else "upper center", title="cylinder")
    return figure


def speed_errors(problem: DesignProblem) -> Figure:
    """Draw the twin's piston speeds against the Jacobian's along a step, as Fig. 8."""
    machine = _printed(problem)
    driven = import_module(machine.twin_module).piston_speeds(machine)
    error = 1e6 * (driven.twin - driven.analytic)
    figure = plots.new_figure(WIDTH, 3.3)
    plots.headline(
        figure,
        "Piston speeds, theory against simulation, as in Fig. 8 of the paper, our model",
        f"{len(driven.times)} samples in {driven.times[-1]:g} s; simulation: the MuJoCo twin; "
        "theory: the corrected Jacobian at the foot's motion there",
    )
    axes = plots.panel(
        figure, (0.082, 0.14, 0.39, 0.64), x="time (s)", y="piston speed (mm/s)", title="speeds"
    )
    beside = plots.panel(
        figure, (0.6, 0.14, 0.375, 0.64), x="time (s)", y="error (10⁻⁶ m/s)",
        title=f"simulation − theory, at most {np.abs(error).max():.2g}·10⁻⁶ m/s",
    )  # fmt: skip
    for limb, (name, color) in enumerate(zip(("AB", "CD"), plots.STYLE["lines"], strict=False)):
        axes.plot(
            driven.times, 1e3 * driven.analytic[:, limb], color=color, linewidth=1.2,
            label=f"{name}, theory",
        )  # fmt: skip
        axes.plot(
            driven.times[::5], 1e3 * driven.twin[::5, limb], color=color, linestyle="none",
            marker="o", markersize=3.2, markerfacecolor="white", label=f"{name}, simulation",
        )  # fmt: skip
        beside.plot(driven.times, error[:, limb], color=color, linewidth=1.0, label=name)
    for sign in (-1.0, 1.0):
        beside.axhline(sign * ERROR, color=plots.STYLE["bad"], linewidth=0.9, linestyle="--")
    beside.plot([], [], color=plots.STYLE["bad"], linestyle="--", label="±1.6, the paper's")
    for each in (axes, beside):
        each.set_xlim(0.0, driven.times[-1])
        each.margins(y=0.4)
        each.locator_params(axis="x", nbins=5)
        plots.legend(each, loc="lower center", ncols=2 if each is axes else 3, columnspacing=1.0)
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
        _draw_leg(axes, machine, pose)
        _letter(axes, machine, pose)
        axes.plot(*1e3 * machine.workspace().T, color=plots.STYLE["faint"], linewidth=0.8)
        axes.set_aspect("equal", adjustable="box")
        axes.set(xlim=(-540.0, 540.0), ylim=(-1040.0, 320.0))
        axes.text(
            0.02, 0.99, _measured(problem, design), transform=axes.transAxes, va="top",
            fontsize=plots.STYLE["small"], fontfamily=plots.STYLE["font"], linespacing=1.4,
        )  # fmt: skip
    return figure


def thrust_against_rate(problem: DesignProblem) -> Figure:
    """Draw the least thrust of a gait's leg over the speed that its pistons may have."""
    tasks = np.array([problem.pack({"rate": rate}) for rate in GAIT_RATES.tolist()])
    solved = solve_tasks(problem, tasks)
    evaluation = problem.evaluate(solved.designs, tasks)
    figure = plots.new_figure(WIDTH, 3.3)
    plots.headline(
        figure,
        "A leg for a gait: thrust against flow",
        "the best leg of the default task for each limit of the pistons' speed; the paper has "
        "no such problem",
    )
    axes = plots.panel(
        figure, (0.082, 0.14, 0.4, 0.64), x="piston speed per foot speed, at most",
        y="cylinder forces, rms, per foot force", title="what can be had",
    )  # fmt: skip
    axes.plot(
        GAIT_RATES, solved.optima, color=plots.STYLE["lines"][0], marker="o", markersize=4.5,
        linewidth=1.4,
    )  # fmt: skip
    axes.fill_between(
        GAIT_RATES, solved.optima, solved.optima.min() * 0.95, facecolor="none",
        edgecolor=plots.STYLE["faint"], hatch="////", linewidth=0.0, alpha=0.6,
    )  # fmt: skip
    axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
    beside = plots.panel(
        figure, (0.58, 0.14, 0.405, 0.64), x="piston speed per foot speed, at most",
        y="length (mm)", title="by which dimensions",
    )  # fmt: skip
    for k, (name, text) in enumerate((("l1", "crank"), ("l", "side"), ("l6", "frame OC"))):
        lengths = 1e3 * evaluation.designs[:, [v.name for v in problem.variables].index(name)]
        beside.plot(
            GAIT_RATES, lengths, color=plots.STYLE["lines"][k + 1], marker="o", markersize=3.5,
            label=f"{text} {plots.symbol(name)}",
        )  # fmt: skip
    beside.set_ylim(0.0, 440.0)
    plots.legend(beside, loc="upper right", ncols=3)
    return figure


PICTURES = {
    "stroke_leg": {
        **machine_pictures("stroke_leg"),
        "fig3_workspace": Picture("the workspace, as in Fig. 3", workspace),
        "fig4_condition": Picture("condition number and dead lines, as in Fig. 4", condition),
        "fig5_sweeps": Picture("indices over each variable, as in Fig. 5", sweeps),
        "fig6_trot": Picture("the trot, as in Fig. 6", trot),
        "fig7_speeds": Picture("cylinders over a step, as in Fig. 7", speeds),
        "fig8_errors": Picture("piston speeds, theory against twin, as in Fig. 8", speed_errors),
        "comparison": Picture("printed design and verified optimum", comparison),
    },
    "stroke_leg_gait": {
        **machine_pictures("stroke_leg_gait", printed=False),
        "thrust_rate": Picture("least thrust over the pistons' speed", thrust_against_rate),
    },
}
ANIMATIONS = {"stroke_leg": {"trot": Animation("the trot of four legs", trot_frames, FPS)}}


def draw_robot(axes: Axes, machine: Leg, step: Step, time: float) -> None:
    """Draw a robot of four legs in a trot from its left, its right legs as ghosts."""
    for name, phase in sorted(zip(LEGS, TROT, strict=True), key=lambda leg: leg[0] < "m"):
        foot = step.motion(np.array(time), phase).position
        left, hip = name.startswith("left"), HIPS[name.split()[1]]
        _draw_leg(axes, machine, foot, at=hip, alpha=1.0 if left else 0.25, layer=5 if left else 2)
    ground = -1e3 * step.hip_height
    low, high = 1e3 * HIPS["rear"] - 330.0, 1e3 * HIPS["front"] + 480.0
    top = 1e3 * (machine.l3 * np.sin(machine.th3)) + 60.0
    outline = np.array([(low + 150, -25), (high, -25), (high, top), (low + 150, top)])
    axes.fill(*outline.T, color=plots.STYLE["base"], alpha=0.12, linewidth=0.0, zorder=1)
    axes.plot([low - 200, high + 200], [ground - 8] * 2, color=plots.STYLE["ink"], linewidth=1.2)
    moved = 1e3 * travel(step, time)
    marks = np.arange(-20, 21) * 100.0 - moved % 100.0
    for mark in marks[(marks > low - 200) & (marks < high + 170)].tolist():
        axes.plot(
            [mark, mark - 28], [ground - 10, ground - 40], color=plots.STYLE["faint"], linewidth=0.8
        )
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(low - 60, high + 60), ylim=(ground - 60, top + 30))
    axes.set_axis_off()


def travel(step: Step, time: float) -> float:
    """Return how far, m, the body has come: the feet that stand stay where they are."""
    half = step.duty * step.period
    halves, rest = divmod(time, half)
    part = rest / half
    return step.stride * (halves + part - np.sin(2.0 * np.pi * part) / (2.0 * np.pi))


def _printed(problem: DesignProblem) -> StrokeLeg:
    machine = problem.mechanism(problem.printed_design())
    assert isinstance(machine, StrokeLeg)
    return machine


def _draw_leg(
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


def _swept(
    problem: DesignProblem, name: str, values: FloatArray
) -> tuple[dict[str, FloatArray], BoolArray]:
    """Return the indices over one variable with the narrow swing, and where they are defined."""
    rows = np.repeat(problem.printed_design()[None], len(values), axis=0)
    rows[:, [v.name for v in problem.variables].index(name)] = values
    found = problem.evaluate(rows, problem.task.replace(swing=NARROW)).indices
    return {key: found[key] for key in PRINTED_RANGES}, np.isfinite(found["eta_P"])


def _raw_indices(problem: DesignProblem, name: str, values: FloatArray) -> dict[str, FloatArray]:
    """Return what the paper's grid gives on its own rectangle, a dead line or not."""
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


def _shade_swing(axes: Axes, step: Step) -> None:
    """Shade while the foot is in the air."""
    air = (1.0 - step.duty) * step.period
    axes.axvspan(0.0, air, color=plots.STYLE["grid"], alpha=0.6, linewidth=0.0, zorder=0)
    for at, text in ((0.5 * air, "swing"), (0.5 * (air + step.period), "stance")):
        axes.text(
            at, 0.99, text, transform=axes.get_xaxis_transform(), ha="center", va="top",
            fontsize=plots.STYLE["small"], color=plots.STYLE["faint"],
            fontfamily=plots.STYLE["font"],
        )  # fmt: skip
