"""What several of the figures show: the printed machine, a panel of three legs' curves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pkm_gym import plots
from pkm_gym.mechanisms.spr3.mechanism import Spr3

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

WIDTH = 7.2  # inches, a page's two columns
DASHES: tuple[Any, ...] = ("-", (0, (4, 2)), (0, (1.5, 3)))  # of the legs, which may coincide


def machine_of(problem: DesignProblem, design: FloatArray | None) -> Spr3:
    """Return the machine of a design (d,), of the printed dimensions if none is given."""
    made = problem.mechanism(problem.printed_design() if design is None else design)
    assert isinstance(made, Spr3)
    return made


def printed(problem: DesignProblem) -> Spr3:
    """Return the machine of the printed dimensions."""
    return machine_of(problem, None)


def printed_numbers(problem: DesignProblem, *names: str) -> tuple[float, ...]:
    """Return printed numbers by name."""
    values = [problem.reference[name].printed for name in names]
    return tuple(value for value in values if value is not None)


def draw_legs(axes: Axes, times: FloatArray, values: FloatArray, more: str = "") -> None:
    """Draw values (n, 3) of the three legs over times (n,)."""
    for leg, color in enumerate(plots.STYLE["lines"][:3]):
        axes.plot(
            times, values[:, leg], color=color, linewidth=plots.STYLE["line"],
            linestyle=DASHES[leg], label=f"leg {leg + 1}{more}",
        )  # fmt: skip
    axes.set_xlim(times[0], times[-1])
    axes.grid(visible=True, color=plots.STYLE["grid"], linewidth=0.5)
