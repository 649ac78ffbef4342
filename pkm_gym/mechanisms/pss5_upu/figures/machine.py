"""The machine and its frames, Figs 1 and 8, its limbs' frames, Fig. 2, and screws, Fig. 3."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.pss5_upu.figures.common import WIDE, WIDTH, printed
from pkm_gym.plots.pictures import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]  # it has no types

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray
    from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

FIFTHS = 2.0 * np.pi / 5.0 * np.arange(1, 6)
SHOWN = np.array([0.0, 0.0, 0.0, 0.0, 0.0])  # in the box: home
ASIDE = np.array([0.6, 0.4, 0.2, 0.6, -0.5])  # a pose at which the limbs differ


def schematic(problem: DesignProblem) -> Figure:
    """Draw the machine of Table 5's row 1 in space with its frames, and from above."""
    made = printed(problem)
    figure = plots.new_figure(WIDE, 5.0)
    plots.headline(
        figure,
        "The 5-PSS/UPU, row 1 of Table 5, as in Figs 1 and 8 of the paper, our model",
        f"five rails inclined by {np.degrees(made.theta):.0f}°, sliders b, rods, S joints a on the "
        f"platform, the UPU limb O p; r {1e3 * made.r:.0f}, R {1e3 * made.R:.0f}, "
        f"L {1e3 * made.L:.0f} mm, home {1e3 * made.z0:.1f} mm over the rails' feet",
    )
    axes = figure.add_axes((0.0, 0.0, 0.56, 0.93), projection="3d", computed_zorder=False)
    _draw_in_space(axes, made)
    above = plots.panel(figure, (0.63, 0.1, 0.36, 0.76), x="x (mm)", y="y (mm)", title="from above")
    _draw_above(above, made)
    return figure


def frames(problem: DesignProblem) -> Figure:
    """Draw the rails from above, as the paper's frames have them and as they are."""
    made = printed(problem)
    figure = plots.new_figure(WIDTH, 4.1)
    plots.headline(
        figure,
        "The limbs' frames from above, as in Fig. 2 of the paper, printed and corrected",
        "arrows: $y_i$, along the rails; printed, they point downwards, and rails 3 and 4 pass the "
        f"axis at {_aside(made):.0f} mm; dashed: the platform",
    )
    for k, (sign, title) in enumerate(
        ((-1.0, "printed: Rz(−δ) Rx(−θ)"), (1.0, "corrected: Rz(+δ) Rx(+θ)"))
    ):
        axes = plots.panel(
            figure, (0.085 + 0.49 * k, 0.11, 0.41, 0.71), x="x (mm)", y="" if k else "y (mm)",
            title=title,
        )  # fmt: skip
        _draw_rails(axes, made, limb_axes(made.theta, sign))
    return figure


def screws(problem: DesignProblem) -> Figure:
    """Draw the twist that goes into a limb, its wrench, and the twist that comes out."""
    made = printed(problem)
    pose = made.in_box(ASIDE)
    figure = plots.new_figure(WIDTH, 3.9)
    ratios = made.transmission(pose)[0]
    plots.headline(
        figure,
        "The screws of limb 1, as in Fig. 3 of the paper, our model",
        "in, out, and the force between them; the other sliders stand; λ = |$f·e$| = "
        f"{ratios[0]:.3f}, η = |$f·v$|/|$v$| = {ratios[1]:.3f}",
    )
    for k, (first, second) in enumerate(((0, 2), (0, 1))):
        axes = plots.panel(
            figure, (0.085 + 0.49 * k, 0.12, 0.41, 0.7), x="xyz"[first] + " (mm)",
            y="xyz"[second] + " (mm)", title=("from the side", "from above")[k],
        )  # fmt: skip
        _draw_screws(axes, made, pose, [first, second])
        if k == 1:
            plots.legend(axes, loc="lower right")
    return figure


PICTURES = {
    "fig1": Picture("the machine and its frames, as in Figs 1 and 8", schematic),
    "fig2": Picture("the limbs' frames, printed and corrected, as in Fig. 2", frames),
    "fig3": Picture("the screws of a limb, as in Fig. 3", screws),
}


