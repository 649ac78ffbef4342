"""Runs of the benchmark: what each measures, and the file that keeps it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

import numpy as np
from rich.console import Console

from pkm_gym.benchmark.methods import find_method
from pkm_gym.benchmark.record import EvaluationLog, Setting
from pkm_gym.benchmark.run import Failed, Rows, run, splits_folder
from pkm_gym.benchmark.splits import count_tasks, split_file
from pkm_gym.mechanisms import family_problem
from pkm_gym.studies.cli.runs import own_command
from pkm_gym.studies.cli.terminal import counter

Failures: TypeAlias = dict[Setting, str]
Report: TypeAlias = Callable[["Plan", EvaluationLog | None], None]


@dataclass(frozen=True)
class Plan:
    """One run: a setting, its tasks, and the file that keeps it."""

    setting: Setting
    rows: Rows
    path: Path


def planned(setting: Setting, tasks: int, folder: Path) -> Plan:
    """Return the run of a setting on the first tasks of its split."""
    most = find_method(setting.method).tasks
    rows = np.arange(tasks if most is None else min(tasks, most))
    words = [setting.method.replace(":", "."), f"{setting.budget}"]
    trained = split_file(family_problem(setting.problem), "train", splits_folder(setting))
    words += [f"pool{setting.pool}"] if 0 < setting.pool < count_tasks(trained) else []
    words += [f"noise{setting.noise:g}"] if setting.noise else []
    words += [f"delay{setting.delay:g}"] if setting.delay else []
    return Plan(setting, rows, folder / f"{'-'.join((*words, f'seed{setting.seed}'))}.npz")


def run_plans(
    plans: list[Plan], jobs: int, screen: Console
) -> tuple[list[EvaluationLog], Failures]:
    """Run what is not done yet, with a bar; return the logs, and why methods failed.

    One that fails leaves the others alone; it has no log then, whatever its other seeds did.
    """
    logs, failures = [], {}
    with _bar(screen, sum(len(plan.rows) for plan in plans)) as report:
        for plan in plans:
            if seedless(plan.setting) not in failures:
                try:
                    logs.append(_one(plan, jobs, report))
                except Failed as reason:
                    failures[seedless(plan.setting)] = str(reason)
    return [log for log in logs if seedless(log.setting) not in failures], failures


def seedless(setting: Setting) -> Setting:
    """Return a setting as all of its seeds have it."""
    return replace(setting, seed=0)


def _one(plan: Plan, jobs: int, report: Report) -> EvaluationLog:
    """Run what is not done yet; the log is kept as it grows."""

    def keep(grown: EvaluationLog) -> None:
        grown.save(plan.path)
        report(plan, grown)

    log = _earlier_log(plan)
    report(plan, log)
    return run(
        plan.setting, plan.rows, jobs=jobs, earlier_log=log, keep=keep, command=own_command()
    )


def _earlier_log(plan: Plan) -> EvaluationLog | None:
    """Return what an earlier run kept, unless the method or the split has changed since."""
    if not plan.path.exists():
        return None
    log = EvaluationLog.load(plan.path)
    return log if log.setting == plan.setting else None


@contextmanager
def _bar(screen: Console, total: int) -> Iterator[Report]:
    progress = counter(screen, "tasks")
    line = progress.add_task("starting", total=total)
    done: dict[Path, int] = {}

    def report(plan: Plan, log: EvaluationLog | None) -> None:
        done[plan.path] = len(np.intersect1d(plan.rows, log.rows)) if log else 0
        progress.update(line, completed=sum(done.values()), description=plan.setting.method)

    with progress:
        yield report
