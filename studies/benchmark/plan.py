"""Runs of the benchmark: what each measures, and the file that keeps it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np
from rich.console import Console

from pkm_gym.benchmark.methods import find_method
from pkm_gym.benchmark.record import EvaluationLog, Setting
from pkm_gym.benchmark.run import Rows, run, splits_folder
from pkm_gym.benchmark.splits import count_tasks, split_file
from pkm_gym.mechanisms import make_problem
from pkm_gym.studies.cli.arguments import own_command
from pkm_gym.studies.cli.terminal import counter

Report: TypeAlias = Callable[["Plan", EvaluationLog | None], None]


@dataclass(frozen=True)
class Plan:
    """One run: a setting, its tasks, and the file that keeps it."""

    how: Setting
    rows: Rows
    path: Path


def planned(how: Setting, tasks: int, folder: Path) -> Plan:
    """Return the run of a setting on the first tasks of its split."""
    most = find_method(how.method).tasks
    rows = np.arange(tasks if most is None else min(tasks, most))
    words = [how.method.replace(":", "."), f"{how.budget}"]
    trained = split_file(make_problem(how.problem), "train", splits_folder(how))
    words += [f"pool{how.pool}"] if 0 < how.pool < count_tasks(trained) else []
    words += [f"noise{how.noise:g}"] if how.noise else []
    words += [f"delay{how.delay:g}"] if how.delay else []
    return Plan(how, rows, folder / f"{'-'.join((*words, f'seed{how.seed}'))}.npz")


def run_plans(plans: list[Plan], jobs: int, screen: Console) -> list[EvaluationLog]:
    """Run what is not done yet, with a bar; return all logs."""
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
