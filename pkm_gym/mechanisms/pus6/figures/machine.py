"""The machine: its frames, and two layouts side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Arc

from pkm_gym import plots
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import make_problem
from pkm_gym.mechanisms.pus6.figures.common import WIDTH, machine, optimum, printed
from pkm_gym.mechanisms.pus6.mechanism import Pus6
from pkm_gym.plots.pictures import Picture
from pkm_gym.plots.style import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]  # it has no types

    from pkm_gym.core.problem import DesignProblem

HOME = np.zeros(6)


def frames(problem: DesignProblem) -> Figure:
    """Draw both frames and hexagons from above, and the machine from the side, at home."""
    made = printed(problem)
    figure = plots.new_figure(WIDTH, 4.85)
    plots.headline(
        figure,
        "Frames and hexagons of the printed design at home, as in Fig. 2 of the paper, our model",
        f"from above and from the front; $L$ {1e3 * made.L:.0f}, $R$ {1e3 * made.R:.0f}, $r_B$ "
        f"{1e3 * made.r_B:.0f} mm; the home height of the sliders over the S joints is "
        f"{1e3 * made.h0:.2f} mm",
    )
    above = plots.panel(figure, (0.075, 0.1, 0.52, 0.78), x="x (mm)", y="y (mm)")
    _draw_above(above, made)
    _draw_angles(above, made)
    above.set(xlim=(-450, 450), ylim=(-400, 470))
    front = plots.panel(figure, (0.69, 0.1, 0.3, 0.78), x="x (mm)", y="z (mm)")
    points = made.points(HOME)
    for leg in range(6):
        slider, joint = 1e3 * points["A"][leg], 1e3 * points["C"][leg]
        front.plot([slider[0]] * 2, [-40, 620], color=plots.STYLE["base"], linewidth=2, alpha=0.35)
        front.plot(
            [slider[0], joint[0]], [slider[2], joint[2]], color=plots.STYLE["rod"], linewidth=2.2,
            marker="o", markersize=4, markerfacecolor="white",
        )  # fmt: skip
    front.plot([-190, 190], [0, 0], color=plots.STYLE["platform"], linewidth=3, zorder=4)
    front.set_aspect("equal", adjustable="box", anchor="S")
    front.set(xlim=(-420, 420), ylim=(-60, 640))
    return figure


def layouts(problem: DesignProblem) -> Figure:
    """Draw the printed machine beside the optimum with free angles, from above and in space."""
    del problem
    layout = make_problem("pus6_layout")
    designs = {
        "printed": layout.design(make_problem("pus6").reference.design),
        "optimum with free angles": optimum("pus6_layout"),
    }
    figure = plots.new_figure(WIDTH, 7.3)
    plots.headline(
        figure,
        "The printed machine and the optimum with free angles, to scale",
        "at home, from above and in space; right: the S joints in pairs as close as the rods may "
        "come; square: the box of the task",
    )
    for k, (title, design) in enumerate(designs.items()):
        made = machine(layout, design)
        above = plots.panel(
            figure, (0.085 + 0.485 * k, 0.52, 0.41, 0.38), x="x (mm)", y="" if k else "y (mm)",
            title=title,
        )  # fmt: skip
        _draw_above(above, made, letters=False)
        _draw_pairs(above, made)
        above.set(xlim=(-470, 470), ylim=(-400, 450))
        axes = figure.add_axes(
            (0.04 + 0.485 * k, 0.105, 0.46, 0.355), projection="3d", computed_zorder=False
        )
        _draw_in_space(axes, made)
        figure.text(
            0.085 + 0.485 * k, 0.015, _measured(layout, design), linespacing=1.5, **words("small")
        )
    return figure


PICTURES = {
    "fig2": Picture("frames and hexagons, as in Fig. 2", frames),
    "layout": Picture("the printed machine beside the optimum with free angles", layouts),
}


def _draw_above(axes: Axes, made: Pus6, *, letters: bool = True) -> None:
    """Draw screws, rods, platform and box from above, mm."""
    points = {name: 1e3 * values[:, :2] for name, values in made.points(HOME).items()}
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    for radius in (made.r_B, made.R):
        axes.plot(
            1e3 * radius * np.cos(turn), 1e3 * radius * np.sin(turn), color=plots.STYLE["faint"],
            linewidth=0.6, linestyle=":", zorder=1,
        )  # fmt: skip
    around = np.argsort(np.arctan2(points["C"][:, 1], points["C"][:, 0]))
    ring = points["C"][np.append(around, around[0])]
    axes.fill(*ring.T, color=plots.STYLE["platform"], alpha=0.25, linewidth=0.0, zorder=2)
    axes.plot(*ring.T, color=plots.STYLE["platform"], linewidth=2.0, zorder=3)
    for screw, joint in zip(points["A"], points["C"], strict=True):
        axes.plot(
            *np.array([screw, joint]).T, color=plots.STYLE["rod"], linewidth=2.2, zorder=4,
            marker="o", markersize=4, markerfacecolor="white",
        )  # fmt: skip
        axes.plot(*screw, marker="o", markersize=9, color=plots.STYLE["base"], zorder=3.5)
    axes.plot(*1e3 * made.workspace().T, color="#d55e00", linewidth=1.0, zorder=5)
    if letters:
        for leg, (screw, joint) in enumerate(zip(points["A"], points["C"], strict=True), 1):
            plots.remark(axes, f"$A_{leg}$", tuple(1.13 * screw), dot=False, ha="center",
                         xytext=(0, -3))  # fmt: skip
            plots.remark(axes, f"$C_{leg}$", tuple(1.15 * joint), dot=False, ha="center",
                         xytext=(0, -3))  # fmt: skip
    axes.set_aspect("equal", adjustable="box")


def _draw_pairs(axes: Axes, made: Pus6) -> None:
    """Mark how far the S joints of a corner and the screws of a column are apart, mm."""
    for letter, legs, place in (("C", [0, 5], (9, 3)), ("A", [0, 1], (0, 12))):
        ends = 1e3 * made.points(HOME)[letter][legs, :2]
        apart = float(np.linalg.norm(ends[0] - ends[1]))
        axes.plot(*ends.T, color=plots.STYLE["bad"], linewidth=1.6, zorder=4.5)
        plots.remark(
            axes, f"{apart:.0f} mm", tuple(ends.mean(axis=0)), dot=False, xytext=place,
            ha="center" if letter == "A" else "left",
        )  # fmt: skip


def _draw_angles(axes: Axes, made: Pus6) -> None:
    """Draw the axes of the base and the two angles."""
    ink = {"color": plots.STYLE["ink"], "linewidth": 0.9}
    for tip, name, shift in (((150, 0), "x", (7, -3)), ((0, 150), "y", (0, 6))):
        axes.annotate("", tip, (0, 0), arrowprops={"arrowstyle": "->", **ink}, zorder=6)
        plots.remark(axes, name, tip, dot=False, ha="center", xytext=shift)
    for middle, angle, radius, name in (
        (90.0, made.phi_A, 1e3 * made.r_B, "phi_A"), (30.0, made.phi_C, 1e3 * made.R, "phi_C"),
    ):  # fmt: skip
        half, size = 0.5 * np.degrees(angle), 1.72 * radius
        axes.add_patch(Arc((0, 0), size, size, theta1=middle - half, theta2=middle + half, **ink))
        for side in (-half, half):
            ray = np.radians(middle + side)
            axes.plot(
                [0, radius * np.cos(ray)], [0, radius * np.sin(ray)], linestyle="--", zorder=5,
                **{**ink, "linewidth": 0.6},
            )  # fmt: skip
        ray = np.radians(middle)
        place = (0.5 * size * np.cos(ray), 0.5 * size * np.sin(ray))
        text = f"{plots.symbol(name)} {np.degrees(angle):.0f}°"
        side = "center" if middle == 90.0 else "left"
        plots.remark(axes, text, place, dot=False, xytext=(0 if middle == 90.0 else 12, 3), ha=side)


def _draw_in_space(axes: Axes3D, made: Pus6) -> None:
    """Draw screws, rods and platform in space, mm."""
    points = {name: 1e3 * values for name, values in made.points(HOME).items()}
    low, high = -60.0, 1e3 * made.home + 140.0
    around = np.argsort(np.arctan2(points["C"][:, 1], points["C"][:, 0]))
    ring = points["C"][np.append(around, around[0])]
    axes.plot(*ring.T, color=plots.STYLE["platform"], linewidth=2.6, zorder=5)
    for screw, joint in zip(points["A"], points["C"], strict=True):
        x, y = screw[:2]
        axes.plot([x, x], [y, y], [low, high], color=plots.STYLE["base"], linewidth=2.4, alpha=0.4)
        axes.plot(
            *np.array([screw, joint]).T, color=plots.STYLE["rod"], linewidth=2.0, marker="o",
            markersize=3.5, markerfacecolor="white", zorder=4,
        )  # fmt: skip
    reach = 1e3 * made.r_B
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(low, high))
    axes.set_box_aspect((2.0 * reach, 2.0 * reach, high - low), zoom=1.15)
    axes.view_init(22.0, -68.0)
    axes.patch.set_alpha(0.0)  # or it covers its neighbour's words
    axes.tick_params(labelsize=plots.STYLE["small"] - 1, pad=-2)
    axes.locator_params(nbins=4)
    small = {"fontsize": plots.STYLE["small"], "fontfamily": plots.STYLE["font"], "labelpad": -5}
    axes.set_xlabel("x (mm)", **small)
    axes.set_ylabel("y (mm)", **small)
    axes.set_zlabel("z (mm)", **small)


def _measured(problem: DesignProblem, design: FloatArray) -> str:
    """Return a design's numbers as lines."""
    found = {k: float(v[0]) for k, v in problem.evaluate(design[None]).indices.items()}
    named = problem.named(design)
    sizes = ", ".join(
        f"{plots.symbol(name)} {plots.shown(named[name], unit)[0]:.1f} {unit_name}"
        for name, unit, unit_name in (
            ("L", "m", "mm"), ("R", "m", "mm"), ("phi_A", "rad", "deg"), ("phi_C", "rad", "deg")
        )
    )  # fmt: skip
    return (
        f"{sizes}\nbalanced {found['balanced']:.3f}, stroke {1e3 * found['stroke']:.0f} mm, rod "
        f"tilt {np.degrees(found['rod_tilt']):.1f}°,\nS joints {np.degrees(found['s_cone']):.1f}°, "
        f"rods {1e3 * found['clearance']:.0f} mm apart"
    )
