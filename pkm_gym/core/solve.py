"""solve_tasks: differential evolution over many tasks at once; polish: the same from a near start.

The optimum of such a problem lies on kinks (several limits active at once, each the maximum over a
sampled workspace), where gradients mislead. Differential evolution on the exact-penalty merit needs
none, and its whole population for all tasks goes through one compiled ``evaluate`` a generation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray

# A stored optimum keeps every constraint at or below -1e-12; the rest is for rounding.
INSIDE = -1.1e-12

# A constraint within this of its limit at the optimum is called active.
ACTIVE = 1e-5

AGREEMENT = 1e-10
NEAR = 0.02  # a share of the range: how far a polish looks
PER_VARIABLE = 14  # members of the population for each variable
GENERATIONS = 1000
ROUNDS = 4  # further searches of a task whose searches disagree
CONVERGED = 1e-12
CHECK_EVERY = 10
CROSSOVER = 0.9
SCALE = (0.3, 0.8)

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
            merit (and in solvable); otherwise it is the best that is known.
        evaluations: how many designs were evaluated in all.
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


@dataclass
class _Search:
    """What one run of differential evolution found: the best strictly feasible design a task."""

    designs: FloatArray  # (n, d)
    log_merit: FloatArray  # (n,)
    solvable: BoolArray  # (n,)
    evaluations: int = 0


def solve_tasks(
    problem: DesignProblem,
    tasks: FloatArray,
    *,
    seed: int = 0,
    progress: Progress | None = None,
) -> Solutions:
    """Solve packed tasks (n, m): seeds of differential evolution that must agree to 1e-10.

    How many, the problem declares: two, more where it has many basins. So must a polish from the
    best of them. Tasks whose searches disagree are searched again
    with a population twice as large and a penalty ten times as heavy (where the multipliers exceed
    the merit's weight, its minimiser is no optimum), four times at most; what still disagrees is
    returned with ``certified`` False.

    Args:
        problem: the design problem; its first objective is optimised.
        tasks: array (n, m) of packed tasks.
        seed: of all searches.
        progress: called with the number of tasks finished so far.
    """
    tasks = np.atleast_2d(np.asarray(tasks, dtype=float))
    sequence = np.random.SeedSequence(seed)
    report = progress or (lambda _: None)
    best, *others = (
        _evolve(problem, tasks, np.random.default_rng(child))
        for child in sequence.spawn(problem.declared.searches)
    )
    agreed = np.ones(len(tasks), dtype=bool)
    for other in others:
        agreed &= _agree(best, other)
        best = _better(best, other)
    polisher = np.random.default_rng(sequence.spawn(1)[0])
    polished = _evolve(problem, tasks, polisher, near=best.designs, radius=NEAR)
    agreed &= _agree(best, polished)
    best = _better(best, polished)
    size, weight = PER_VARIABLE, 1.0
    for child in sequence.spawn(ROUNDS):
        report(int(agreed.sum()))
        open_tasks = np.flatnonzero(~agreed)
        if len(open_tasks) == 0:
            break
        size, weight = 2 * size, 10.0 * weight
        generator = np.random.default_rng(child)
        again = _evolve(problem, tasks[open_tasks], generator, size=size, weight=weight)
        known = _Search(
            best.designs[open_tasks], best.log_merit[open_tasks], best.solvable[open_tasks]
        )
        agreed[open_tasks] = _agree(known, again)
        better = _better(known, again)
        best.designs[open_tasks] = better.designs
        best.log_merit[open_tasks] = better.log_merit
        best.solvable[open_tasks] = better.solvable
        best.evaluations += again.evaluations
    report(len(tasks))
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

    Differential evolution from a population within ``radius`` (a share of the range) of the start.
    """
    designs = np.asarray(designs, dtype=float)
    rows = problem.pack(None)[None, :] if tasks is None else np.atleast_2d(tasks)
    rows = np.repeat(rows, len(designs), axis=0) if len(rows) == 1 else rows
    generator = np.random.default_rng(seed)
    found = _evolve(problem, rows, generator, near=designs, radius=radius)
    before = problem.evaluate(designs, rows)
    better = found.solvable & (~before.feasible | (found.log_merit < before.log_merit))
    closer = ~found.solvable & ~before.feasible & (found.log_merit < before.log_merit)
    return np.where((better | closer)[:, None], found.designs, designs)


def _evolve(
    problem: DesignProblem,
    tasks: FloatArray,
    generator: np.random.Generator,
    *,
    size: int = PER_VARIABLE,
    near: FloatArray | None = None,
    radius: float = 1.0,
    weight: float = 1.0,
) -> _Search:
    """Run current-to-best/1/bin on every task until its population's log merits agree.

    ``weight`` multiplies the penalty of the merit.
    """
    n, d = len(tasks), len(problem.variables)
    members = size * d
    population: FloatArray = _start(problem, n, members, generator, near, radius)
    found = _Search(population[:, 0].copy(), np.full(n, np.inf), np.zeros(n, dtype=bool))
    extra = (weight - 1.0) * problem.declared.penalty_weight
    merits = _measured(problem, tasks, population, np.arange(n), found, extra)
    running = np.arange(n)
    for generation in range(1, GENERATIONS + 1):
        trial = _trial(problem, population, merits, generator)
        trial_merits = _measured(problem, tasks[running], trial, running, found, extra)
        better = trial_merits <= merits
        population = np.where(better[..., None], trial, population)
        merits = np.where(better, trial_merits, merits)
        if generation % CHECK_EVERY == 0:
            spread = merits.max(axis=1) - merits.min(axis=1)
            kept = spread > CONVERGED
            running, population, merits = running[kept], population[kept], merits[kept]
            if len(running) == 0:
                break
    return found


def _start(
    problem: DesignProblem,
    n: int,
    members: int,
    generator: np.random.Generator,
    near: FloatArray | None,
    radius: float,
) -> FloatArray:
    shape = (n, members, len(problem.variables))
    span = problem.high - problem.low
    if near is None:
        return problem.low + span * generator.random(shape)
    offsets = radius * span * generator.uniform(-1.0, 1.0, shape)
    offsets[:, 0] = 0.0
    return np.clip(near[:, None, :] + offsets, problem.low, problem.high)


def _trial(
    problem: DesignProblem,
    population: FloatArray,
    merits: FloatArray,
    generator: np.random.Generator,
) -> FloatArray:
    n, members, _ = population.shape
    member = np.arange(members)
    others = (member + generator.integers(1, members, (2, n, members))) % members
    one, other = (np.take_along_axis(population, index[..., None], axis=1) for index in others)
    best = population[np.arange(n), merits.argmin(axis=1)][:, None, :]
    scale = generator.uniform(*SCALE, (n, members, 1))
    mutant = population + scale * (best - population) + scale * (one - other)
    trial = np.where(generator.random(population.shape) < CROSSOVER, mutant, population)
    trial = np.where(trial < problem.low, 0.5 * (problem.low + population), trial)
    return np.where(trial > problem.high, 0.5 * (problem.high + population), trial)


def _measured(
    problem: DesignProblem,
    tasks: FloatArray,
    population: FloatArray,
    running: np.ndarray[tuple[int], np.dtype[np.intp]],
    found: _Search,
    extra: float,
) -> FloatArray:
    """Return the log merits of a population and keep each task's best strictly feasible member.

    ``extra`` is what the broken constraints weigh more than in the merit. Until a task has a
    feasible member, its one of lowest merit is kept.
    """
    n, members, d = population.shape
    rows = np.repeat(tasks, members, axis=0)
    evaluation = problem.evaluate(population.reshape(-1, d), rows)
    found.evaluations += n * members
    penalty = extra * np.maximum(evaluation.constraints, 0.0).sum(axis=1)
    merits = (evaluation.log_merit + penalty).reshape(n, members)
    inside = (evaluation.constraints <= INSIDE).all(axis=1).reshape(n, members)
    any_inside = np.asarray(inside.any(axis=1))
    at = np.where(
        any_inside, np.where(inside, merits, np.inf).argmin(axis=1), merits.argmin(axis=1)
    )
    value = merits[np.arange(n), at]
    known = found.solvable[running]
    lower = value < found.log_merit[running]
    better = np.where(any_inside == known, lower, any_inside)
    index = running[better]
    found.designs[index] = population[better, at[better]]
    found.log_merit[index] = value[better]
    found.solvable[index] |= any_inside[better]
    return merits


def _agree(first: _Search, second: _Search) -> BoolArray:
    close = np.abs(first.log_merit - second.log_merit) <= AGREEMENT
    return (first.solvable == second.solvable) & (close | ~first.solvable)


def _better(first: _Search, second: _Search) -> _Search:
    wins = np.where(
        first.solvable == second.solvable,
        first.log_merit <= second.log_merit,
        first.solvable,
    )
    return _Search(
        np.where(wins[:, None], first.designs, second.designs),
        np.where(wins, first.log_merit, second.log_merit),
        np.where(wins, first.solvable, second.solvable),
        first.evaluations + second.evaluations,
    )
