"""The 3-SPR's figures: Figs 3-6 of the paper with our model, the machine, the atlas of designs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.spr3.mechanism import Spr3
from pkm_gym.mechanisms.spr3.path import (
    GatePath,
    Motion,
    best_place,
    largest_cylinder,
    motion,
    needed_range,
)
from pkm_gym.mechanisms.spr3.workspace import (
    Envelope,
    envelope,
    volume_by_quadrature,
    volume_by_surfaces,
    volume_by_voxels,
)
from pkm_gym.plots.pictures import Picture, Solid, machine_pictures

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]  # it has no types

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

WIDTH = 7.2  # inches, a page's two columns
GAMMAS = (0.0, 30.0, 60.0, 90.0)  # deg, of the path's plane
COARSE = 0.01  # m, of the legs along a surface that is drawn
VIEWS = ((58.0, 15.0), (-52.0, 15.0))  # deg, elevation and azimuth
SECTIONS = (0.45, 0.50, 0.55, 0.60, 0.65)  # m, heights of the horizontal sections
DASHES: tuple[Any, ...] = ("-", (0, (4, 2)), (0, (1.5, 3)))  # of the legs, which may coincide
ROOT = np.sqrt(3.0)
LIGHT = np.array([0.5, -0.35, 0.8])  # from where the envelope is lit


def leg_lengths(problem: DesignProblem) -> Figure:
    """Draw the legs' lengths along the path of Fig. 3."""
    return _path_figure(
        problem, "Leg lengths along the largest path that fits, as in Fig. 3 of the paper", _lengths
    )


def leg_rates(problem: DesignProblem) -> Figure:
    """Draw the legs' rates along the path of Fig. 4."""
    return _path_figure(
        problem, "Leg rates along the largest path that fits, as in Fig. 4 of the paper", _rates
    )


def workspace(problem: DesignProblem) -> Figure:
    """Draw the envelope of the printed design's workspace from above and from below, as Fig. 5."""
    surface = envelope(_printed(problem), COARSE)
    (low, high), figure = surface.heights, plots.new_figure(WIDTH, 3.9)
    plots.headline(
        figure,
        "Workspace of the printed design, as in Fig. 5 of the paper, our model",
        f"six surfaces, a leg at an end of its range on each; z {1e3 * low:.1f} to "
        f"{1e3 * high:.1f} mm, radius {1e3 * surface.radius:.1f} mm, tilt up to "
        f"{np.degrees(surface.tilt.max()):.2f} deg",
    )
    for k, view in enumerate(VIEWS):
        box = (0.02 + 0.46 * k, 0.03, 0.5, 0.86)
        axes = figure.add_axes(box, projection="3d", computed_zorder=False)
        _draw_surface(axes, surface, view)
    _name_families(figure)
    return figure