def limb_axes(theta: float, sign: float) -> FloatArray:
    """Return y_i (5, 3) of the frames Rz(sign delta_i) Rx(sign theta), delta_i = 18 + 72 i deg."""
    delta = sign * (np.radians(18.0) + FIFTHS)
    cos, sin = np.cos(sign * theta), np.sin(sign * theta)
    return np.stack([-np.sin(delta) * cos, np.cos(delta) * cos, np.full(5, sin)], axis=-1)


def _aside(made: Pss5Upu) -> float:
    """Return how far from the axis the farthest of the rails passes as printed, mm."""
    feet, along = 1e3 * made.rails()[:, 0, :2], limb_axes(made.theta, -1.0)[:, :2]
    along = along / np.linalg.norm(along, axis=1, keepdims=True)
    return float(np.abs(feet[:, 0] * along[:, 1] - feet[:, 1] * along[:, 0]).max())


def _draw_in_space(axes: Axes3D, made: Pss5Upu) -> None:
    """Draw rails, rods, platform, UPU limb and frames, mm."""
    pose = made.in_box(SHOWN)
    points = {name: 1e3 * values for name, values in made.points(pose).items()}
    centre = 1e3 * pose[:3]
    for foot, tip in 1e3 * made.rails():
        axes.plot(*np.array([foot, foot + 0.75 * (tip - foot)]).T, color=plots.STYLE["base"],
                  linewidth=3.0, alpha=0.45)  # fmt: skip
    for slider, joint in zip(points["b"], points["a"], strict=True):
        axes.plot(
            *np.array([slider, joint]).T, color=plots.STYLE["rod"], linewidth=2.0, marker="o",
            markersize=4, markerfacecolor="white", zorder=5,
        )  # fmt: skip
    for name, color, width in (("B", "faint", 0.9), ("a", "platform", 2.6)):
        ring = points[name][[0, 1, 2, 3, 4, 0]]
        axes.plot(*ring.T, color=plots.STYLE[color], linewidth=width, zorder=4)
    axes.plot(*np.array([np.zeros(3), centre]).T, color=plots.STYLE["cylinder"], linewidth=3.0)
    for origin, letter, size in ((np.zeros(3), "O", 260.0), (centre, "p", 180.0)):
        for k in range(3):
            axes.plot(*np.array([origin, origin + size * np.eye(3)[k]]).T,
                      color=plots.STYLE["ink"], linewidth=0.9, zorder=6)  # fmt: skip
            tip = origin + 1.12 * size * np.eye(3)[k]
            axes.text(*tip, "xyz"[k], fontsize=plots.STYLE["small"])
        axes.text(*(origin - 60.0), letter, fontsize=plots.STYLE["text"])
    for k in range(5):
        for name, out in (("B", 1.13), ("b", 1.17), ("a", 1.13)):
            place = points[name][k] * (out, out, 1.0) - (0.0, 0.0, 12.0)
            axes.text(*place, f"${name}_{k + 1}$", fontsize=plots.STYLE["text"], zorder=7)
    reach = 1e3 * made.R
    axes.set(xlim=(-reach, reach), ylim=(-reach, reach), zlim=(0.0, 820.0))
    axes.set_box_aspect((2.0 * reach, 2.0 * reach, 820.0), zoom=1.12)
    axes.view_init(24.0, -58.0)
    axes.tick_params(labelsize=plots.STYLE["small"] - 1, pad=-2)
    axes.locator_params(nbins=5)
    small = {"fontsize": plots.STYLE["small"], "fontfamily": plots.STYLE["font"], "labelpad": -4}
    axes.set_xlabel("x (mm)", **small)
    axes.set_ylabel("y (mm)", **small)
    axes.set_zlabel("z (mm)", **small)


