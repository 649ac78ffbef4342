"""``pkm-gym figures``: the paper's figures, drawn with our model."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from pkm_gym.core.names import check_known
from pkm_gym.mechanisms import make_problem, problems
from pkm_gym.studies.arguments import Name

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.types import FloatArray

FORMATS = ("png", "pdf", "svg")
DPI = 150  # of a png


class Picture(NamedTuple):
    """A figure that the verb can draw: what it shows, and the function that draws it."""

    caption: str
    draw: Callable[[DesignProblem], Figure]


class Solid(NamedTuple):
    """A body that the verb can write as .stl: what it is, and the function that writes it."""

    caption: str
    write: Callable[[DesignProblem, Path], Path]


def command(
    name: Name,
    out: Annotated[
        Path | None, typer.Option(help="Folder to write to.", show_default="runs/NAME/figures")
    ] = None,
    only: Annotated[
        list[str] | None, typer.Option(metavar="FIGURE", help="Draw this one; may be repeated.")
    ] = None,
    form: Annotated[str, typer.Option("--format", help="png, pdf or svg.")] = "png",
) -> None:
    """Draw the paper's figures with our model, the machine and its index maps."""
    check_known("mechanism", [name], problems())
    check_known("format", [form], FORMATS)
    drawn = [*pictures_of(name), *solids_of(name)]
    check_known("figure", only or (), drawn)
    write(name, only or drawn, out or Path("runs") / name / "figures", form)


def pictures_of(name: str) -> Mapping[str, Picture]:
    """Return a mechanism's pictures by name."""
    pictures: Mapping[str, Picture] = import_module(f"{__name__}.{name}").PICTURES
    return pictures


def solids_of(name: str) -> Mapping[str, Solid]:
    """Return a mechanism's solids by name; not every one has any."""
    solids: Mapping[str, Solid] = getattr(import_module(f"{__name__}.{name}"), "SOLIDS", {})
    return solids


def machine_pictures(name: str) -> dict[str, Picture]:
    """Return the pictures that every mechanism has: its optimum and its printed design."""
    return {
        name: Picture("the verified optimum", lambda p: _design_figure(p, _optimum(p))),
        "printed": Picture("the printed design", lambda p: _design_figure(p, p.printed_design())),
        f"{name}_maps": Picture(
            "index maps of the verified optimum", lambda p: _map_figure(p, _optimum(p))
        ),
        "printed_maps": Picture(
            "index maps of the printed design", lambda p: _map_figure(p, p.printed_design())
        ),
    }


def write(name: str, chosen: list[str], folder: Path, form: str) -> None:
    """Draw the chosen pictures and solids into a folder, a line on stdout each.

    Raises:
        OSError: where the folder can't be written.
    """
    from pkm_gym.plots import save

    pictures, solids = pictures_of(name), solids_of(name)
    folder.mkdir(parents=True, exist_ok=True)
    problem = make_problem(name)
    for stem in chosen:
        start = time.perf_counter()
        if stem in solids:
            caption = solids[stem].caption
            path = solids[stem].write(problem, folder / f"{stem}.stl")
        else:
            caption = pictures[stem].caption
            path = save(pictures[stem].draw(problem), folder / f"{stem}.{form}", dpi=DPI)
        print(f"{path}  {caption}  ({time.perf_counter() - start:.1f} s)", flush=True)


def _optimum(problem: DesignProblem) -> FloatArray:
    """Return the first of the verified optima, the one of the default task and objective."""
    return problem.design(next(iter(problem.reference.optima.values())).design)


def _design_figure(problem: DesignProblem, design: FloatArray) -> Figure:
    from pkm_gym.plots import design_figure

    return design_figure(problem, design)


def _map_figure(problem: DesignProblem, design: FloatArray) -> Figure:
    from pkm_gym.plots import index_map_figure

    return index_map_figure(problem, design)
