"""The workspace: its border curves (Fig. 5), their envelope (Fig. 6), sections and volume."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.spr3.figures.common import WIDTH, machine_of, printed
from pkm_gym.mechanisms.spr3.workspace import (
    Envelope,
    border_curves,
    envelope,
    volume_by_quadrature,
    volume_by_surfaces,
    volume_by_voxels,
)
from pkm_gym.plots.pictures import Picture

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]  # it has no types

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

COARSE = 0.01  # m, of the legs along a surface that is drawn
APART = 0.025  # m, of the stepped leg between two border curves: ours, the paper prints none
VIEWS = ((58.0, 15.0), (-52.0, 15.0))  # deg, elevation and azimuth
SECTIONS = (0.45, 0.50, 0.55, 0.60, 0.65)  # m, heights of the horizontal sections
LIGHT = np.array([0.5, -0.35, 0.8])  # from where the envelope is lit


def borders(problem: DesignProblem) -> Figure:
    """Draw the curves whose families W1 ... W6 bound the workspace, as Fig. 5."""
    machine = printed(problem)
    curves, surface = border_curves(machine, APART), envelope(machine, COARSE)
    return _two_views(
        "Border curves of the printed design's workspace, as in Fig. 5 of the paper, our model",
        "a leg at an end of its range, a second stepped, the third running; "
        f"{1e3 * APART:.0f} mm between two curves (a step of ours: the paper prints none)",
        surface,
        lambda axes: _draw_curves(axes, curves),
    )


def workspace(problem: DesignProblem) -> Figure:
    """Draw the envelope of the printed design's workspace from above and from below, as Fig. 6."""
    surface = envelope(printed(problem), COARSE)
    low, high = surface.heights
    return _two_views(
        "Envelope of the printed design's workspace, as in Fig. 6 of the paper, our model",
        f"six surfaces, a leg at an end of its range on each; z {1e3 * low:.1f} to "
        f"{1e3 * high:.1f} mm, radius {1e3 * surface.radius:.1f} mm, tilt up to "
        f"{np.degrees(surface.tilt.max()):.2f} deg",
        surface,
        lambda axes: _draw_surface(axes, surface),
    )


def sections(problem: DesignProblem) -> Figure:
    """Draw horizontal and vertical sections of the workspace, and its volume."""
    machine = printed(problem)
    surface = envelope(machine)
    figure = plots.new_figure(WIDTH, 3.7)
    plots.headline(
        figure,
        "Sections and volume of the printed design's workspace, our model",
        f"volume {volume_by_quadrature(machine):.8f} m³ by quadrature, "
        f"{volume_by_surfaces(machine):.8f} by the six surfaces, "
        f"{volume_by_voxels(machine):.6f} by voxels",
    )
    boxes = (0.075, 0.125, 0.38, 0.7), (0.68, 0.125, 0.31, 0.7)
    level = plots.panel(figure, boxes[0], x="x (mm)", y="y (mm)", title="horizontal")
    upright = plots.panel(
        figure, boxes[1], x="distance from the axis (mm)", y="z (mm)", title="through the axis"
    )
    for z, color in zip(SECTIONS, plots.STYLE["lines"], strict=False):
        cut = _cut(surface, np.array([0.0, 0.0, 1.0]), z)
        _draw_section(level, cut[..., :2], color, f"z = {1e3 * z:.0f} mm")
        upright.axhline(1e3 * z, color=color, linewidth=0.8, linestyle=":")
    for axis, name in enumerate(("x, in leg 3's plane", "y, square to it")):
        normal = np.eye(3)[1 - axis]
        cut = _cut(surface, normal, 0.0)[..., [axis, 2]]
        _draw_section(upright, cut, (plots.STYLE["ink"], plots.STYLE["rod"])[axis], name)
    for axes in (level, upright):
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.04)
    plots.legend(level, loc="center left", bbox_to_anchor=(1.0, 0.5))
    plots.legend(upright, loc="upper left")
    return figure


def write_envelope(problem: DesignProblem, path: Path, design: FloatArray | None = None) -> Path:
    """Write the envelope of a design's workspace, the printed one's if none is given, in metres."""
    return envelope(machine_of(problem, design)).write(path)


