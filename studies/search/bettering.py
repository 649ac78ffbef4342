"""Tasks solved once more, from other starts: what their searches had missed.

From the optima of tasks nearby; from what differential evolution finds: a basin to which hardly a
descent leads, since most end where a limit can't be kept, may be easy for a population; and from
what a method of the benchmark has found.
"""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from rich.console import Console

from pkm_gym.benchmark.record import EvaluationLog
from pkm_gym.core.evolution import evolve
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import ARRAYS, Solutions, improved
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.studies.cli.terminal import counter
from pkm_gym.studies.search.solving import Job, saving, workers


def from_neighbours(
    job: Job,
    solved: Solutions,
    screen: Console,
    known: tuple[FloatArray, FloatArray] | None = None,
) -> Solutions:
    """Return solutions of tasks with what descents from neighbouring tasks' optima find better.

    Args:
        job: its problem says from how many neighbours each task is descended to; its part file
            keeps what is bettered.
        solved: its tasks.
        screen: where the progress is shown.
        known: tasks (n, m) and optima (n, d) of another split; if not given, a task's neighbours
            are among ``solved``, round after round; one that was stopped is begun again.
    """
    problem = job.problem
    if known is not None:
        starts = known[1][_nearest(problem, solved.tasks, known[0], own=False)]
        return _round(job, solved, starts, _all(starts), screen, "neighbours")[0]
    rows = np.flatnonzero(solved.solvable)
    nearest = rows[_nearest(problem, solved.tasks, solved.tasks[rows], own=True)]
    asked, done = _all(nearest), 0
    while asked.any() and done != problem.declared.rounds:
        starts = solved.designs[nearest]
        solved, gained = _round(job, solved, starts, asked, screen, "neighbours")
        asked = gained[nearest].any(axis=1)  # those with a neighbour whose optimum is a new one
        done += 1
    return solved


def from_evolution(job: Job, solved: Solutions, screen: Console) -> Solutions:
    """Return solutions of tasks with what descents from evolved designs find better.

    As many independent evolutions as the problem declares.
    """
    problem, ends, evaluations, began = job.problem, [], 0, time.process_time()
    count = problem.declared.evolutions
    with counter(screen, "evolutions") as bar:
        line = bar.add_task("evolving", total=count)
        for child in np.random.SeedSequence(0).spawn(count):
            found = evolve(problem, solved.tasks, np.random.default_rng(child))
            ends.append(found.designs)
            evaluations += found.evaluations
            bar.advance(line)
    starts, seconds = np.stack(ends, axis=1), time.process_time() - began
    better = _round(job, solved, starts, _all(starts), screen, "evolution")[0]
    return replace(
        better, evaluations=better.evaluations + evaluations, seconds=better.seconds + seconds
    )


def from_log(job: Job, solved: Solutions, screen: Console, log: EvaluationLog) -> Solutions:
    """Return solutions of tasks with what descents from the best designs of a log find better."""
    starts, asked = solved.designs.copy(), np.zeros(len(solved.tasks), dtype=bool)
    for row, designs, count in zip(log.rows, log.designs, log.counts, strict=True):
        if count:
            tasks = np.repeat(solved.tasks[row][None], count, axis=0)
            found = job.problem.evaluate(designs[:count], tasks)
            starts[row], asked[row] = found.designs[found.log_merit.argmin()], True
    words = f"what {log.setting.method} found"
    return _round(job, solved, starts[:, None], asked, screen, words)[0]


def _all(rows: np.ndarray) -> BoolArray:
    return np.ones(len(rows), dtype=bool)


def _nearest(
    problem: DesignProblem, tasks: FloatArray, known: FloatArray, *, own: bool
) -> np.ndarray:
    """Return the rows (n, k) of the known tasks nearest to tasks (n, m), never the task itself."""
    from scipy.spatial import KDTree

    drawn = [k for k, v in enumerate(problem.task_variables) if v.drawn]
    span = np.array([v.high - v.low for v in problem.task_variables])[drawn]
    count = problem.declared.neighbours
    tree = KDTree(known[:, drawn] / span)
    found = np.asarray(tree.query(tasks[:, drawn] / span, k=count + own)[1])
    if not own:
        return found.reshape(len(tasks), count)
    itself = (known[found] == tasks[:, None]).all(axis=-1)
    itself[:, -1] |= ~itself.any(axis=1)  # an unsolvable task isn't among the known
    return found[~itself].reshape(len(tasks), count)


def _round(
    job: Job,
    solved: Solutions,
    starts: FloatArray,
    asked: BoolArray,
    screen: Console,
    words: str,
) -> tuple[Solutions, BoolArray]:
    """Return the solutions of all tasks, those ``asked`` (n,) once more, and which are better."""
    rows, gained = np.flatnonzero(asked), np.zeros(len(asked), dtype=bool)
    parts = [rows[first : first + job.chunk] for first in range(0, len(rows), job.chunk)]
    chunks = ((job.problem, _part(solved, part), starts[part]) for part in parts)
    with saving(job, screen), counter(screen, "tasks") as bar, workers() as pool:
        line = bar.add_task(f"from {words}", total=len(rows))
        for part, (found, better) in zip(parts, pool.imap(_improve, chunks), strict=True):
            solved, gained[part] = _with(solved, part, found), better
            job.keep(solved)
            bar.advance(line, len(part))
    screen.print(f"from {words}: {int(gained.sum())} of {len(rows)} optima bettered")
    return solved, gained


def _with(solved: Solutions, rows: np.ndarray, found: Solutions) -> Solutions:
    arrays = {name: getattr(solved, name).copy() for name in ARRAYS}
    for name, array in arrays.items():
        array[rows] = getattr(found, name)
    return Solutions(
        **arrays,
        evaluations=solved.evaluations + found.evaluations,
        seconds=solved.seconds + found.seconds,
    )


def _part(solved: Solutions, rows: np.ndarray) -> Solutions:
    arrays = {name: getattr(solved, name)[rows] for name in ARRAYS}
    return Solutions(**arrays, evaluations=0, seconds=0.0)


def _improve(chunk: tuple[DesignProblem, Solutions, FloatArray]) -> tuple[Solutions, BoolArray]:
    return improved(*chunk)
