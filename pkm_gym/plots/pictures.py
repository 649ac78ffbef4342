"""Pictures by name: what a mechanism's ``figures.py`` offers, and what every mechanism has.

A ``figures.py`` says what it offers in ``PICTURES`` and, if it has any, ``SOLIDS`` and
``ANIMATIONS``: problem -> name -> ``Picture``, ``Solid`` or ``Animation``. What can be made of any
design, not just of the paper's, takes the design (d,) as its last argument, and says so.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
from matplotlib.figure import Figure

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import solve_tasks
from pkm_gym.core.types import FloatArray
from pkm_gym.plots.design import design_figure, index_map_figure


class Picture(NamedTuple):
    """A figure of a problem: what it shows, and the function that draws it."""

    caption: str
    draw: Callable[..., Figure]
    any_design: bool = False


class Solid(NamedTuple):
    """A body that is written as .stl: what it is, and the function that writes it."""

    caption: str
    write: Callable[..., Path]
    any_design: bool = False


class Animation(NamedTuple):
    """A moving picture that is written as .gif: what it shows, its frames, frames per second."""

    caption: str
    frames: Callable[..., Iterable[Figure]]
    fps: float
    any_design: bool = False


# What every mechanism has of a design.
OF_DESIGN = {
    "design": Picture("the design", design_figure, any_design=True),
    "design_maps": Picture("its index maps", index_map_figure, any_design=True),
}

Pictures: TypeAlias = Mapping[str, Picture]
Solids: TypeAlias = Mapping[str, Solid]
Animations: TypeAlias = Mapping[str, Animation]


def machine_pictures(name: str, *, printed: bool = True) -> dict[str, Picture]:
    """Return the pictures that every mechanism has: its optimum and, if any, its printed design."""
    pictures = {
        name: Picture("the optimum of the default task", lambda p: design_figure(p, _optimum(p))),
        "printed": Picture("the printed design", lambda p: design_figure(p, p.printed_design())),
        f"{name}_maps": Picture(
            "index maps of the optimum", lambda p: index_map_figure(p, _optimum(p))
        ),
        "printed_maps": Picture(
            "index maps of the printed design", lambda p: index_map_figure(p, p.printed_design())
        ),
    }
    return {k: v for k, v in pictures.items() if printed or not k.startswith("printed")}


def _optimum(problem: DesignProblem) -> FloatArray:
    """Return the first of the verified optima, of the default task and objective, or solve it."""
    optima = problem.reference.optima
    if not optima:
        return np.asarray(solve_tasks(problem, problem.pack(None)[None]).designs[0])
    return problem.design(next(iter(optima.values())).design)
