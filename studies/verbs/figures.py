"""``pkm-gym figures``: the paper's figures, drawn with our model."""

from __future__ import annotations

import time
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pkm_gym.core.names import check_known
from pkm_gym.mechanisms import make_problem, problem_type
from pkm_gym.studies.cli.options import Name
from pkm_gym.studies.cli.runs import run_folder

if TYPE_CHECKING:
    from pkm_gym.plots.pictures import Animations, Pictures, Solids

FORMATS = ("png", "pdf", "svg")
DPI = 150  # of a png


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
    check_known("format", [form], FORMATS)
    drawn = [stem for table in figures_of(name) for stem in table]
    if not drawn:
        raise ValueError(f"{problem_type(name).name} has no figures")
    check_known("figure", only or (), drawn)
    write(name, only or drawn, out or run_folder(problem_type(name).name) / "figures", form)


def figures_of(name: str) -> tuple[Pictures, Solids, Animations]:
    """Return a problem's pictures, solids and animations, as its ``figures.py`` has them, by name.

    Raises:
        ValueError: for an unknown problem, with its closest match.
    """
    kind = problem_type(name)
    package = kind.declared.package
    module = f"{package}.figures"
    figures: Any = import_module(module) if package and find_spec(module) else None
    tables = ("PICTURES", "SOLIDS", "ANIMATIONS")
    return tuple(getattr(figures, table, {}).get(kind.name, {}) for table in tables)


def write(name: str, chosen: list[str], folder: Path, form: str) -> None:
    """Draw the chosen pictures, solids and animations into a folder, a line on stdout each.

    Raises:
        OSError: where the folder can't be written.
    """
    from pkm_gym.plots import save, save_animation

    pictures, solids, animations = figures_of(name)
    folder.mkdir(parents=True, exist_ok=True)
    problem = make_problem(name)
    for stem in chosen:
        start = time.perf_counter()
        if stem in solids:
            caption = solids[stem].caption
            path = solids[stem].write(problem, folder / f"{stem}.stl")
        elif stem in animations:
            caption, frames, fps = animations[stem]
            path = save_animation(frames(problem), folder / f"{stem}.gif", fps)
        else:
            caption = pictures[stem].caption
            path = save(pictures[stem].draw(problem), folder / f"{stem}.{form}", dpi=DPI)
        print(f"{path}  {caption}  ({time.perf_counter() - start:.1f} s)", flush=True)
