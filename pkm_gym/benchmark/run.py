"""run: a method on the tasks of a split, spread over processes, kept as it goes."""

from __future__ import annotations

import hashlib
import signal
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from pkm_gym.benchmark.methods import (
    Method,
    Search,
    evaluated_on_import,
    find_method,
    method_module,
)
from pkm_gym.benchmark.record import Cost, EvaluationLog, Setting
from pkm_gym.benchmark.scoring import regrets
from pkm_gym.benchmark.session import Session, Spent
from pkm_gym.benchmark.sources import sources
from pkm_gym.benchmark.splits import closed_to, count_tasks, load_split, sha256, split_file
from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import View
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.tally import TALLY
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import lasting

CHUNK = 4  # tasks between two savings

Rows = npt.NDArray[np.int64]
Keep = Callable[[EvaluationLog], None]


class Failed(ValueError):  # noqa: N818  # it says so of a method
    """A method ended otherwise than it should; the sentence says how."""


def setting(
    name: str,
    split: str,
    method: str,
    *,
    seed: int = 0,
    evaluations: int = 300,
    pool: int | None = None,
    noise: float = 0.0,
    delay: float = 0.0,
    folder: Path | None = None,
) -> Setting:
    """Return how a method is to be run, checked.

    Args:
        name: the design problem, or "module:Class".
        split: "val", "test" or "ood".
        method: its name, or "module:attribute".
        seed: of its random numbers.
        evaluations: allowed on each task, if the method takes so many.
        pool: how many of the training tasks a *transfer* method may know, all of them if None; one
            that was trained before is taken to know all.
        noise: standard deviation of the relative error in what the method is told.
        delay: seconds that each evaluation takes longer.
        folder: of the splits; see ``load_split``.

    Raises:
        ValueError: in one sentence, for an unknown problem, split or method, or a bad number.
    """
    chosen = find_method(method)
    for what, value, least in (
        ("evaluations", evaluations, 1), ("seed", seed, 0), ("pool", pool, 1),
        ("noise", noise, 0), ("delay", delay, 0),
    ):  # fmt: skip
        if value is not None and not value >= least:
            raise ValueError(f"{what} is {value}: it must be at least {least}")
    problem, _ = load_split(name, split, folder)
    transfer = chosen.knowledge == "transfer"
    if transfer:
        load_split(name, "train", folder)  # refuses where there is none
    trained = count_tasks(split_file(problem, "train", folder))
    if pool is not None and pool > trained:
        raise ValueError(f"pool is {pool}: there are {trained} training tasks")
    lasts = lasting(problem)
    return Setting(
        problem=lasts,
        split=split,
        hash=problem.hash(),
        sha256=sha256(split_file(problem, split, folder)),
        method=method,
        source=_source(chosen, method, lasts),
        start=chosen.start,
        knowledge=chosen.knowledge,
        seed=seed,
        budget=min(evaluations, chosen.evaluations),
        pool=(trained if chosen.training else pool or trained) if transfer else 0,
        noise=noise,
        delay=delay,
        folder=str(folder or ""),
    )


def splits_folder(setting: Setting) -> Path | None:
    """Return the folder of a setting's splits, None for the problem's own."""
    return Path(setting.folder) if setting.folder else None


def _source(method: Method, called: str, name: str) -> str:
    """Return the sha256 of the files that a method's results on a problem depend on."""
    modules = {method_module(called), getattr(method.prepare, "__module__", "")}
    files = [path for module in sorted(modules) if module for path in sources(sys.modules[module])]
    files += method.files(name) if method.files else ()
    return hashlib.sha256("".join(map(sha256, files)).encode()).hexdigest()


def run(
    setting: Setting,
    rows: Rows,
    *,
    jobs: int = 1,
    earlier_log: EvaluationLog | None = None,
    keep: Keep = lambda _: None,
    command: str = "pkm_gym.benchmark.run",
) -> EvaluationLog:
    """Run a method on tasks of a split.

    Args:
        setting: the method and its setting, as ``setting`` returns it.
        rows: array (n,), which tasks of the split.
        jobs: number of processes.
        earlier_log: what an earlier run of the same setting did; its tasks are not repeated.
        keep: called with all that is done after every few tasks.
        command: what the log says wrote it.

    Raises:
        Failed: in one sentence, for a method that fails, or leaves the bounds.
        ValueError: in one sentence, for one that beats a certified optimum.
    """
    problem, split = load_split(setting.problem, setting.split, splits_folder(setting))
    done = earlier_log or _empty(setting, problem, command)
    todo = np.setdiff1d(rows, done.rows)
    chunks = [todo[i : i + CHUNK] for i in range(0, len(todo), CHUNK)]
    for part in _parts(setting, chunks, jobs):
        done = done.joined(part)
        keep(done)
        regrets(part, problem, split)  # refuses what beats an optimum
    return done.only(np.sort(rows))


