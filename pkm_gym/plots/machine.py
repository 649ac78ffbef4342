"""A mechanism to scale, drawn through its ``links``, ``workspace`` and ``index_maps``."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon

from pkm_gym.core.mechanism import Link, Mechanism
from pkm_gym.core.types import FloatArray
from pkm_gym.plots.style import STYLE, style_ticks

WIDTHS = {"arm": 5.0, "rod": 2.6, "cylinder": 2.6}
BARREL = 6.5
PLATE = 0.25  # of an arm's colour
GHOST = 0.28


def draw_machine(axes: Axes, machine: Mechanism, *, poses: FloatArray | None = None) -> bool:
    """Draw the machine at ``poses`` (n, k), the first one solid and the others as ghosts.

    Returns:
        Whether any pose was in reach; the base and the workspace are drawn all the same.
    """
    poses = machine.sample_poses() if poses is None else poses
    drawn = [_in_plane(machine, pose) for pose in poses]
    reached = [all(np.isfinite(link.points).all() for link in links) for links in drawn]
    solid = True
    for links, inside in zip(drawn, reached, strict=True):
        if inside:
            draw_links(axes, links, alpha=1.0 if solid else GHOST, layer=5 if solid else 3)
            solid = False
    for link in drawn[0]:
        if link.role == "base":
            _draw_base(axes, 1e3 * link.points)
    axes.add_patch(
        Polygon(
            1e3 * machine.workspace(), fill=False, edgecolor=STYLE["ink"], linewidth=1.0, zorder=4
        )
    )
    label_axes(axes, machine)
    axes.use_sticky_edges = False
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    axes.grid(visible=True, color=STYLE["grid"], linewidth=0.5)
    axes.set_axisbelow(True)
    style_ticks(axes)
    return any(reached)


def outline(machine: Mechanism) -> FloatArray:
    """Return the workspace's outline (n, 2), mm, as far as it is in reach."""
    points = 1e3 * machine.workspace()
    return points[np.isfinite(points).all(axis=1)]


def label_axes(axes: Axes, machine: Mechanism) -> None:
    """Name the axes of the machine's drawing plane."""
    for axis, name in zip((axes.xaxis, axes.yaxis), machine.drawn_axes, strict=True):
        axis.set_label_text(f"{name} (mm)")


def draw_links(axes: Axes, links: tuple[Link, ...], *, alpha: float, layer: float) -> None:
    """Draw the moving bodies at one pose."""
    for link in links:
        x, y = 1e3 * link.points.T
        if link.role == "platform":
            axes.plot(
                x, y, marker="o", markersize=9, linewidth=2.6, color=STYLE["platform"],
                markeredgecolor=STYLE["ink"], markeredgewidth=0.8, alpha=alpha, zorder=layer + 0.5,
            )  # fmt: skip
        elif link.role in WIDTHS:
            if link.role == "arm" and len(x) > 2:
                axes.fill(
                    x, y, color=STYLE["arm"], alpha=PLATE * alpha, linewidth=0.0, zorder=layer
                )
            if link.role == "cylinder":
                axes.plot(
                    x[:2], y[:2], color=STYLE["cylinder"], linewidth=BARREL, alpha=alpha,
                    solid_capstyle="butt", zorder=layer + 0.1,
                )  # fmt: skip
            axes.plot(
                x, y, color=STYLE[link.role], linewidth=WIDTHS[link.role], alpha=alpha,
                solid_capstyle="round", zorder=layer + 0.2 * (link.role == "arm"),
            )  # fmt: skip
            ends = len(x) - 1 if link.role == "cylinder" else 1
            axes.plot(
                x, y, linestyle="none", marker="o", markevery=ends, markersize=4, color="white",
                markeredgecolor=STYLE[link.role], markeredgewidth=1.0, alpha=alpha,
                zorder=layer + 0.4,
            )  # fmt: skip


def _in_plane(machine: Mechanism, pose: FloatArray) -> tuple[Link, ...]:
    """Return the links at a pose (k,), those in space seen square to the drawing plane."""
    columns = ["xyz".index(name) for name in machine.drawn_axes]
    return tuple(
        link if link.points.shape[1] == 2 else Link(link.role, link.points[:, columns])
        for link in machine.links(pose)
    )


def _draw_base(axes: Axes, points: FloatArray) -> None:
    """Draw the frame between the drives and the drives themselves."""
    x, y = points.T
    axes.plot(x, y, color=STYLE["base"], linewidth=7, alpha=0.25, solid_capstyle="round", zorder=2)
    axes.plot(
        x, y, linestyle="none", marker="o", markersize=13, color="white", zorder=5.5,
        markeredgecolor=STYLE["base"], markeredgewidth=2.2,
    )  # fmt: skip
    axes.plot(x, y, linestyle="none", marker="o", markersize=3, color=STYLE["base"], zorder=5.8)
