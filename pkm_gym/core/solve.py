"""solve_tasks: searches of many tasks' optima that must agree; polish: the same from a near start.

A search is differential evolution, or, where the problem declares ``starts``, descents from many of
them: see ``evolution`` and ``descent``.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import reduce

import numpy as np

from pkm_gym.core.descent import descend
from pkm_gym.core.evolution import Search, evolve
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray

# A constraint within this of its limit at the optimum is called active.
ACTIVE = 1e-5

AGREEMENT = 1e-10
SAME = 1e-8  # of log merits, of one optimum that another descent tells with more digits
ENOUGH_STARTS = 96  # from which on two searches that reach the best certify it, of many basins
NEAR = 0.02  # a share of the range: how far a polish looks
ROUNDS = 4  # further searches of a task whose searches disagree

Progress = Callable[[int], None]


@dataclass(frozen=True)
class Solutions:
    """Optima of n tasks.

    Attributes:
        tasks: array (n, m).
        designs: array (n, d), every constraint <= -1e-12; the least violating one if unsolvable.
        optima: array (n,), the first objective there; NaN if unsolvable.
        values: array (n,), the same, and of the least violating design where it has one.
        constraints: array (n, c) there.
        log_merit: array (n,), the log merit there.
        active: array (n, c), the constraints that hold the optimum back.
        solvable: array (n,), whether a feasible design was found.
        certified: array (n,), whether the searches and a polish of the best agree to 1e-10 in log
            merit (and in solvable), or, where one search is declared, two of many reach the best to
            1e-8 from 96 starts or more; otherwise it is the best that is known.
        evaluations: how many designs were evaluated in all.
        seconds: of processor time that this took.
    """

    tasks: FloatArray
    designs: FloatArray
    optima: FloatArray
    values: FloatArray
    constraints: FloatArray
    log_merit: FloatArray
    active: BoolArray
    solvable: BoolArray
    certified: BoolArray
    evaluations: int
    seconds: float


ARRAYS = tuple(f.name for f in fields(Solutions) if f.name not in ("evaluations", "seconds"))


def solve_tasks(
    problem: DesignProblem,
    tasks: FloatArray,
    *,
    seed: int = 0,
    effort: int = 0,
    progress: Progress | None = None,
) -> Solutions:
    """Solve packed tasks (n, m): searches from different seeds that must agree to 1e-10.

    How many, the problem declares: two, more where it has many basins. So must a polish from the
    best of them. Tasks whose searches disagree are searched again with more effort: with a
    population twice as large and a penalty ten times as heavy (where the multipliers exceed the
    merit's weight, its minimiser is no optimum), or from twice as many starts; four times at most.
    What still disagrees is returned with ``certified`` False.

    Where one search is declared, there are so many basins that most searches miss the best: then
    2^``effort`` of them are independent, and none is repeated.

    Args:
        problem: the design problem; its first objective is optimised.
        tasks: array (n, m) of packed tasks.
        seed: of all searches.
        effort: of the first searches, each as thorough as ``effort`` disagreements would make it;
            where one is declared, the power of two of their number.
        progress: called with the number of tasks finished so far.
    """
    began = time.process_time()
    tasks = np.atleast_2d(np.asarray(tasks, dtype=float))
    sequence = np.random.SeedSequence(seed)
    report = progress or (lambda _: None)
    search = _search(problem)
    if problem.declared.searches == 1:
        return _of_many_basins(problem, tasks, sequence, effort, report, began)
    best, *others = (
        search(problem, tasks, np.random.default_rng(child), effort=effort)
        for child in sequence.spawn(problem.declared.searches)
    )
    agreed = np.ones(len(tasks), dtype=bool)
    for other in others:
        agreed &= _agree(best, other)
        best = _better(best, other)
    polisher = np.random.default_rng(sequence.spawn(1)[0])
    polished = search(problem, tasks, polisher, near=best.designs, radius=NEAR)
    agreed &= _agree(best, polished)
    best = _better(best, polished)
    for harder, child in enumerate(sequence.spawn(ROUNDS), effort + 1):
        report(int(agreed.sum()))
        open_tasks = np.flatnonzero(~agreed)
        if len(open_tasks) == 0:
            break
        generator = np.random.default_rng(child)
        again = search(problem, tasks[open_tasks], generator, effort=harder)
        known = Search(
            best.designs[open_tasks], best.log_merit[open_tasks], best.solvable[open_tasks]
        )
        agreed[open_tasks] = _agree(known, again)
        better = _better(known, again)
        best.designs[open_tasks] = better.designs
        best.log_merit[open_tasks] = better.log_merit
        best.solvable[open_tasks] = better.solvable
        best.evaluations += again.evaluations
    report(len(tasks))
    return _solutions(problem, tasks, best, agreed, began)


def _of_many_basins(
    problem: DesignProblem,
    tasks: FloatArray,
    sequence: np.random.SeedSequence,
    effort: int,
    report: Progress,
    began: float,
) -> Solutions:
    """Return the best of 2^effort independent searches and of a polish."""
    search, count = _search(problem), 2**effort
    searches = [
        search(problem, tasks, np.random.default_rng(child)) for child in sequence.spawn(count)
    ]
    best = reduce(_better, searches)
    merits = np.array([np.where(one.solvable, one.log_merit, np.inf) for one in searches])
    reached = (merits <= best.log_merit + SAME).sum(axis=0)
    enough = count * problem.declared.starts >= ENOUGH_STARTS
    polisher = np.random.default_rng(sequence.spawn(1)[0])
    polished = search(problem, tasks, polisher, near=best.designs, radius=NEAR)
    better = polished.solvable & (polished.log_merit < best.log_merit - SAME)
    report(len(tasks))
    agreed = enough & (reached >= 2) & ~better
    return _solutions(problem, tasks, _better(best, polished), agreed, began)


def improved(
    problem: DesignProblem, solved: Solutions, starts: FloatArray
) -> tuple[Solutions, BoolArray]:
    """Return solutions with what descents from further starts (n, k, d) find better, and where.

    An optimum that is found so is the best known, not certified: the searches had missed it. One
    that is only told with more digits stays what it was.
    """
    began = time.process_time()
    best = Search(solved.designs.copy(), solved.log_merit.copy(), solved.solvable.copy())
    generator = np.random.default_rng(0)  # a descent from a given start draws nothing
    search, evaluations = _search(problem), 0
    radius = 1.0 if search is descend else NEAR  # over which a population is spread
    for k in range(starts.shape[1]):
        ends = search(problem, solved.tasks, generator, near=starts[:, k], radius=radius)
        best = _better(best, ends)
        evaluations += ends.evaluations
    gained = best.solvable & (~solved.solvable | (best.log_merit < solved.log_merit - AGREEMENT))
    rows = np.flatnonzero(gained)
    same = solved.solvable & (best.log_merit > solved.log_merit - SAME)
    found = _solutions(
        problem,
        solved.tasks[rows],
        Search(best.designs[rows], best.log_merit[rows], best.solvable[rows]),
        (solved.certified & same)[rows],
        began,
    )
    merged = {name: getattr(solved, name).copy() for name in ARRAYS}
    for name, array in merged.items():
        array[rows] = getattr(found, name)
    spent = solved.evaluations + evaluations, solved.seconds + found.seconds
    return Solutions(**merged, evaluations=spent[0], seconds=spent[1]), gained


def _solutions(
    problem: DesignProblem, tasks: FloatArray, best: Search, agreed: BoolArray, began: float
) -> Solutions:
    """Return the solutions of tasks (n, m), of designs alike one; ``began``: processor time, s."""
    kept = best.solvable
    best.designs[kept] = problem.one_of_alike(best.designs[kept], tasks[kept])
    evaluation = problem.evaluate(best.designs, tasks)
    return Solutions(
        tasks=tasks,
        designs=best.designs,
        optima=np.where(best.solvable, evaluation.objectives[:, 0], np.nan),
        values=evaluation.objectives[:, 0],
        constraints=evaluation.constraints,
        log_merit=evaluation.log_merit,
        active=(evaluation.constraints > -ACTIVE) & best.solvable[:, None],
        solvable=best.solvable,
        certified=agreed,
        evaluations=best.evaluations,
        seconds=time.process_time() - began,
    )


def polish(
    problem: DesignProblem,
    designs: FloatArray,
    tasks: FloatArray | None = None,
    *,
    radius: float = NEAR,
    seed: int = 0,
) -> FloatArray:
    """Return the local optimum near each design (n, d): never a worse answer than the start.

    A search within ``radius`` (a share of the range) of the start.
    """
    designs = np.asarray(designs, dtype=float)
    rows = problem.pack(None)[None, :] if tasks is None else np.atleast_2d(tasks)
    rows = np.repeat(rows, len(designs), axis=0) if len(rows) == 1 else rows
    generator = np.random.default_rng(seed)
    found = _search(problem)(problem, rows, generator, near=designs, radius=radius)
    before = problem.evaluate(designs, rows)
    better = found.solvable & (~before.feasible | (found.log_merit < before.log_merit))
    closer = ~found.solvable & ~before.feasible & (found.log_merit < before.log_merit)
    return np.where((better | closer)[:, None], found.designs, designs)


def _search(problem: DesignProblem) -> Callable[..., Search]:
    """Return how a problem is searched: starts are declared for the first of its objectives."""
    first = problem.objectives[0].name == problem.declared.objectives[0].name
    return descend if problem.declared.starts and first else evolve


def _agree(first: Search, second: Search) -> BoolArray:
    close = np.abs(first.log_merit - second.log_merit) <= AGREEMENT
    return (first.solvable == second.solvable) & (close | ~first.solvable)


def _better(first: Search, second: Search) -> Search:
    wins = np.where(
        first.solvable == second.solvable,
        first.log_merit <= second.log_merit,
        first.solvable,
    )
    return Search(
        np.where(wins[:, None], first.designs, second.designs),
        np.where(wins, first.log_merit, second.log_merit),
        np.where(wins, first.solvable, second.solvable),
        first.evaluations + second.evaluations,
    )