def _empty(setting: Setting, problem: DesignProblem, command: str) -> EvaluationLog:
    training = find_method(setting.method).training
    return EvaluationLog(
        setting,
        rows=np.empty(0, dtype=np.int64),
        designs=np.empty((0, setting.budget, len(problem.low))),
        seconds=np.empty(0),
        learned=np.empty(0, dtype=np.int64),
        outside=np.empty(0, dtype=np.int64),
        version=version("pkm_gym"),
        command=command,
        training=training(setting.problem) if training else Cost(),
    )


def _parts(setting: Setting, chunks: list[Rows], jobs: int) -> Iterator[EvaluationLog]:
    if jobs == 1 or len(chunks) < 2:
        yield from (_solve(setting, rows) for rows in chunks)
        return
    with _workers(jobs) as executor:
        for future in as_completed([executor.submit(_solve, setting, rows) for rows in chunks]):
            try:
                yield future.result()
            except BrokenProcessPool:
                raise Failed(f"{setting.method} ended a process that it ran in") from None


@contextmanager
def _workers(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Give processes that end with this one, at Ctrl-C and after a failure too."""
    executor = ProcessPoolExecutor(jobs, mp_context=get_context("spawn"), initializer=_alone)
    try:
        yield executor
    except BaseException:
        processes = list((executor._processes or {}).values())
        executor.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        raise
    executor.shutdown()


def _alone() -> None:
    """Use one thread in this process, and end without a word at Ctrl-C."""
    import numba

    signal.signal(signal.SIGINT, signal.SIG_DFL)
    numba.set_num_threads(1)


class _Prepared(NamedTuple):
    problem: DesignProblem
    split: Pool
    method: Method
    training: Training | None
    search: Search
    cost: Cost
    outside: int


@lru_cache(maxsize=4)
def _prepared(name: str, split: str, method: str, pool_size: int, folder: Path | None) -> _Prepared:
    problem, tasks = load_split(name, split, folder)
    chosen = find_method(method)
    training = None
    if chosen.knowledge == "transfer":
        training = Training(problem, load_split(name, "train", folder)[1].first(pool_size))
    view, began, before = View.of(problem), time.process_time(), TALLY.designs
    try:
        with closed_to(method):
            search = chosen.prepare(view, training)
    except (Exception, SystemExit) as error:
        raise Failed(f"{method} failed while it prepared: {_said(error)}") from error
    learned = training.count if training else 0
    if training:
        training.close()
    cost = Cost(learned, time.process_time() - began)
    outside = evaluated_on_import(method) + TALLY.designs - before - learned
    return _Prepared(problem, tasks, chosen, training, search, cost, outside)


def _solve(setting: Setting, rows: Rows) -> EvaluationLog:
    """Run the method on some tasks."""
    prepared = _prepared(
        setting.problem, setting.split, setting.method, setting.pool, splits_folder(setting)
    )
    log = _empty(setting, prepared.problem, "")
    d = len(prepared.problem.low)
    designs = np.full((len(rows), setting.budget, d), np.nan)
    seconds, counts = np.empty(len(rows)), np.empty((2, len(rows)), dtype=np.int64)
    with threadpool_limits(limits=1):  # sums of matrices keep their order
        for i, row in enumerate(rows):
            began = time.perf_counter()
            evaluated, *counts[:, i] = _search(setting, prepared, int(row))
            seconds[i] = time.perf_counter() - began
            designs[i, : len(evaluated)] = evaluated
    return replace(
        log,
        rows=rows,
        designs=designs,
        seconds=seconds,
        learned=counts[0],
        outside=counts[1],
        preparation=prepared.cost,
    )


def _search(setting: Setting, prepared: _Prepared, row: int) -> tuple[FloatArray, int, int]:
    """Return what the method evaluates on a task.

    The designs (count, d), how many it evaluates on training tasks, and how many past the door.
    """
    session = Session(
        prepared.problem,
        prepared.split.tasks[row],
        budget=setting.budget,
        start=prepared.split.starts[row] if prepared.method.start == "given" else None,
        seed=[setting.seed, row],
        noise=setting.noise,
        delay=setting.delay,
    )
    training = prepared.training
    known, before = training.count if training else 0, TALLY.designs
    try:
        with closed_to(setting.method):
            prepared.search(session)
    except Spent:
        pass
    except (Exception, SystemExit) as error:
        raise Failed(
            f"{setting.method} failed on {setting.split} task {row} after {session.count} "
            f"evaluations: {_said(error)}"
        ) from error
    learned = training.count - known if training else 0
    outside = TALLY.designs - before - session.count - learned
    return session.designs, learned, abs(outside) + abs(prepared.outside)


def _said(error: BaseException) -> str:
    said = str(error).splitlines()
    return f"{type(error).__name__}: {said[0]}" if said else type(error).__name__
