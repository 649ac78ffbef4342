"""``pkm-gym figures``: the paper's figures, drawn with our model."""

from __future__ import annotations

import time
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pkm_gym.core.names import check_known
from pkm_gym.mechanisms import make_problem, problem_type
from pkm_gym.studies.cli.arguments import GivenDesign, design_from
from pkm_gym.studies.cli.options import DesignFileOption, Name
from pkm_gym.studies.cli.runs import file_name, run_folder
from pkm_gym.studies.cli.tasks import task_folder

if TYPE_CHECKING:
    from pkm_gym.plots.pictures import Animations, Pictures, Solids

FORMATS = ("png", "pdf", "svg")
DPI = 150  # of a png


def command(
    name: Name,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder to write to.",
            show_default="runs/NAME/figures, of a design runs/NAME/figures-FILE",
        ),
    ] = None,
    only: Annotated[
        list[str] | None, typer.Option(metavar="FIGURE", help="Draw this one; may be repeated.")
    ] = None,
    form: Annotated[str, typer.Option("--format", help="png, pdf or svg.")] = "png",
    design: DesignFileOption = None,
) -> None:
    """Draw the paper's figures with our model, the machine and its index maps.

    With --design those that can be drawn of any design are drawn of that one: the machine, its
    index maps, and what else a mechanism has.
    """
    check_known("format", [form], FORMATS)
    given = _given(name, design) if design else None
    drawn = [stem for table in figures_of(name) for stem in table]
    if given is not None:
        own = [stem for table in figures_of(name, any_design=True) for stem in table]
        if fixed := [stem for stem in only or () if stem in drawn and stem not in own]:
            raise ValueError(
                f"{fixed[0]} is of the paper, not of a design: leave --design out, or take one of "
                f"{', '.join(own)}"
            )
        drawn = own
    if not drawn:
        raise ValueError(f"{problem_type(name).name} has no figures")
    check_known("figure", only or (), drawn)
    write(name, only or drawn, out or _folder(name, given), form, given)


def _given(name: str, file: Path) -> GivenDesign:
    """Return the design of a file, its problem with the task that the file says."""
    given = design_from(name, file=file)
    return replace(given, problem=given.problem.with_task(given.task))


def _folder(name: str, given: GivenDesign | None) -> Path:
    if given is None or given.file is None:
        return run_folder(problem_type(name).name) / "figures"
    return task_folder(given.problem) / file_name(f"figures-{given.file.path.stem}")


def figures_of(name: str, *, any_design: bool = False) -> tuple[Pictures, Solids, Animations]:
    """Return a problem's pictures, solids and animations, as its ``figures.py`` has them, by name.

    With ``any_design`` those that can be drawn of any design, with those that every problem has.

    Raises:
        ValueError: for an unknown problem, with its closest match.
    """
    from pkm_gym.plots.pictures import OF_DESIGN

    kind = problem_type(name)
    package = kind.declared.package
    module = f"{package}.figures"
    figures: Any = import_module(module) if package and find_spec(module) else None
    tables = ("PICTURES", "SOLIDS", "ANIMATIONS")
    found: list[Any] = [getattr(figures, table, {}).get(kind.name, {}) for table in tables]
    if any_design:
        found[0] = OF_DESIGN | found[0]
        found = [{stem: x for stem, x in table.items() if x.any_design} for table in found]
    pictures, solids, animations = found
    return pictures, solids, animations


def write(
    name: str, chosen: list[str], folder: Path, form: str, given: GivenDesign | None = None
) -> None:
    """Draw the chosen pictures, solids and animations into a folder, a line on stdout each.

    Raises:
        OSError: where the folder can't be written.
    """
    from pkm_gym.plots import save, save_animation

    pictures, solids, animations = figures_of(name, any_design=given is not None)
    folder.mkdir(parents=True, exist_ok=True)
    problem = make_problem(name) if given is None else given.problem
    of = () if given is None else (given.design,)
    for stem in chosen:
        start = time.perf_counter()
        if stem in solids:
            caption = solids[stem].caption
            path = solids[stem].write(problem, folder / f"{stem}.stl", *of)
        elif stem in animations:
            caption, frames, fps, _ = animations[stem]
            path = save_animation(frames(problem, *of), folder / f"{stem}.gif", fps)
        else:
            caption = pictures[stem].caption
            path = save(pictures[stem].draw(problem, *of), folder / f"{stem}.{form}", dpi=DPI)
        print(f"{path}  {caption}  ({time.perf_counter() - start:.1f} s)", flush=True)
