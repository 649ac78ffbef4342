"""The atlas of GCI over the ratios of the dimensions, a picture of ours."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.spr3.figures.common import WIDTH
from pkm_gym.plots.pictures import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

ROOT = np.sqrt(3.0)


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


PICTURES = {"atlas": Picture("atlas of GCI in the space model", atlas)}


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
