"""Tasks of the Family solved chunk after chunk, kept and reported."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from functools import partial
from multiprocessing import get_context
from multiprocessing.pool import Pool
from pathlib import Path
from signal import SIG_IGN, SIGINT, signal
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress, TaskID

from pkm_gym.core.pool import write_npz
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import about, check_arrays, read_npz
from pkm_gym.core.solve import AGREEMENT, ARRAYS, ENOUGH_STARTS, Solutions, solve_tasks
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.cli.runs import if_full
from pkm_gym.studies.cli.terminal import BAD, FAINT, GOOD, counter, section, table

CHUNK = 256  # tasks solved at once, and lost at most when the run is stopped
MEASURED = ("optima", "values", "log_merit", "constraints")
FEW = 16  # the same where one process descends for one task after the other, fewer with effort
NAMED = 20  # uncertified tasks that are named one by one


@dataclass(frozen=True)
class Job:
    """What is to be solved, and the file in which finished chunks wait for the others."""

    problem: DesignProblem
    tasks: FloatArray
    starts: FloatArray
    seed: int
    command: str
    part: Path
    effort: int = 0

    @property
    def chunk(self) -> int:
        """How many tasks are solved at once."""
        return max(1, FEW >> self.effort) if self.problem.declared.starts else CHUNK

    def chunks(self, done: int) -> Iterator[tuple[int, FloatArray]]:
        """Yield a seed and the tasks of each chunk beyond the first ``done`` tasks."""
        for chunk, first in enumerate(range(0, len(self.tasks), self.chunk)):
            if first >= done:
                state = np.random.SeedSequence([self.seed, chunk]).generate_state(1, np.uint64)
                yield int(state[0]), self.tasks[first : first + self.chunk]

    def keep(self, solved: Solutions) -> None:
        """Write what is solved so far."""
        content = {item.name: getattr(solved, item.name) for item in fields(Solutions)}
        write_npz(self.part, {**content, "hash": self.problem.hash(), "command": self.command})

    def kept(self) -> Solutions | None:
        """Read what an earlier run of the same command has solved.

        Raises:
            ValueError: for a part file that is unreadable or belongs to another run.
        """
        if not self.part.exists():
            return None
        again = f"delete it, or choose another file with -o, to solve {self.problem.name} afresh"
        try:
            content = read_npz(self.part, "expected a part of a pool")
            with about(self.part, "part of a pool"):
                check_arrays(content, dict.fromkeys(("hash", "command"), ("U", ())))
            self._check_owner(content)
            with about(self.part, "part of a pool"):
                check_arrays(content, self._wanted())
        except ValueError as error:
            raise ValueError(f"{error}; {again}") from None
        return Solutions(
            **{name: content[name] for name in ARRAYS},
            evaluations=int(content["evaluations"]),
            seconds=float(content["seconds"]),
        )

    def _check_owner(self, content: Mapping[str, Any]) -> None:
        tasks = np.atleast_1d(content.get("tasks", self.tasks[:0]))
        command = str(content["command"])
        same = np.array_equal(tasks, self.tasks[: len(tasks)])
        if (str(content["hash"]), command) != (self.problem.hash(), self.command) or not same:
            raise ValueError(
                f"{str(self.part)!r} was left by another run ({command!r}): go on with that one"
            )

    def _wanted(self) -> dict[str, tuple[str, tuple[int | str, ...]]]:
        d, c = len(self.problem.low), len(self.problem.constraint_names)
        return {
            "hash": ("U", ()),
            "command": ("U", ()),
            "tasks": ("f", ("n", self.tasks.shape[1])),
            "designs": ("f", ("n", d)),
            **{name: ("f", ("n", c) if name == "constraints" else ("n",)) for name in MEASURED},
            "active": ("b", ("n", c)),
            "solvable": ("b", ("n",)),
            "certified": ("b", ("n",)),
            "evaluations": ("iu", ()),
            "seconds": ("f", ()),
        }


def solve(job: Job, screen: Console) -> Solutions:
    """Solve chunk after chunk, keep each, and report; what an earlier run kept is taken up."""
    solved = job.kept()
    resumed = solved.evaluations if solved else 0
    began = time.monotonic()
    with saving(job, screen):
        solved = solve_rest(job, solved, screen)
    seconds = time.monotonic() - began
    _summarise(screen, job.problem, solved)
    evaluations = solved.evaluations - resumed
    screen.print(
        f"{evaluations:,} evaluations in {seconds:.1f} s"
        + (f", {resumed:,} more by an earlier run" if resumed else ""),
        style=FAINT,
    )
    return solved


@contextmanager
def saving(job: Job, screen: Console) -> Iterator[None]:
    """Say what becomes of what is solved when the disk is full or Ctrl-C is pressed."""
    try:
        with if_full(
            f"what is solved is kept in {job.part}, and the same command goes on", job.part
        ):
            yield
    except KeyboardInterrupt:
        screen.print(
            f"what is solved is kept in {job.part}: the same command goes on from there"
            if job.part.exists()
            else f"nothing is kept before the first {job.chunk} tasks are solved",
            soft_wrap=True,
        )
        raise


def solve_rest(job: Job, solved: Solutions | None, screen: Console) -> Solutions:
    """Solve what an earlier run hasn't, chunk after chunk, and keep each; a bar tells how far."""
    with counter(screen, "tasks") as bar:
        done = len(solved.tasks) if solved else 0
        line = bar.add_task("solving", total=len(job.tasks), completed=done)
        parts = (
            _descents(job, done) if job.problem.declared.starts else _searches(job, done, bar, line)
        )
        for part in parts:
            solved = _joined(solved, part)
            bar.update(line, completed=len(solved.tasks))
            job.keep(solved)
    assert solved is not None  # there is at least one task
    return solved


