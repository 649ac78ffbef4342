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

FORMATS = ("png", "pdf", "svg")
DPI = 150  # of a png


class Picture(NamedTuple):
    """A figure that the verb can draw: what it shows, and the function that draws it."""

    caption: str
    draw: Callable[[DesignProblem], Figure]


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
    pictures = pictures_of(name)
    check_known("figure", only or (), pictures)
    write(name, only or pictures, out or Path("runs") / name / "figures", form)


def pictures_of(name: str) -> Mapping[str, Picture]:
    """Return a mechanism's pictures by name."""
    pictures: Mapping[str, Picture] = import_module(f"{__name__}.{name}").PICTURES
    return pictures


def write(name: str, chosen: Mapping[str, Picture] | list[str], folder: Path, form: str) -> None:
    """Draw the chosen pictures into a folder, a line on stdout each.

    Raises:
        OSError: where the folder can't be written.
    """
    from pkm_gym.plots import save

    folder.mkdir(parents=True, exist_ok=True)
    problem = make_problem(name)
    pictures = pictures_of(name)
    for stem in chosen:
        start = time.perf_counter()
        path = save(pictures[stem].draw(problem), folder / f"{stem}.{form}", dpi=DPI)
        print(
            f"{path}  {pictures[stem].caption}  ({time.perf_counter() - start:.1f} s)", flush=True
        )
