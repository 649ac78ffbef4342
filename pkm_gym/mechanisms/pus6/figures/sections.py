"""Sections of the workspace of the paper's averages, as reconstructed."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pkm_gym import plots
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pus6.figures.common import WIDE, machine
from pkm_gym.mechanisms.pus6.lattice import ALPHA, BETA, DOWN, UP, X, Y
from pkm_gym.mechanisms.pus6.mechanism import Pus6
from pkm_gym.plots.maps import hatch
from pkm_gym.plots.pictures import Picture

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem

HOME = np.zeros(6)
BOTH = np.concatenate([-X[::-1], X])  # the lattice's x on both sides of its mirror plane


TILTS = (r"$\alpha$ (deg)", r"$\beta$ (deg)")
# Where most of the printed design's poses beyond the singularity are.
ASIDE = np.array([0.10, -0.07, 0.0, 0.0, 0.0, np.radians(-12.0)])


class Section(NamedTuple):
    """A plane of poses: which two numbers of the pose it spans, how far, and the others."""

    title: str
    names: tuple[str, str]
    numbers: tuple[int, int]
    reach: tuple[float, float]  # m or rad
    nodes: tuple[FloatArray, FloatArray]  # of the lattice
    at: FloatArray  # pose


SECTIONS = (
    Section("level, not turned", ("x (mm)", "y (mm)"), (0, 1), (0.24, 0.24), (BOTH, Y), HOME),
    Section("at home", TILTS, (3, 4), (1.15, 1.5), (ALPHA, BETA), HOME),
    Section("at 100, −70 mm, −12°", TILTS, (3, 4), (1.15, 1.5), (ALPHA, BETA), ASIDE),
)


def sections(problem: DesignProblem) -> Figure:
    """Draw sections of what two designs reach of the paper's workspace, by the sign of det G."""
    figure = plots.new_figure(WIDE, 6.0)
    plots.headline(
        figure,
        "Sections of the workspace of the paper's averages, as reconstructed",
        "blue: all sliders within their travel at z = 0; hatched: beyond the direct singularity, "
        "where the machine can't go from home; dots: the lattice; white: our task's box",
    )
    designs = {"(46, 19), printed": (0.46, 0.19), "(45, 10)": (0.45, 0.10)}
    for row, (name, (L, R)) in enumerate(designs.items()):
        made = machine(problem, np.array([L, R]))
        for column, section in enumerate(SECTIONS):
            box = (0.065 + 0.325 * column, 0.545 - 0.465 * row, 0.25, 0.32)
            x, y = section.names
            axes = plots.panel(figure, box, x=x, y=y, title=f"{name}: {section.title}")
            _draw_section(axes, made, section)
    return figure


PICTURES = {
    "sections": Picture("sections of the paper's workspace, as reconstructed", sections),
}


def _draw_section(axes: Axes, made: Pus6, section: Section) -> None:
    """Draw which poses of a plane are reached, and on which side of the singularity."""
    (first, second), (wide, tall) = section.numbers, section.reach
    scale = [1e3 if k < 3 else 180.0 / np.pi for k in section.numbers]
    x, y = np.meshgrid(np.linspace(-wide, wide, 301), np.linspace(-tall, tall, 301))
    poses = np.broadcast_to(section.at, (*x.shape, 6)).copy()
    poses[..., first], poses[..., second] = x, y
    q = made.inverse_kinematics(poses)
    margin = np.minimum((q - DOWN).min(axis=-1), (UP - q).min(axis=-1))
    margin = np.where(np.isfinite(margin), margin, -1.0)
    det = made.local_indices(poses)["det"] / made.local_indices(HOME)["det"]
    place = scale[0] * x, scale[1] * y
    axes.contourf(*place, margin, levels=[0.0, np.inf], colors=plots.STYLE["lines"][5], alpha=0.45)
    axes.contour(*place, margin, levels=[0.0], colors=plots.STYLE["ink"], linewidths=1.0)
    hatch(axes, *place, np.where(margin > 0.0, -det, -1.0), 0.0, "bad")
    nodes = np.meshgrid(*(s * n for s, n in zip(scale, section.nodes, strict=True)))
    axes.plot(
        *map(np.ravel, nodes), linestyle="none", marker=".", markersize=2.0,
        color=plots.STYLE["ink"], alpha=0.6, zorder=3,
    )  # fmt: skip
    if section.at is ASIDE:
        return
    half = (made.xy, made.xy, made.z, made.tilt, made.tilt, made.spin)
    a, b = (s * half[k] for s, k in zip(scale, section.numbers, strict=True))
    axes.plot([-a, a, a, -a, -a], [-b, -b, b, b, -b], color="white", linewidth=2.0, zorder=4)
    axes.set(xlim=(-scale[0] * wide, scale[0] * wide), ylim=(-scale[1] * tall, scale[1] * tall))
