"""Differential evolution over many tasks at once: the global search of a task's optimum.

The optimum of such a problem lies on kinks (several limits active at once, each the maximum over a
sampled workspace), where gradients mislead. Differential evolution on the exact-penalty merit needs
none, and its whole population for all tasks goes through one compiled ``evaluate`` a generation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
