"""``pkm-gym zoo``: the trained designers that are known, and how a new one is taken in."""

from __future__ import annotations

from math import isfinite
from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.agents.designers.files import read_designer
from pkm_gym.agents.designers.library import known
from pkm_gym.agents.designers.scoring import AT
from pkm_gym.agents.designers.shipping import take_in
from pkm_gym.mechanisms import called
from pkm_gym.studies.benchmark.scored import REGRET
from pkm_gym.studies.cli.options import (
    CsvOption,
    PlainJsonOption,
    output_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.terminal import FAINT, table


def command(
    add: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Take in the best agent of this training run, among your own.",
            show_default=False,
        ),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Of the new one; its environment's if not said.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path | None,
        output_option("Where the new one goes instead: agents/zoo, to ship it.", "FOLDER"),
    ] = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """List the trained designers, shipped and your own: for which problem, how good they are.

    The regrets are those of the first 64 of the benchmark's validation tasks; only feasible designs
    count.
    """
    out = Output(as_json, csv)
    screen = out.screen
    if add is None and (name or output):
        raise ValueError("--name and -o are those of a designer that --add takes in")
    if add is not None:
        screen.print(f"taken in: {take_in(add, name, output)}", soft_wrap=True)
    heads, told = [f"k = {k}" for k in AT], []
    rows = table("designer", "problem", *heads, numbers=heads)
    for known_name, path in known().items():
        designer, origin = read_designer(path)
        regrets = origin.recorded.get("regrets", {})
        medians = [median_words(regrets[str(k)]) if str(k) in regrets else "" for k in AT]
        rows.add_row(known_name, designer.problem.name, *medians)
        name_of = {"designer": known_name, "mechanism": called(designer.problem)}
        told.append({**name_of, "file": path, "median_regret": regrets})
    screen.print(rows)
    screen.print("k = 1, 4, ...: median regret in per cent after k evaluations", style=FAINT)
    out.give({"regret": REGRET, "rows": told})


def median_words(regret: float) -> str:
    """Return a median regret in per cent as tables show it."""
    return f"{100.0 * regret:.1g}" if isfinite(regret) else "none"