PICTURES = {
    "fig5_borders": Picture("border curves of the workspace, as in Fig. 5", borders),
    "fig6_envelope": Picture("the workspace's envelope, as in Fig. 6", workspace),
    "sections": Picture("sections and volume of the workspace", sections),
}


def _two_views(title: str, note: str, surface: Envelope, draw: Callable[[Axes3D], None]) -> Figure:
    """Return a figure of what is drawn within a surface's box, from above and from below."""
    figure = plots.new_figure(WIDTH, 3.9)
    plots.headline(figure, title, note)
    low, high = 1e3 * surface.vertices.min(axis=0), 1e3 * surface.vertices.max(axis=0)
    small = {"fontsize": plots.STYLE["small"], "fontfamily": plots.STYLE["font"]}
    for k, view in enumerate(VIEWS):
        box = (0.02 + 0.46 * k, 0.03, 0.5, 0.86)
        axes: Axes3D = figure.add_axes(box, projection="3d", computed_zorder=False)
        draw(axes)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(high - low, zoom=0.9)
        axes.view_init(*view)
        axes.set_xlabel("x (mm)", labelpad=-2, **small)
        axes.set_ylabel("y (mm)", labelpad=-2, **small)
        axes.set_zlabel("z (mm)", labelpad=-1, **small)
        axes.tick_params(labelsize=plots.STYLE["small"] - 1, pad=-1)
        axes.locator_params(nbins=5)
    _name_families(figure)
    return figure


def _family_colours() -> FloatArray:
    """Return a colour (6, 3) for each family: leg i at its shortest, leg i at its longest."""
    from matplotlib.colors import to_rgb

    pairs = (("#2f7fbd", "#8cc3ec"), ("#1d9574", "#7fd1b5"), ("#cf7125", "#f2b37a"))
    return np.array([to_rgb(color) for pair in pairs for color in pair])


def _draw_curves(axes: Axes3D, curves: FloatArray) -> None:
    """Draw curves (6, k, n, 3), m, in their families' colours."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]  # likewise

    for family, color in zip(curves, _family_colours(), strict=True):
        axes.add_collection3d(Line3DCollection(1e3 * family, colors=[color], linewidths=0.9))


def _draw_surface(axes: Axes3D, surface: Envelope) -> None:
    """Draw the envelope in its families' colours, lit from above."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    corners = 1e3 * surface.vertices[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colors = _family_colours()[surface.family - 1] * (0.86 + 0.14 * (normals @ LIGHT)[:, None])
    axes.add_collection3d(
        Poly3DCollection(corners, facecolors=colors, edgecolors=colors, linewidths=0.3)
    )


def _name_families(figure: Figure) -> None:
    """Write the families' legend under the two views."""
    from matplotlib.patches import Patch

    names = [f"W{k + 1}: $q_{k // 2 + 1}$ {('shortest', 'longest')[k % 2]}" for k in range(6)]
    patches = [
        Patch(facecolor=tuple(color), label=name)
        for name, color in zip(names, _family_colours().tolist(), strict=True)
    ]
    figure.legend(
        handles=patches, loc="lower center", ncols=6, fontsize=plots.STYLE["small"],
        frameon=False, handlelength=1.0, columnspacing=1.4,
    )  # fmt: skip


def _cut(surface: Envelope, normal: FloatArray, at: float) -> FloatArray:
    """Return the segments (n, 2, 3), m, in which the plane ``normal . x = at`` cuts the surface."""
    from trimesh.intersections import mesh_plane

    segments = mesh_plane(surface.mesh(), normal, at * normal)  # type: ignore[no-untyped-call]  # trimesh gives no type
    return np.asarray(segments)


def _draw_section(axes: Axes, segments: FloatArray, color: str, name: str) -> None:
    """Draw segments (n, 2, 2), m."""
    from matplotlib.collections import LineCollection

    axes.add_collection(LineCollection(list(1e3 * segments), colors=color, linewidths=1.3))
    axes.plot([], [], color=color, linewidth=1.3, label=name)
