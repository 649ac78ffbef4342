"""``pkm-gym benchmark``: run methods on tasks with certified optima, and rank them."""

from __future__ import annotations

import os
from itertools import product
from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.benchmark.methods import METHODS
from pkm_gym.benchmark.run import setting
from pkm_gym.benchmark.splits import SPLITS
from pkm_gym.benchmark.standings import standings
from pkm_gym.studies.benchmark.curves import save_curves
from pkm_gym.studies.benchmark.leaderboard import enter
from pkm_gym.studies.benchmark.plan import planned, run_plans
from pkm_gym.studies.benchmark.tables import save_table, show
from pkm_gym.studies.cli.options import Name
from pkm_gym.studies.cli.runs import run_folder
from pkm_gym.studies.cli.terminal import console

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
    ] = "test",
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
        int, typer.Option(metavar="N", min=1, help="The first N tasks of the split.")
    ] = QUICK_TASKS,
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
            show_default=str(SPLITS["train"]),
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
    leaderboard: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Enter the results here.", show_default=False),
    ] = None,
) -> None:
    """Run methods on tasks whose optima are certified, and rank them by regret.

    Every evaluation on a task counts. Everything that was evaluated is kept in
    runs/NAME/benchmark/SPLIT, and runs that are there already are not repeated: stopped by
    Ctrl-C, the same command goes on where it was.

    Example: pkm-gym benchmark diamond --split val --method my_package:my_method --tasks 256
    """
    if split not in MEASURED:
        raise ValueError(f"split is {split!r}: methods are measured on {', '.join(MEASURED)}")
    number, repeats = (SPLITS[split], FULL_SEEDS) if full else (tasks, seeds)
    if number > SPLITS[split]:
        raise ValueError(f"--tasks is {number}: {split} has {SPLITS[split]} tasks")
    folder = run_folder(name) / "benchmark" / split
    settings = [
        setting(
            name, split, chosen, seed=seed, evaluations=evaluations, pool=size, noise=noise,
            delay=delay,
        )
        for chosen, size, seed in product(
            method or METHODS, pool or [SPLITS["train"]], range(repeats)
        )
    ]  # fmt: skip
    plans = [planned(one, number, folder) for one in dict.fromkeys(settings)]
    screen = console()
    try:
        logs = run_plans(plans, jobs, screen)
    except KeyboardInterrupt:
        screen.print(
            f"stopped: {folder} keeps what is done; the same command goes on from there",
            soft_wrap=True,
        )
        raise
    entries = standings(logs)
    show(screen, entries)
    save_table(entries, folder / "table.csv")
    save_curves(entries, folder)
    if leaderboard:
        enter(entries, leaderboard)
    screen.print(f"written: {folder}", soft_wrap=True)
