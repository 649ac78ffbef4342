"""``pkm-gym twin-check``: the analytic models against MuJoCo."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.console import Console
from rich.text import Text

from pkm_gym.mechanisms import declaration, make_problem
from pkm_gym.studies.cli.arguments import design_from, known_problems
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    PlainJsonOption,
    SeedOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.terminal import BAD, FAINT, GOOD, Sheet, counter, section, table

if TYPE_CHECKING:
    from collections.abc import Callable

    from pkm_gym.twin.check import Row

ALL = "all"


def command(
    name: Annotated[
        str, typer.Argument(metavar="[NAME|all]", help="The mechanism: see `pkm-gym list`.")
    ] = ALL,
    designs: Annotated[
        int, typer.Option(min=0, help="Random feasible designs, beside the printed one.")
    ] = 50,
    seed: SeedOption = 0,
    design: DesignFileOption = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Compare the analytic models with their MuJoCo twins, quantity by quantity.

    The printed design, or the one in --design, and random feasible ones for its task; each row
    shows the worst of them. The exit code is 1 where a limit is broken.

    Example: pkm-gym twin-check spr3
    """
    if design is not None and name == ALL:
        raise ValueError("--design holds a design of one mechanism: name it")
    names = machines() if name == ALL else (name,)
    rows: list[Row] = []
    out = Output(as_json, csv)
    with counter(out.bars, "designs") as bar:
        for each in names:
            line = bar.add_task(each, total=designs + 1)
            rows += _check(each, designs, seed, design, partial(bar.advance, line))
    _show(out.screen, rows, "The printed design" if design is None else str(design), designs)
    out.give({"rows": [asdict(row) | {"holds": row.holds} for row in rows]})
    if not all(row.holds for row in rows):
        raise typer.Exit(1)


def machines() -> tuple[str, ...]:
    """Return the problems to check, one a mechanism with a twin: the one that drives it, if any."""
    first: dict[str, str] = {}
    for name in sorted(known_problems(), key=lambda name: declaration(name).motion is None):
        problem = make_problem(name)
        module = problem.mechanism(problem.printed_design()).twin_module
        if module:
            first.setdefault(module, name)
    return tuple(sorted(first.values()))


def _check(
    name: str, designs: int, seed: int, file: Path | None, progress: Callable[[], None]
) -> tuple[Row, ...]:
    from pkm_gym.twin.check import check_designs, random_designs

    given = design_from(name, file=file)
    problem = given.problem.with_task(given.task)
    chosen = np.concatenate([given.design[None], random_designs(problem, designs, seed)])
    return check_designs(problem, chosen, progress)


def _show(screen: Console, rows: Iterable[Row], first: str, designs: int) -> None:
    rows = tuple(rows)
    others = f" and {designs} random feasible ones, worst of all" if designs else ""
    screen.print(section(f"{first}{others}"))
    screen.print(_table(rows))
    for name, solver in {row.mechanism: row.solver for row in rows}.items():
        screen.print(Text(f"{name}: MuJoCo with {solver}", style=FAINT))


def _table(rows: Iterable[Row]) -> Sheet:
    numbers = ("worst", "limit")
    shown = table("mechanism", "quantity", "worst", "limit", "unit", "", "at", numbers=numbers)
    for row in rows:
        limit = "" if row.limit is None else f"{row.limit:.2g}"
        verdict = Text("holds", style=GOOD) if row.holds else Text("broken", style=BAD)
        shown.add_row(
            row.mechanism,
            row.quantity,
            f"{row.worst:.1e}",
            limit,
            row.unit or "of largest",
            verdict if limit else "",
            Text(row.where, style=FAINT),
        )
    return shown
