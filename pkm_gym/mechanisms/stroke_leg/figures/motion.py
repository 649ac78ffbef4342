"""Figures of the leg in motion: the trot (Fig. 6), its cylinders (Fig. 7), its twin (Fig. 8)."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.stroke_leg.figures.leg import WIDTH, draw_leg, leg_of, printed_leg
from pkm_gym.mechanisms.stroke_leg.mechanism import Leg
from pkm_gym.mechanisms.stroke_leg.step import TROT, Step

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

ERROR = 1.6  # 1e-6 m/s, of Fig. 8
LEGS = ("left front", "right front", "left rear", "right rear")
HIPS = {"front": 0.55, "rear": -0.55}  # m, along the body
FPS = 20.0


def trot(problem: DesignProblem) -> Figure:
    """Draw which feet stand over two periods, and the robot at four instants."""
    machine, step = printed_leg(problem), Step()
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


def trot_frames(problem: DesignProblem, design: FloatArray | None = None) -> Iterator[Figure]:
    """Draw a period of a design's trot, the printed one's if none is given, a figure a frame."""
    machine, step = leg_of(problem, design), Step()
    for time in np.arange(0.0, step.period, 1.0 / FPS).tolist():
        figure = plots.new_figure(6.4, 3.9)
        axes = plots.panel(figure, (0.0, 0.0, 1.0, 1.0))
        draw_robot(axes, machine, step, time)
        yield figure


def draw_robot(axes: Axes, machine: Leg, step: Step, time: float) -> None:
    """Draw a robot of four legs in a trot from its left, its right legs as ghosts."""
    for name, phase in sorted(zip(LEGS, TROT, strict=True), key=lambda leg: leg[0] < "m"):
        foot = step.motion(np.array(time), phase).position
        left, hip = name.startswith("left"), HIPS[name.split()[1]]
        draw_leg(axes, machine, foot, at=hip, alpha=1.0 if left else 0.25, layer=5 if left else 2)
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


def speeds(problem: DesignProblem) -> Figure:
    """Draw lengths and speeds of both cylinders over a step, as Fig. 7."""
    machine, step = printed_leg(problem), Step()
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


def speed_errors(problem: DesignProblem) -> Figure:
    """Draw the twin's piston speeds against the Jacobian's along a step, as Fig. 8."""
    machine = printed_leg(problem)
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