def sections(problem: DesignProblem) -> Figure:
    """Draw horizontal and vertical sections of the workspace, with its volume, as Fig. 6."""
    machine = _printed(problem)
    surface = envelope(machine)
    figure = plots.new_figure(WIDTH, 3.7)
    plots.headline(
        figure,
        "Sections of the printed design's workspace, as in Fig. 6 of the paper, our model",
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


def atlas(problem: DesignProblem) -> Figure:
    """Draw GCI in the space model of the ratios, with the designs that matter."""
    figure = plots.new_figure(WIDTH, 3.5)
    plots.headline(
        figure,
        "Atlas of the global conditioning index in the space model",
        "X = (2√3/3) $r_2$ + (√3/3) $r_3$, Y = $r_3$, $r_1$ = 3 − $r_2$ − $r_3$; hatched: "
        "infeasible; without colour: a leg range that can't be assembled",
    )
    optimum = next(iter(problem.reference.optima.values()))
    rows = np.array([problem.printed_design(), problem.design(optimum.design)])
    best = problem.evaluate(rows).objectives[:, 0]
    names = (f"paper  {best[0]:.4f}", f"polished  {best[1]:.4f}")
    points = dict(zip(names, map(tuple, _space(rows).tolist()), strict=True))
    windows = (
        ("all that can be assembled", (1.3, 2.7), (0.0, 2.4), np.arange(0.0, 0.901, 0.1)),
        ("near the optimum", (1.93, 2.33), (1.36, 1.62), np.arange(0.4, 0.801, 0.02)),
    )
    for k, (title, x, y, levels) in enumerate(windows):
        box = (0.062 + 0.495 * k, 0.12, 0.345, 0.68)
        axes = plots.panel(figure, box, x="X", y="Y", title=title)
        cut = _atlas_slice(problem, x, y)
        plots.draw_slice(axes, cut, "gci", levels=levels.tolist())
        plots.draw_infeasible(axes, cut)
        plots.mark(axes, points, loc="lower right" if k == 0 else "lower left", title="GCI")
    return figure


def write_envelope(problem: DesignProblem, path: Path, design: FloatArray | None = None) -> Path:
    """Write the envelope of a design's workspace, the printed one's if none is given, in metres."""
    return envelope(_machine(problem, design)).write(path)


PICTURES = {
    "spr3": {
        **machine_pictures("spr3"),
        "fig3_lengths": Picture("leg lengths along a path, as in Fig. 3", leg_lengths),
        "fig4_rates": Picture("leg rates along a path, as in Fig. 4", leg_rates),
        "fig5_workspace": Picture("the workspace's envelope, as in Fig. 5", workspace),
        "fig6_sections": Picture("sections and volume of the workspace, as in Fig. 6", sections),
        "atlas": Picture("atlas of GCI in the space model", atlas),
    },
    "spr3_cylinder": machine_pictures("spr3_cylinder"),
}
SOLIDS = {"spr3": {"envelope": Solid("the workspace's envelope, in metres", write_envelope, True)}}


def _printed(problem: DesignProblem) -> Spr3:
    return _machine(problem, None)


def _machine(problem: DesignProblem, design: FloatArray | None) -> Spr3:
    machine = problem.mechanism(problem.printed_design() if design is None else design)
    assert isinstance(machine, Spr3)
    return machine


def _printed_numbers(problem: DesignProblem, *names: str) -> tuple[float, ...]:
    values = [problem.reference[name].printed for name in names]
    return tuple(value for value in values if value is not None)


def _lengths(moved: Motion) -> tuple[str, FloatArray]:
    return "leg length (mm)", 1e3 * moved.lengths


def _rates(moved: Motion) -> tuple[str, FloatArray]:
    return "leg rate (mm/s)", 1e3 * moved.rates


def _path_figure(
    problem: DesignProblem, title: str, shown: Callable[[Motion], tuple[str, FloatArray]]
) -> Figure:
    """Draw the legs along the largest feasible path, a panel a gamma."""
    machine = _printed(problem)
    radius, height, z_c = largest_cylinder(machine)
    across = z_c - 0.5 * height
    printed = _printed_numbers(problem, "path_R", "path_h")
    shortest, longest = needed_range(machine, best_place(machine, *printed))
    speed, acceleration = _printed_numbers(problem, "speed", "acceleration")
    figure = plots.new_figure(WIDTH, 4.6)
    plots.headline(
        figure,
        f"{title}, our model",
        f"R {1e3 * radius:.1f} mm, h {1e3 * height:.1f} mm from z {1e3 * across:.1f} mm; the "
        f"paper's own ({printed[0]:g} m, {printed[1]:g} m) needs legs of {shortest:.2f} to "
        f"{longest:.2f} m and does not fit",
    )
    panels: list[Axes] = []
    for k, gamma in enumerate(GAMMAS):
        path = GatePath(radius, across + height, across, float(np.radians(gamma)))
        moved = motion(machine, path, speed, acceleration)
        name, values = shown(moved)
        row, column = divmod(k, 2)
        axes = plots.panel(
            figure,
            (0.08 + 0.485 * column, 0.515 - 0.42 * row, 0.42, 0.33),
            x="time (s)" if row else "",
            y="" if column else name,
            title=f"$\\gamma$ = {gamma:g} deg{_coincident(values)}",
        )
        for leg, color in enumerate(plots.STYLE["lines"][:3]):
            axes.plot(
                moved.times, values[:, leg], color=color, linewidth=plots.STYLE["line"],
                linestyle=DASHES[leg], label=f"leg {leg + 1}",
            )  # fmt: skip
        axes.set_xlim(moved.times[0], moved.times[-1])
        axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
        panels.append(axes)
        axes.sharey(panels[0])
    plots.legend(panels[1], loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
    return figure


def _coincident(values: FloatArray) -> str:
    """Say which two legs share their curve in values (n, 3), if any do."""
    for one, other in ((0, 1), (0, 2), (1, 2)):
        if np.allclose(values[:, one], values[:, other], rtol=0.0, atol=1e-6):
            return f", legs {one + 1} and {other + 1} alike"
    return ""


def _family_colours() -> FloatArray:
    """Return a colour (6, 3) for each family: leg i at its shortest, leg i at its longest."""
    from matplotlib.colors import to_rgb

    pairs = (("#2f7fbd", "#8cc3ec"), ("#1d9574", "#7fd1b5"), ("#cf7125", "#f2b37a"))
    return np.array([to_rgb(color) for pair in pairs for color in pair])


def _draw_surface(axes: Axes3D, surface: Envelope, view: tuple[float, float]) -> None:
    """Draw the envelope in its families' colours, lit from above."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]  # likewise

    corners = 1e3 * surface.vertices[surface.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    colors = _family_colours()[surface.family - 1] * (0.86 + 0.14 * (normals @ LIGHT)[:, None])
    axes.add_collection3d(
        Poly3DCollection(corners, facecolors=colors, edgecolors=colors, linewidths=0.3)
    )
    low, high = 1e3 * surface.vertices.min(axis=0), 1e3 * surface.vertices.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=0.9)
    axes.view_init(*view)
    small = {"fontsize": plots.STYLE["small"], "fontfamily": plots.STYLE["font"]}
    axes.set_xlabel("x (mm)", labelpad=-2, **small)
    axes.set_ylabel("y (mm)", labelpad=-2, **small)
    axes.set_zlabel("z (mm)", labelpad=-1, **small)
    axes.tick_params(labelsize=plots.STYLE["small"] - 1, pad=-1)
    axes.locator_params(nbins=5)


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


def _space(designs: FloatArray) -> FloatArray:
    """Return X, Y (n, 2) of designs (n, 2)."""
    r1, r3 = designs.T
    return np.stack([(2.0 * (3.0 - r1 - r3) + r3) / ROOT, r3], axis=-1)


def _atlas_slice(
    problem: DesignProblem, x: tuple[float, float], y: tuple[float, float], count: int = 241
) -> plots.Slice:
    """Evaluate a grid over X and Y."""
    x_values, y_values = np.linspace(*x, count), np.linspace(*y, count)
    across, r3 = (axis.ravel() for axis in np.meshgrid(x_values, y_values))
    r2 = 0.5 * (ROOT * across - r3)
    designs = np.stack([3.0 - r2 - r3, r3], axis=-1)
    return plots.Slice("X", "Y", x_values, y_values, problem.evaluate(designs))