def _draw_above(axes: Axes, made: Pss5Upu) -> None:
    """Draw the machine from above at home and, pale, aside, mm."""
    for pose, alpha in ((made.in_box(SHOWN), 1.0), (made.in_box(ASIDE), 0.35)):
        points = {name: 1e3 * values[:, :2] for name, values in made.points(pose).items()}
        for slider, joint in zip(points["b"], points["a"], strict=True):
            axes.plot(
                *np.array([slider, joint]).T, color=plots.STYLE["rod"], linewidth=2.0, marker="o",
                markersize=4, markerfacecolor="white", alpha=alpha, zorder=4,
            )  # fmt: skip
        ring = points["a"][[0, 1, 2, 3, 4, 0]]
        axes.plot(*ring.T, color=plots.STYLE["platform"], linewidth=2.4, alpha=alpha, zorder=3)
    for foot, tip in 1e3 * made.rails()[..., :2]:
        axes.plot(*np.array([foot, tip]).T, color=plots.STYLE["base"], linewidth=3.0, alpha=0.25)
        axes.plot(*foot, marker="o", markersize=8, color=plots.STYLE["base"])
    for k, foot in enumerate(1e3 * made.rails()[:, 0, :2]):
        plots.remark(axes, f"$B_{k + 1}$", tuple(1.12 * foot), dot=False, ha="center",
                     xytext=(0, -3))  # fmt: skip
    axes.plot(*1e3 * made.workspace().T, color="#d55e00", linewidth=1.0, zorder=5)
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(-720, 800), ylim=(-760, 760))


def _draw_rails(axes: Axes, made: Pss5Upu, along: FloatArray) -> None:
    """Draw feet and the rails' directions ``along`` (5, 3) from above, mm."""
    feet = 1e3 * made.rails()[:, 0, :2]
    style: dict[str, Any] = {
        "arrowstyle": "-|>",
        "color": plots.STYLE["lines"][0],
        "linewidth": 2.0,
    }
    for k, (foot, e) in enumerate(zip(feet, along, strict=True)):
        axes.annotate("", foot + 420.0 * e[:2], foot, arrowprops=style, zorder=4)
        axes.plot(*foot, marker="o", markersize=7, color=plots.STYLE["base"], zorder=5)
        plots.remark(axes, f"$B_{k + 1}$", tuple(1.17 * foot), dot=False, xytext=(0, -3),
                     ha="center")  # fmt: skip
    turn = np.append(FIFTHS, FIFTHS[0])
    axes.plot(1e3 * made.r * np.cos(turn), 1e3 * made.r * np.sin(turn), linestyle="--",
              color=plots.STYLE["platform"], linewidth=1.6)  # fmt: skip
    axes.plot(0, 0, marker="+", markersize=9, color=plots.STYLE["ink"])
    axes.set_aspect("equal", adjustable="box")
    axes.set(xlim=(-1100, 1100), ylim=(-1100, 1100))
    axes.set_xticks(range(-1000, 1001, 500))
    axes.set_yticks(range(-1000, 1001, 500))


def _draw_screws(axes: Axes, made: Pss5Upu, pose: FloatArray, plane: list[int]) -> None:
    """Draw limb 1 with the directions of its screws in a plane, mm."""
    points = {name: 1e3 * values for name, values in made.points(pose).items()}
    foot, slider, joint = (points[name][0] for name in "Bba")
    rail = 1e3 * made.rails()[0]
    e = (rail[1] - rail[0]) / np.linalg.norm(rail[1] - rail[0])
    f = (joint - slider) / np.linalg.norm(joint - slider)
    omega, v = np.split(made.jacobian(pose)[:, 0], 2)
    out = v + np.cross(omega, (joint - 1e3 * pose[:3]) * 1e-3)
    ring = points["a"][[0, 1, 2, 3, 4, 0]]
    for line, color, width in (
        (np.array([foot, foot + 500.0 * e]), "base", 3.0), (np.array([slider, joint]), "rod", 2.4),
        (ring, "platform", 2.0),
    ):  # fmt: skip
        axes.plot(*line[:, plane].T, color=plots.STYLE[color], linewidth=width, alpha=0.5)
    for name, start, direction, number in (
        ("$e$, slider's velocity", slider, e, 1), ("$f$, force on the platform", joint, f, 0),
        ("$v$, velocity of $a_1$", joint, out / np.linalg.norm(out), 2),
    ):  # fmt: skip
        tip, shade = start + 190.0 * direction, plots.STYLE["lines"][number]
        style = {"arrowstyle": "-|>", "color": shade, "linewidth": 2.0}
        axes.annotate("", tip[plane], start[plane], arrowprops=style, zorder=5)
        axes.plot([], [], color=shade, linewidth=2.0, label=name)
    for name in "Bba":
        plots.remark(axes, f"${name}_1$", tuple(points[name][0][plane]), xytext=(-4, -12))
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.12)
