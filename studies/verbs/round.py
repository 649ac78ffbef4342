"""``pkm-gym round``: the best feasible design of dimensions that a shop can build."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.text import Text

from pkm_gym.core.units import converted
from pkm_gym.studies.buildable.content import of_rounded
from pkm_gym.studies.buildable.dimensions import Dimensions, settled_by
from pkm_gym.studies.buildable.lattice import Lattice, lattice
from pkm_gym.studies.buildable.rounding import POINTS, Rounded, round_design
from pkm_gym.studies.buildable.start import Start, start_from
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    DesignOption,
    FreeOption,
    Name,
    ObjectiveOption,
    PlainJsonOption,
    output_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import file_name
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import BAD, FAINT, GOOD, counter, section, table
from pkm_gym.studies.report.answer import hand_over


def command(
    name: Name,
    to: Annotated[
        list[str] | None,
        typer.Option(
            metavar="STEP|NAME=STEP ...",
            help="Of all lengths (1mm), of all angles (0.5deg), or of one dimension (l1=0.1mm); "
            "repeat it for several.",
            show_default=False,
        ),
    ] = None,
    stock: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE,VALUE ...",
            help="All values that a dimension can have: l1=300mm,350mm,400mm.",
            show_default=False,
        ),
    ] = None,
    set_: DesignOption = None,
    design: DesignFileOption = None,
    objective: ObjectiveOption = None,
    free: FreeOption = None,
    points: Annotated[
        int, typer.Option(metavar="N", min=1, help="How many lattice points may be evaluated.")
    ] = POINTS,
    output: Annotated[
        Path | None, output_option("Where the design goes; under runs/NAME if not said.")
    ] = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Round a design to dimensions that can be built: the best feasible one near it.

    Without a design it is the optimum of the task, recorded or solved now.

    Example: pkm-gym round diamond --to 1mm
    """
    out = Output(as_json, csv)
    start = start_from(name, set_, design, objective, free)
    axes = lattice(Dimensions(start.problem, start.design).units, to or (), stock or ())
    progress = counter(out.bars, "points")
    line = progress.add_task("at most", total=points)
    with progress:
        found = round_design(
            start.problem, start.design, axes, points=points,
            report=lambda n: progress.update(line, completed=n),
        )  # fmt: skip
    stem = file_name("_".join(["round", *(to or ()), *(stock or ())]))
    path = output or task_folder(start.problem) / f"{stem}.toml"
    show(out.screen, start, axes, found)
    hand_over(out.screen, found.best, path)
    out.give(of_rounded(found, path))


def show(screen: Console, start: Start, axes: Lattice, found: Rounded) -> None:
    """Print the dimensions, what they cost and what holds them back."""
    screen.print(Text(f"{start.problem.name}: rounded from {start.words}"))
    for note in start.notes:
        screen.print(note, style=FAINT)
    rows = table("dimension", "start", "built", "unit", "of", numbers=["start", "built"])
    for name, pair in found.dimensions.items():
        before, after = (f"{converted(x, found.units[name])[0]:.6g}" for x in pair)
        words = _words(start, axes, name)
        rows.add_row(name, before, after, converted(0.0, found.units[name])[1], words)
    screen.print(rows)
    first = start.problem.objectives[0]
    before, after = (show_value(e.objectives[0, 0], first.unit) for e in (found.start, found.best))
    cost = 100.0 * found.cost
    verdict = f", {abs(cost):.3g} % {'worse' if cost > 0.0 else 'better'}"
    words = f"\n{first.name} {before}, as built {after}"
    screen.print(words + (verdict if isfinite(cost) else ""))
    for name, (asked, now) in settled_by(start.problem, found.best.problem.task).items():
        unit = next(v.unit for v in start.problem.task_variables if v.name == name)
        settled, wanted = show_value(now, unit), show_value(asked, unit)
        screen.print(f"the dimensions set task.{name} = {settled}, not {wanted}")
    farther = found.examined - found.window
    steps = "1 step" if found.reach == 1 else f"{found.reach} steps"
    what = f"the best of all {found.window:,} points within {steps}"
    screen.print(f"{what} and {farther:,} farther off" if farther else what, soft_wrap=True)
    if not found.best.feasible[0]:
        screen.print("none of them is feasible: choose finer steps; this one breaks", style=BAD)
        screen.print(found.best.explain(0), style=BAD)
        return
    screen.print("feasible: every limit holds", style=GOOD)
    _show_touched(screen, found)


def _words(start: Start, axes: Lattice, name: str) -> str:
    """Return what values a dimension may have."""
    if name in start.problem.following:
        return f"as {start.problem.following[name]}"
    if name in axes:
        return axes[name].words
    held = name in {v.name for v in start.problem.all_variables} - {*start.problem.variable_names}
    return "as it was" if held else "any value"


def _show_touched(screen: Console, found: Rounded) -> None:
    if not found.touched:
        screen.print("no step of one dimension breaks a limit")
        return
    names = found.best.problem.constraint_names
    screen.print(section("Limits that it touches"))
    rows = table("limit", "margin", "broken by a step", numbers=["margin"])
    for name, steps in found.touched.items():
        margin = -found.best.constraints[0, names.index(name)]
        ways = [f"{'-' if way < 0 else '+'}{dimension}" for dimension, way in steps]
        rows.add_row(name, f"{margin:.2g}", ", ".join(ways))
    screen.print(rows)


def show_value(value: float, unit: str) -> str:
    """Return an objective with the digits in which designs differ, and its unit."""
    if not isfinite(value):
        return "undefined"
    number, name = converted(float(value), unit)
    return f"{number:.6g} {name}".rstrip()
