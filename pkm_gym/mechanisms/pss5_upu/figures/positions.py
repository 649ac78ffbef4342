"""F over the positions, Fig. 7, and what it hides: where the machine is singular, or nearly so."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.pss5_upu.atlas import NAMES
from pkm_gym.mechanisms.pss5_upu.facts import composite_map, table_5
from pkm_gym.mechanisms.pss5_upu.figures.common import COLORS, WIDE, printed, skew
from pkm_gym.plots.maps import colour_bar
from pkm_gym.plots.pictures import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray
    from pkm_gym.mechanisms.pss5_upu.mechanism import Pss5Upu

NODES = 80  # a side of a map, even: none at the centre
FAR = 2.0  # half widths of the box that Fig. 7 shows
LEVELS = np.linspace(-3.0, -0.4, 14)  # of its logarithm


def positions(problem: DesignProblem) -> Figure:
    """Draw F over level positions for the rows of Table 5, and what it is made of."""
    figure = plots.new_figure(WIDE, 3.1)
    plots.headline(
        figure,
        "F over the positions for the sizes of Table 5, as in Fig. 7 of the paper, our model",
        "the paper's weights of raw local indices, level, at home height; square: the box; F rises "
        f"towards the centre, where {plots.symbol('K_v')} and {plots.symbol('K_eta')} vanish",
    )
    machines = tuple(table_5(problem))
    levels = np.arange(1.1, 1.67, 0.05)
    for k, machine in enumerate(machines):
        axes = plots.panel(
            figure, (0.06 + 0.22 * k, 0.15, 0.175, 0.62), x="x (mm)", y="" if k else "y (mm)",
            title=f"row {k + 1}: r {1e3 * machine.r:.0f}, R {1e3 * machine.R:.0f}, "
            f"L {1e3 * machine.L:.0f}",
        )  # fmt: skip
        x, y, poses = _plane(machine, FAR)
        bands = axes.contourf(
            x, y, composite_map(machine, poses), levels=levels, cmap=plots.STYLE["map"],
            extend="min",
        )  # fmt: skip
        bands.set_rasterized(True)  # a vector format would show seams between the bands
        axes.plot(*1e3 * machine.workspace().T, color="white", linewidth=1.2)
        axes.set_aspect("equal", adjustable="box")
        axes.locator_params(nbins=5)
        if k == len(machines) - 1:
            colour_bar(axes, bands, "F")
    axes = plots.panel(figure, (0.785, 0.15, 0.205, 0.62), x="x (mm)", title="row 1, along x")
    _draw_profile(axes, machines[0])
    return figure


def singular(problem: DesignProblem) -> Figure:
    """Draw how near to singular the paper's layout and a skew one are, and at which rank."""
    figure = plots.new_figure(WIDE, 6.3)
    plots.headline(
        figure,
        "How near to singular: the paper's layout, row 1 of Table 5, and a skew one of ours",
        "least over largest singular value of the limbs' system, rods and UPU limb, over level "
        "positions and over tilts at home; right: all six along x; above, two vanish at home",
    )
    layouts = {"paper's": printed(problem), "skew": skew()}
    for row, (name, machine) in enumerate(layouts.items()):
        low, rank = 0.555 - 0.475 * row, machine.rank(machine.home)
        for column, (x, y, poses) in enumerate((_plane(machine, 1.0), _tilts(machine))):
            axes = plots.panel(
                figure, (0.055 + 0.335 * column, low, 0.215, 0.335),
                x=r"$\beta$ (deg)" if column else "x (mm)",
                y=r"$\gamma$ (deg)" if column else "y (mm)",
                title=f"{name}: rank {rank:.0f} of 6 at home",
            )  # fmt: skip
            _draw_rcond(axes, x, y, machine.rcond(poses))
        axes = plots.panel(
            figure, (0.755, low, 0.24, 0.335), x="x (mm)", y="singular values over the largest",
            title="at home " + _at_home(machine),
        )  # fmt: skip
        _draw_values(axes, machine)
    return figure


PICTURES = {
    "fig7": Picture("F over the positions for the sizes of Table 5, as in Fig. 7", positions),
    "singular": Picture("rank and condition of the paper's layout and of a skew one", singular),
}


def _plane(machine: Pss5Upu, far: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return x, y (n, n), mm, and level poses (n, n, 5) over ``far`` half widths of the box."""
    poses = machine.workspace_grid(NODES, NODES)
    poses[..., :2] *= far
    return 1e3 * poses[..., 0], 1e3 * poses[..., 1], poses


def _tilts(machine: Pss5Upu) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return beta, gamma (n, n), deg, and tilted poses (n, n, 5) at home."""
    u, v = np.meshgrid(np.linspace(-1, 1, NODES), np.linspace(-1, 1, NODES))
    none = np.zeros_like(u)
    poses = machine.in_box(np.stack([none, none, none, u, v], axis=-1))
    return np.degrees(poses[..., 3]), np.degrees(poses[..., 4]), poses


def _along(machine: Pss5Upu, far: float) -> FloatArray:
    """Return level poses (n, 5) along x, ``far`` half widths of the box to either side."""
    poses = np.repeat(machine.home[None], 2 * NODES + 1, axis=0)
    poses[:, 0] = far * machine.x * np.linspace(-1.0, 1.0, 2 * NODES + 1)
    return poses


def _draw_profile(axes: Axes, machine: Pss5Upu) -> None:
    """Draw F and its four indices along x."""
    poses = np.delete(_along(machine, FAR), NODES, axis=0)  # all but home, where J doesn't exist
    x, local = 1e3 * poses[:, 0], machine.local_indices(poses)
    axes.plot(x, composite_map(machine, poses), color=plots.STYLE["ink"], linewidth=2.0, label="F")
    for name in NAMES:
        axes.plot(x, local[name], color=COLORS[name], linewidth=1.4, label=plots.symbol(name))
    axes.set(xlim=(x[0], x[-1]), ylim=(0.0, 2.2))
    axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
    plots.legend(axes, loc="upper center", ncols=3, columnspacing=0.9, handlelength=1.2)


def _draw_rcond(axes: Axes, x: FloatArray, y: FloatArray, rcond: FloatArray) -> None:
    """Draw the logarithm of the reciprocal condition, all panels alike, and a dot at home."""
    bands = axes.contourf(
        x, y, np.log10(rcond), levels=LEVELS, cmap=plots.STYLE["map"], extend="min"
    )
    bands.set_rasterized(True)  # a vector format would show seams between the bands
    axes.plot(0.0, 0.0, marker="o", markersize=5, color="white", markeredgecolor="black")
    colour_bar(axes, bands, "$\\log_{10}$ $s_6/s_1$")


def _draw_values(axes: Axes, machine: Pss5Upu) -> None:
    """Draw the six singular values over the largest along x."""
    poses = _along(machine, 1.0)
    values = np.linalg.svd(machine.system(poses), compute_uv=False)
    for k, color in enumerate(plots.STYLE["lines"]):
        axes.semilogy(
            1e3 * poses[:, 0], values[:, k] / values[:, 0], color=color, linewidth=1.4,
            linestyle="--" if k == 5 else "-", label=f"$s_{k + 1}$",
        )  # fmt: skip
    axes.set(xlim=1e3 * poses[[0, -1], 0], ylim=(2e-5, 1.5))
    axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
    plots.legend(axes, loc="lower right", ncols=6, columnspacing=0.7, handlelength=0.9)


def _at_home(machine: Pss5Upu) -> str:
    values = np.linalg.svd(machine.system(machine.home), compute_uv=False)
    return " ".join(f"{value:.2f}" for value in values)
