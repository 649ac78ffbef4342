"""The figure of the leg for a gait: thrust against flow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.core.solve import solve_tasks
from pkm_gym.mechanisms.stroke_leg.figures.leg import WIDTH

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem

GAIT_RATES = np.linspace(0.1, 0.16, 5)


def thrust_against_rate(problem: DesignProblem) -> Figure:
    """Draw the least thrust of a gait's leg over the speed that its pistons may have."""
    tasks = np.array([problem.pack({"rate": rate}) for rate in GAIT_RATES.tolist()])
    solved = solve_tasks(problem, tasks)
    evaluation = problem.evaluate(solved.designs, tasks)
    figure = plots.new_figure(WIDTH, 3.3)
    plots.headline(
        figure,
        "A leg for a gait: thrust against flow",
        "the best leg of the default task for each limit of the pistons' speed; the paper has "
        "no such problem",
    )
    axes = plots.panel(
        figure, (0.082, 0.14, 0.4, 0.64), x="piston speed per foot speed, at most",
        y="cylinder forces, rms, per foot force", title="what can be had",
    )  # fmt: skip
    axes.plot(
        GAIT_RATES, solved.optima, color=plots.STYLE["lines"][0], marker="o", markersize=4.5,
        linewidth=1.4,
    )  # fmt: skip
    axes.fill_between(
        GAIT_RATES, solved.optima, solved.optima.min() * 0.95, facecolor="none",
        edgecolor=plots.STYLE["faint"], hatch="////", linewidth=0.0, alpha=0.6,
    )  # fmt: skip
    axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
    beside = plots.panel(
        figure, (0.58, 0.14, 0.405, 0.64), x="piston speed per foot speed, at most",
        y="length (mm)", title="by which dimensions",
    )  # fmt: skip
    for k, (name, text) in enumerate((("l1", "crank"), ("l", "side"), ("l6", "frame OC"))):
        lengths = 1e3 * evaluation.designs[:, [v.name for v in problem.variables].index(name)]
        beside.plot(
            GAIT_RATES, lengths, color=plots.STYLE["lines"][k + 1], marker="o", markersize=3.5,
            label=f"{text} {plots.symbol(name)}",
        )  # fmt: skip
    beside.set_ylim(0.0, 440.0)
    plots.legend(beside, loc="upper right", ncols=3)
    return figure
