"""Differential evolution over many tasks at once: the global search of a task's optimum.

The optimum of such a problem lies on kinks (several limits active at once, each the maximum over a
sampled workspace), where gradients mislead. Differential evolution on the exact-penalty merit needs
none, and its whole population for all tasks goes through one compiled ``evaluate`` a generation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray

# A stored optimum keeps every constraint at or below -1e-12; the rest is for rounding.
INSIDE = -1.1e-12

PER_VARIABLE = 14  # members of the population for each variable
GENERATIONS = 1000
CONVERGED = 1e-12
CHECK_EVERY = 10
CROSSOVER = 0.9
SCALE = (0.3, 0.8)

# A gathered population has begun to agree: its best members stand in basins worth a descent. It is
# larger than one that is to end in the best of them, so that none is lost so early.
BEGUN = 0.1
CROWD = 28  # its members for each variable
GATHERING = 60  # generations, at most
APART = (0.2, 0.1, 0.05, 0.02, 0.0)  # shares of the range between starts, the widest that there are


@dataclass
class Search:
    """What one search found: the best strictly feasible design of each of n tasks."""

    designs: FloatArray  # (n, d)
    log_merit: FloatArray  # (n,)
    solvable: BoolArray  # (n,)
    evaluations: int = 0


def evolve(
    problem: DesignProblem,
    tasks: FloatArray,
    generator: np.random.Generator,
    *,
    near: FloatArray | None = None,
    radius: float = 1.0,
    effort: int = 0,
) -> Search:
    """Run current-to-best/1/bin on every task until its population's log merits agree.

    Within ``radius`` (a share of the range) of the designs ``near`` (n, d), if they are given. Each
    ``effort`` doubles the population and makes the penalty of the merit ten times as heavy.
    """
    n, d = len(tasks), len(problem.variables)
    members, weight = 2**effort * PER_VARIABLE * d, 10.0**effort
    population: FloatArray = _start(problem, n, members, generator, near, radius)
    found = Search(population[:, 0].copy(), np.full(n, np.inf), np.zeros(n, dtype=bool))
    extra = (weight - 1.0) * problem.penalty_weight
    merits = _measured(problem, tasks, population, np.arange(n), found, extra)
    running = np.arange(n)
    for generation in range(1, GENERATIONS + 1):
        population, merits = _succeeded(
            problem, tasks[running], population, merits, running, found, extra, generator
        )
        if generation % CHECK_EVERY == 0:
            spread = merits.max(axis=1) - merits.min(axis=1)
            kept = spread > CONVERGED
            running, population, merits = running[kept], population[kept], merits[kept]
            if len(running) == 0:
                break
    return found


def gather(
    problem: DesignProblem,
    task: FloatArray,
    generator: np.random.Generator,
    count: int,
    *,
    effort: int = 0,
) -> tuple[FloatArray, int]:
    """Return starts (count, d) of descents for a task (m,), and how many designs that evaluated.

    The best of an evolution that has begun to agree, and the best that stand far from the others.
    """
    tasks, only = task[None], np.zeros(1, dtype=np.intp)
    members = max(count, 2**effort * CROWD * len(problem.variables))
    population = _start(problem, 1, members, generator, None, 1.0)
    found = Search(population[:, 0].copy(), np.full(1, np.inf), np.zeros(1, dtype=bool))
    merits = _measured(problem, tasks, population, only, found, 0.0)
    for _ in range(GATHERING):
        if merits.max() - merits.min() < BEGUN:
            break
        population, merits = _succeeded(
            problem, tasks, population, merits, only, found, 0.0, generator
        )
    return _apart(problem, population[0], merits[0], count), found.evaluations


def _apart(
    problem: DesignProblem, designs: FloatArray, merits: FloatArray, count: int
) -> FloatArray:
    """Return the best of designs (n, d), then the next best (count, d) that stand apart."""
    unit = (designs - problem.low) / (problem.high - problem.low)
    order = np.argsort(merits)
    kept = [int(order[0])]
    for apart in APART:
        for k in map(int, order):
            far = np.abs(unit[kept] - unit[k]).max(axis=1).min() >= apart
            if far and k not in kept and len(kept) < count:
                kept.append(k)
    return np.asarray(designs[kept])


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


def _succeeded(
    problem: DesignProblem,
    tasks: FloatArray,
    population: FloatArray,
    merits: FloatArray,
    running: npt.NDArray[np.intp],
    found: Search,
    extra: float,
    generator: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Return the next generation (n, members, d) of the running tasks, and its log merits."""
    trial = _trial(problem, population, merits, generator)
    trial_merits = _measured(problem, tasks, trial, running, found, extra)
    better = trial_merits <= merits
    return (
        np.where(better[..., None], trial, population),
        np.where(better, trial_merits, merits),
    )


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
    running: npt.NDArray[np.intp],
    found: Search,
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
