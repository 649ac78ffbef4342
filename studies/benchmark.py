"""``pkm-gym benchmark``: run methods on tasks with certified optima, and rank them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, TypeAlias

import numpy as np
import typer
from rich.console import Console

from pkm_gym.benchmark.methods import METHODS, find_method
from pkm_gym.benchmark.record import EvaluationLog, Setting
from pkm_gym.benchmark.run import Rows, run, setting
from pkm_gym.benchmark.splits import SPLITS
from pkm_gym.benchmark.standings import standings
from pkm_gym.studies.arguments import Name
from pkm_gym.studies.curves import save_curves
from pkm_gym.studies.leaderboard import enter
from pkm_gym.studies.search import own_command
from pkm_gym.studies.standings import save_table, show
from pkm_gym.studies.storage import run_folder
from pkm_gym.studies.terminal import console, counter

QUICK_TASKS, QUICK_SEEDS = 64, 1
FULL_SEEDS = 3
MEASURED = tuple(split for split in SPLITS if split != "train")


Report: TypeAlias = Callable[["Plan", EvaluationLog | None], None]


@dataclass(frozen=True)
class Plan:
    """One run: a setting, its tasks, and the file that keeps it."""

    how: Setting
    rows: Rows
    path: Path


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
            name, split, chosen, seed=seed, evaluations=evaluations, pool=known, noise=noise,
            delay=delay,
        )
        for chosen, known, seed in product(
            method or METHODS, pool or [SPLITS["train"]], range(repeats)
        )
    ]  # fmt: skip
    plans = [_plan(how, number, folder) for how in dict.fromkeys(settings)]
    screen = console()
    try:
        logs = _run(plans, jobs, screen)
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


def _plan(how: Setting, tasks: int, folder: Path) -> Plan:
    most = find_method(how.method).tasks
    rows = np.arange(tasks if most is None else min(tasks, most))
    words = [how.method.replace(":", "."), f"{how.budget}"]
    words += [f"pool{how.pool}"] if 0 < how.pool < SPLITS["train"] else []
    words += [f"noise{how.noise:g}"] if how.noise else []
    words += [f"delay{how.delay:g}"] if how.delay else []
    return Plan(how, rows, folder / f"{'-'.join((*words, f'seed{how.seed}'))}.npz")


def _run(plans: list[Plan], jobs: int, screen: Console) -> list[EvaluationLog]:
    with _bar(screen, sum(len(plan.rows) for plan in plans)) as report:
        return [_one(plan, jobs, report) for plan in plans]


def _one(plan: Plan, jobs: int, report: Report) -> EvaluationLog:
    """Run what is not done yet; the log is kept as it grows."""

    def keep(log: EvaluationLog) -> None:
        log.save(plan.path)
        report(plan, log)

    known = _known(plan)
    report(plan, known)
    return run(plan.how, plan.rows, jobs=jobs, known=known, keep=keep, command=own_command())


def _known(plan: Plan) -> EvaluationLog | None:
    """Return what an earlier run kept, unless the method or the split has changed since."""
    if not plan.path.exists():
        return None
    log = EvaluationLog.load(plan.path)
    return log if log.setting == plan.how else None


@contextmanager
def _bar(screen: Console, total: int) -> Iterator[Report]:
    progress = counter(screen, "tasks")
    line = progress.add_task("starting", total=total)
    done: dict[Path, int] = {}

    def report(plan: Plan, log: EvaluationLog | None) -> None:
        done[plan.path] = len(np.intersect1d(plan.rows, log.rows)) if log else 0
        progress.update(line, completed=sum(done.values()), description=plan.how.method)

    with progress:
        yield report
