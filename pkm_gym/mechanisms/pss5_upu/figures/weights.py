"""What the composite's weights would be of our own designs, beside the paper's."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.pss5_upu.atlas import NAMES, own_composites, printed_composite, space_grid
from pkm_gym.mechanisms.pss5_upu.figures.common import COLORS, WIDE
from pkm_gym.plots.pictures import Picture
from pkm_gym.plots.style import words

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pkm_gym.core.composite import Composite
    from pkm_gym.core.problem import DesignProblem


def weights(problem: DesignProblem) -> Figure:
    """Draw correlations and weights of the paper's samples and of two populations of ours."""
    found = printed_composite(problem.reference), *own_composites(problem.evaluate(space_grid()))
    figure = plots.new_figure(WIDE, 5.2)
    plots.headline(
        figure,
        "Weights of the composite depend on the population: the paper's, and ours",
        "above: correlations of the indices; middle: weights of their z-scores, and the share of "
        "the variance that the kept components have; below: what makes them doubtful",
    )
    for k, composite in enumerate(found):
        left = 0.045 + 0.325 * k
        axes = plots.panel(figure, (left, 0.545, 0.2, 0.3), title=composite.population)
        _draw_correlation(axes, composite)
        axes = plots.panel(figure, (left, 0.27, 0.275, 0.19))
        _draw_weights(axes, composite)
        lines = "\n".join(textwrap.fill(warning, LETTERS) for warning in composite.warnings)
        figure.text(left, 0.215, lines, va="top", linespacing=1.35, **words("small", color="bad"))
    return figure


LETTERS = 54  # of a line of words
PICTURES = {"weights": Picture("weights of the composite of other populations", weights)}


def _draw_correlation(axes: Axes, composite: Composite) -> None:
    """Draw the correlation matrix, each number in its cell."""
    R = composite.correlation
    axes.imshow(R, cmap="RdBu", vmin=-1.5, vmax=1.5, aspect="auto")
    for (row, column), value in np.ndenumerate(R):
        text = f"{value:.2f}".replace("-", "−")
        axes.text(column, row, text, ha="center", va="center", **words("small"))
    names = [plots.symbol(name) for name in NAMES]
    axes.set_xticks(range(len(NAMES)), names)
    axes.set_yticks(range(len(NAMES)), names)
    axes.tick_params(length=0)


def _draw_weights(axes: Axes, composite: Composite) -> None:
    """Draw the weights as bars, with their numbers."""
    for k, (name, weight) in enumerate(zip(NAMES, composite.weights, strict=True)):
        axes.bar(k, weight, 0.6, color=COLORS[name])
        plots.remark(
            axes, f"{weight:.2f}".replace("-", "−"), (k, float(weight)), dot=False, ha="center",
            xytext=(0, 2 if weight > 0.0 else -9),
        )  # fmt: skip
    axes.axhline(0.0, color=plots.STYLE["ink"], linewidth=0.8)
    axes.set_xticks(range(len(NAMES)), [plots.symbol(name) for name in NAMES])
    share = composite.shares[: composite.kept].sum()
    axes.set_title(
        f"{composite.kept} of 4 components, {share:.0%}", loc="left", pad=4, **words("small")
    )
    axes.set(ylim=(-2.9, 2.6), yticks=(-2, 0, 2))