def _searches(job: Job, done: int, bar: Progress, line: TaskID) -> Iterator[Solutions]:
    """Yield chunk after chunk, each solved on all cores."""
    for seed, tasks in job.chunks(done):
        yield solve_tasks(
            job.problem,
            tasks,
            seed=seed,
            effort=job.effort,
            progress=partial(_advance, bar, line, done),
        )
        done += len(tasks)


def _descents(job: Job, done: int) -> Iterator[Solutions]:
    """Yield chunk after chunk, each solved by a process of its own."""
    chunks = ((job.problem, seed, job.effort, tasks) for seed, tasks in job.chunks(done))
    with workers() as pool:
        yield from pool.imap(_solve_chunk, chunks)


def workers() -> Pool:
    """Return a process for each core; whoever leaves them ends them."""
    return get_context("spawn").Pool(initializer=_work_alone)


def _work_alone() -> None:
    """Leave the other cores and Ctrl-C to others."""
    import numba

    numba.set_num_threads(1)
    signal(SIGINT, SIG_IGN)


def _solve_chunk(chunk: tuple[DesignProblem, int, int, FloatArray]) -> Solutions:
    problem, seed, effort, tasks = chunk
    return solve_tasks(problem, tasks, seed=seed, effort=effort)


def _advance(bar: Progress, line: TaskID, before: int, count: int) -> None:
    bar.update(line, completed=before + count)


def _joined(first: Solutions | None, second: Solutions) -> Solutions:
    if first is None:
        return second
    arrays = {
        name: np.concatenate([getattr(first, name), getattr(second, name)]) for name in ARRAYS
    }
    return Solutions(
        **arrays,
        evaluations=first.evaluations + second.evaluations,
        seconds=first.seconds + second.seconds,
    )


def _summarise(screen: Console, problem: DesignProblem, solved: Solutions) -> None:
    n, solvable = len(solved.tasks), int(solved.solvable.sum())
    certified = int(solved.certified.sum())
    rows = table("tasks", "count", "share", numbers=["count", "share"])
    rows.add_row("drawn", f"{n}", "")
    rows.add_row("solvable", f"{solvable}", _share(solvable, n))
    style = GOOD if certified == n else BAD
    rows.add_row("certified", f"{certified}", _share(certified, n), style=style)
    screen.print(rows)
    open_tasks = np.flatnonzero(~solved.certified)
    if len(open_tasks):
        named = ", ".join(map(str, open_tasks[:NAMED])) + (" ..." if certified < n - NAMED else "")
        why = (
            f"since two seeds differ by more than {AGREEMENT:g}"
            if problem.declared.searches > 1
            else f"since not two searches of {ENOUGH_STARTS} starts or more reach the best"
        )
        screen.print(f"not certified, {why}: tasks {named}", style=BAD)
    screen.print(section("Limits that hold the optima back"))
    limits = table("limit", "optima", "share", numbers=["optima", "share"])
    for name, count in zip(problem.constraint_names, solved.active.sum(axis=0), strict=True):
        if count:
            limits.add_row(name, f"{count}", _share(count, solvable))
    screen.print(limits)


def _share(count: int, whole: int) -> str:
    return f"{100.0 * count / whole:.1f} %" if whole else ""
