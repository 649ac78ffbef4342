"""``pkm-gym benchmark``: run methods on tasks with certified optima, and rank them."""

from __future__ import annotations

import os
from itertools import product
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from pkm_gym.benchmark.methods import METHODS, find_method
from pkm_gym.benchmark.run import setting
from pkm_gym.benchmark.splits import load_split
from pkm_gym.benchmark.standings import ranked, standings
from pkm_gym.core.declaration import SPLITS
from pkm_gym.studies.benchmark.curves import save_curves
from pkm_gym.studies.benchmark.leaderboard import enter
from pkm_gym.studies.benchmark.plan import planned, run_plans
from pkm_gym.studies.benchmark.scored import scored
from pkm_gym.studies.benchmark.tables import save_table, show, show_failed
from pkm_gym.studies.cli.bounds import NUMBER, check_memory
from pkm_gym.studies.cli.options import (
    CsvOption,
    Name,
    PlainJsonOption,
    SplitsOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import if_full, run_folder
from pkm_gym.studies.cli.terminal import FAINT

QUICK_TASKS, QUICK_SEEDS = 64, 1
FULL_SEEDS = 3
MEASURED = tuple(split for split in SPLITS if split != "train")


def command(
    name: Name,
    split: Annotated[
        str,
        typer.Option(
            metavar="|".join(MEASURED), help="Tune on val; test is for the published tables."
        ),
    ] = "val",
    method: Annotated[
        list[str] | None,
        typer.Option(
            "--method",
            metavar="NAME|MODULE:METHOD",
            help="Only this one, or one of your own; repeat it for several.",
            show_default=False,
        ),
    ] = None,
    tasks: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            help=f"The first N tasks of the split; {QUICK_TASKS} if not said.",
            show_default=False,
        ),
    ] = None,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Runs of each.")] = QUICK_SEEDS,
    full: Annotated[
        bool, typer.Option("--full", help=f"All tasks, {FULL_SEEDS} seeds: some hours.")
    ] = False,
    evaluations: Annotated[
        int, typer.Option(metavar="N", min=1, help="Designs that each may evaluate on a task.")
    ] = 300,
    pool: Annotated[
        list[int] | None,
        typer.Option(
            metavar="N",
            min=1,
            help="Training tasks that a transfer method may know; repeat it for several.",
            show_default="all",
        ),
    ] = None,
    noise: Annotated[
        float,
        typer.Option(metavar="S", min=0.0, help="Relative error in what the methods are told."),
    ] = 0.0,
    delay: Annotated[
        float, typer.Option(metavar="S", min=0.0, help="Seconds that each evaluation costs more.")
    ] = 0.0,
    jobs: Annotated[
        int, typer.Option(metavar="N", min=1, help="Processes.", show_default="all cores")
    ] = os.cpu_count() or 1,
    splits: SplitsOption = None,
    leaderboard: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Enter the results here.", show_default=False),
    ] = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Run methods on tasks whose optima are known, and rank them by regret.

    Without --method it is all that can be run: those that learn from training tasks need a split of
    them, the designer a trained one. Every evaluation on a task counts. Everything that was
    evaluated is kept in runs/NAME/benchmark/SPLIT, and runs that are there already are not
    repeated: stopped by Ctrl-C, the same command goes on where it was. A method that fails is named
    with its reason and the others go on; the exit code is 1 then.

    Example: pkm-gym benchmark diamond --method my_package:my_method --tasks 256
    """
    out = Output(as_json, csv)
    if split not in MEASURED:
        raise ValueError(f"split is {split!r}: methods are measured on {', '.join(MEASURED)}")
    problem, solved = load_split(name, split, splits)
    most = len(solved)
    if tasks is not None and tasks > most:
        raise ValueError(f"--tasks is {tasks}: {split} has {most} tasks")
    number, repeats = (most, FULL_SEEDS) if full else (tasks or min(QUICK_TASKS, most), seeds)
    check_memory("--evaluations", evaluations, NUMBER * len(problem.low) * number * repeats)
    folder, screen = run_folder(problem.name) / "benchmark" / split, out.screen
    sizes: list[int | None] = [*pool] if pool else [None]  # None: all of them
    settings = [
        setting(
            name, split, chosen, seed=seed, evaluations=evaluations, pool=size, noise=noise,
            delay=delay, folder=splits,
        )
        for chosen, size, seed in product(
            method or _possible(name, splits, out.bars), sizes, range(repeats)
        )
    ]  # fmt: skip
    plans = [planned(one, number, folder) for one in dict.fromkeys(settings)]
    kept = f"{folder} keeps what is done; the same command goes on from there"
    try:
        with if_full(kept, folder):
            logs, failures = run_plans(plans, jobs, out.bars)
    except KeyboardInterrupt:
        out.bars.print(f"stopped: {kept}", soft_wrap=True)
        raise
    measured = standings(logs) if logs else []
    if measured:
        show(screen, measured)
    if failures:
        show_failed(screen, failures)
    if entries := ranked(measured):
        with if_full(kept, folder):
            save_table(entries, folder / "table.csv")
            save_curves(entries, folder)
            if leaderboard:
                enter(entries, leaderboard)
        screen.print(f"written: {folder}", soft_wrap=True)
    out.give(scored(measured) | {"failed": {s.method: x for s, x in failures.items()}})
    if failures:
        raise typer.Exit(1)


def _possible(name: str, splits: Path | None, screen: Console) -> list[str]:
    """Return the methods that can be run on a problem; say why the others can't."""
    possible = []
    for chosen in METHODS:
        found = find_method(chosen)
        try:
            if found.knowledge == "transfer":
                load_split(name, "train", splits)
            if found.training:
                found.training(name)
        except ValueError as reason:
            screen.print(f"without {chosen}: {reason}", style=FAINT)
        else:
            possible.append(chosen)
    return possible
