"""The twin driven along the path by theoretical leg lengths: O_A's way (Fig. 3), leg speeds (4)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pkm_gym import plots
from pkm_gym.mechanisms.spr3.claims import driven
from pkm_gym.mechanisms.spr3.figures.common import WIDTH, draw_legs, printed
from pkm_gym.plots.pictures import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem

SHOWN = 5  # of the simulated samples, one is marked


def trajectory(problem: DesignProblem) -> Figure:
    """Draw O_A's way in the simulation and its distance from the plan, as Fig. 3."""
    run = driven(printed(problem))
    figure = plots.new_figure(WIDTH, 3.3)
    plots.headline(
        figure,
        "Trajectory of $O_A$ from theoretical leg lengths, as in Fig. 3 of the paper, our model",
        f"simulation: the MuJoCo twin; the largest path that fits, R {1e3 * run.path.radius:.1f} "
        "mm: the printed one does not",
    )
    plane = plots.panel(
        figure, (0.085, 0.14, 0.5, 0.66), x="x (mm)", y="z (mm)", title=r"$\gamma$ = 0 deg"
    )
    plane.plot(
        *(1e3 * run.path.corners[:, [0, 2]].T), color=plots.STYLE["ink"], linewidth=1.0,
        label="theory",
    )  # fmt: skip
    plane.plot(
        *(1e3 * run.positions[::SHOWN, [0, 2]].T), color=plots.STYLE["lines"][0], linestyle="none",
        marker="o", markersize=3.6, markerfacecolor="white", label="simulation",
    )  # fmt: skip
    plane.set_aspect("equal", adjustable="datalim")
    plane.margins(0.1)
    plots.legend(plane, loc="center")
    beside = plots.panel(
        figure, (0.69, 0.14, 0.295, 0.66), x="time (s)", y="distance (µm)",
        title=f"from the plan, at most {1e6 * run.off.max():.1f} µm",
    )  # fmt: skip
    beside.plot(run.speeds.times, 1e6 * run.off, color=plots.STYLE["lines"][0], linewidth=1.0)
    beside.set_xlim(0.0, run.speeds.times[-1])
    beside.set_ylim(bottom=0.0)
    return figure


def speeds(problem: DesignProblem) -> Figure:
    """Draw the legs' speeds, theory and simulation, and what they differ by, as Fig. 4."""
    run = driven(printed(problem))
    found, error = run.speeds, 1e6 * (run.speeds.twin - run.speeds.planned)
    figure = plots.new_figure(WIDTH, 3.3)
    plots.headline(
        figure,
        "Leg speeds, theory and simulation, as in Fig. 4 of the paper, our model",
        "theory: J along the plan; simulation: the MuJoCo twin, driven by the lengths; "
        f"$\\gamma$ = 0 deg, R {1e3 * run.path.radius:.1f} mm (ours)",
    )
    axes = plots.panel(
        figure, (0.085, 0.14, 0.5, 0.66), x="time (s)", y="leg speed (mm/s)", title="speeds"
    )
    draw_legs(axes, run.plan.times, 1e3 * run.plan.rates, ", theory")
    for leg, color in enumerate(plots.STYLE["lines"][:3]):
        axes.plot(
            found.times[::SHOWN], 1e3 * found.twin[::SHOWN, leg], color=color, linestyle="none",
            marker="os^"[leg], markersize=3.2, markerfacecolor="white",
            label=f"leg {leg + 1}, simulation",
        )  # fmt: skip
    beside = plots.panel(
        figure, (0.69, 0.14, 0.295, 0.66), x="time (s)", y="difference (µm/s)",
        title=f"simulation − theory, ≤ {np.abs(error).max():.2f} µm/s",
    )  # fmt: skip
    draw_legs(beside, found.times, error)
    axes.margins(y=0.35)
    plots.legend(axes, loc="upper center", ncols=2, columnspacing=1.0)
    return figure


PICTURES = {
    "fig3_trajectory": Picture("the simulated trajectory of O_A, as in Fig. 3", trajectory),
    "fig4_speeds": Picture("leg speeds, theory and simulation, as in Fig. 4", speeds),
}
