"""Regret, score and paired comparison: every figure of the benchmark is computed here.

The regret after k evaluations is the lowest log merit among the *feasible* designs of the first k,
minus the log merit of the certified optimum: log(value / optimum) for a minimised index. It is
+inf until something feasible was found, and stays so in every quantile.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from pkm_gym.benchmark.record import EvaluationLog
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.mechanisms import called

SCORED = 12  # evaluations that the headline score looks at
FLOOR = 1e-8  # the regret that counts as none

# A certified optimum may be off by this much in log merit; whoever beats it by more, has shown it
# to be none.
CERTAINTY = 1e-9

RESAMPLES = 1000
CONFIDENCE = 0.95

WITHIN = (1e-2, 1e-3, 1e-4)

Statistic = Callable[[FloatArray], float]


@dataclass(frozen=True)
class Interval:
    """A figure with the bounds of its bootstrap interval."""

    value: float
    low: float
    high: float


def regrets(log: EvaluationLog, problem: DesignProblem, split: Pool) -> FloatArray:
    """Return the regret (n, budget) of each solvable task of a log after 1, 2, ... evaluations.

    The designs are evaluated anew, without noise: what a method was told does not matter.

    It is negative where an optimum that isn't certified, but the best known, was beaten.

    Raises:
        ValueError: if a design beats a certified optimum by more than 1e-9.
    """
    rows = log.rows[split.solvable[log.rows]]
    log_merit, feasible = _measured(log.only(rows), problem, split)
    optima = problem.evaluate(split.designs[rows], split.tasks[rows]).log_merit
    behind = np.where(feasible, log_merit, np.inf) - optima[:, None]
    lowest: FloatArray = np.minimum.accumulate(behind, axis=1)
    last = np.where(split.certified[rows], lowest[:, -1], 0.0)
    if (last < -CERTAINTY).any():
        i = int(last.argmin())
        raise ValueError(
            f"{log.setting.method} beats the certified optimum of {log.setting.split} task "
            f"{rows[i]} of {problem.name} by {-last[i]:.3g} in log merit: the optimum is "
            "wrong, or the design was not evaluated as the benchmark does; please report it "
            f"(`pkm-gym splits {called(problem)} --from LOG.npz` takes it over into the split)"
        )
    return lowest


def violations(log: EvaluationLog, problem: DesignProblem, split: Pool) -> FloatArray:
    """Return for each unsolvable task (n, budget) how far the lowest log merit is from the known.

    The known one is that of the least violating design which the search for the optimum found; a
    lower one is possible.
    """
    rows = log.rows[~split.solvable[log.rows]]
    log_merit, _ = _measured(log.only(rows), problem, split)
    least = problem.evaluate(split.designs[rows], split.tasks[rows]).log_merit
    lowest: FloatArray = np.minimum.accumulate(log_merit - least[:, None], axis=1)
    return lowest


def _measured(
    log: EvaluationLog, problem: DesignProblem, split: Pool
) -> tuple[FloatArray, BoolArray]:
    """Return the exact log merit and feasibility (n, budget); inf and False where there is none."""
    n, budget, _ = log.designs.shape
    there = np.isfinite(log.designs).all(axis=2)
    tasks = np.repeat(split.tasks[log.rows][:, None, :], budget, axis=1)
    log_merit = np.full((n, budget), np.inf)
    feasible = np.zeros((n, budget), dtype=bool)
    if there.any():
        evaluation = problem.evaluate(log.designs[there], tasks[there])
        log_merit[there], feasible[there] = evaluation.log_merit, evaluation.feasible
    return log_merit, feasible


def score(regret: FloatArray) -> float:
    """Return the headline score, from 0 to 1, of regrets (n, budget).

    The mean over tasks and k = 1 ... 12 of -log10(clip(r_k, 1e-8, 1)) / 8. A budget below 12 keeps
    its last regret.
    """
    last = regret.shape[1] - 1
    columns = np.minimum(np.arange(SCORED), last)
    return float(np.mean(-np.log10(np.clip(regret[:, columns], FLOOR, 1.0))) / -np.log10(FLOOR))


def median(k: int) -> Statistic:
    """Return the statistic "median regret after k evaluations"."""
    return quantile(k, 0.5)


def quantile(k: int, q: float) -> Statistic:
    """Return the statistic "q quantile of the regret after k evaluations"; +inf counts."""
    return lambda regret: float(np.quantile(regret[:, k - 1], q, method="higher"))


def share_within(k: int, limit: float) -> Statistic:
    """Return the statistic "share of tasks with a regret of at most ``limit`` after k"."""
    return lambda regret: float(np.mean(regret[:, k - 1] <= limit))


def share_feasible(k: int) -> Statistic:
    """Return the statistic "share of tasks with a feasible design after k evaluations"."""
    return lambda regret: float(np.mean(np.isfinite(regret[:, k - 1])))


def over_seeds(statistic: Statistic, regret: FloatArray) -> float:
    """Return the median over seeds of a statistic of regrets (seeds, n, budget)."""
    return float(np.median([statistic(one) for one in regret]))


def interval(statistic: Statistic, regret: FloatArray, seed: int = 0) -> Interval:
    """Return a statistic of regrets (seeds, n, budget) with its 95 % bootstrap interval.

    Tasks and seeds are drawn with replacement; of the seeds the median counts.
    """
    generator = np.random.default_rng(seed)
    seeds, n, _ = regret.shape
    drawn = [
        over_seeds(
            statistic,
            regret[generator.integers(seeds, size=seeds)][:, generator.integers(n, size=n)],
        )
        for _ in range(RESAMPLES)
    ]
    tail = 0.5 * (1.0 - CONFIDENCE)
    low, high = np.quantile(drawn, [tail, 1.0 - tail], method="nearest")
    return Interval(over_seeds(statistic, regret), float(low), float(high))


@dataclass(frozen=True)
class Duel:
    """On how many tasks one method has the smaller regret than another.

    Attributes:
        share: of the tasks, ties not counted in.
        low: lower bound of it at a confidence of 95 % (one-sided, Clopper-Pearson).
        tasks: how many were compared.
    """

    share: float
    low: float
    tasks: int


def duel(one: FloatArray, other: FloatArray) -> Duel:
    """Compare regrets (seeds, n) of two methods on the same tasks; of the seeds the median counts.

    Two regrets below 1e-8 are alike, and so are two +inf.
    """
    first, second = (np.maximum(np.median(regret, axis=0), FLOOR) for regret in (one, other))
    wins, n = int((first < second).sum()), len(first)
    exact = stats.binomtest(wins, n, alternative="greater").proportion_ci(CONFIDENCE, "exact")
    return Duel(wins / n, float(exact.low), n)
