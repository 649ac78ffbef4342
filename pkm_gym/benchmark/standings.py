"""Standings: the logs of several methods, read, measured and compared."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from pkm_gym.benchmark.record import Cost, EvaluationLog, Setting
from pkm_gym.benchmark.run import splits_folder
from pkm_gym.benchmark.scoring import (
    CERTAINTY,
    SCORED,
    Duel,
    Interval,
    duel,
    interval,
    median,
    over_seeds,
    regrets,
    score,
    violations,
)
from pkm_gym.benchmark.splits import count_tasks, load_split, manifest, sha256, split_file
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

AT = (1, 2, 4, 8, 12, 24, 60, 120, 300)


@dataclass(frozen=True)
class Entry:
    """What one method did, all of its seeds.

    Attributes:
        setting: how it was run, with its first seed.
        rows: array (n,), the solvable tasks of the split that it was run on.
        regret: array (seeds, n, budget).
        violation: array (seeds, unsolvable tasks, budget), see ``scoring.violations``.
        seconds: wall time for one design, the mean over all that it evaluated.
        version: of pkm_gym.
        command: what wrote its log.
        training: what the method cost before the first task, besides the pool.
        preparation: what it evaluated on training tasks before the first one.
        pool: what it cost to solve the training tasks that it knew.
        learned: evaluations on training tasks for each task, the mean.
        outside: designs evaluated past the door; with any of them it isn't ranked.
        part: whether it knew only some of the training tasks.
    """

    setting: Setting
    rows: npt.NDArray[np.int64]
    regret: FloatArray
    violation: FloatArray
    seconds: float
    version: str
    command: str
    training: Cost
    preparation: Cost
    pool: Cost
    learned: float
    outside: int
    part: bool

    @property
    def name(self) -> str:
        """The method's name, with what differs from an ordinary run."""
        words = [self.setting.method]
        if self.part:
            words.append(f"pool {self.setting.pool}")
        if self.setting.noise:
            words.append(f"noise {self.setting.noise:g}")
        if self.setting.delay:
            words.append(f"delay {self.setting.delay:g} s")
        return ", ".join(words)

    @property
    def track(self) -> str:
        """The track: methods of different tracks are never ranked in one table."""
        return f"{self.setting.start} start, {self.setting.knowledge}"

    @property
    def seeds(self) -> int:
        """How many seeds it was run with."""
        return len(self.regret)

    @cached_property
    def score(self) -> Interval:
        """The headline score with its bootstrap interval."""
        return interval(score, self.regret[:, :, :SCORED])

    def median(self, k: int) -> float:
        """Return the median regret after k evaluations, of the seeds the median."""
        return over_seeds(median(k), self.regret)

    def has(self, k: int) -> bool:
        """Return whether it was allowed k evaluations."""
        return k <= self.setting.budget

    @property
    def cost(self) -> Cost:
        """What was spent before the first task: on the pool, in training, to prepare."""
        parts = (self.pool, self.training, self.preparation)
        return Cost(sum(part.evaluations for part in parts), sum(part.seconds for part in parts))

    @property
    def beaten(self) -> npt.NDArray[np.int64]:
        """Array (k,), the tasks on which it found a better design than the best known."""
        beaten = (self.regret[:, :, -1] < -CERTAINTY).any(axis=0)
        return np.asarray(self.rows[beaten])


def standings(logs: Sequence[EvaluationLog]) -> list[Entry]:
    """Measure logs of one problem and split; those that differ in their seed make one entry.

    Returns:
        The entries, highest score first.

    Raises:
        ValueError: in one sentence, for logs of several problems, splits or versions of them, or
            seeds that were run on different tasks.
    """
    groups: dict[Setting, list[EvaluationLog]] = {}
    for log in sorted(logs, key=lambda log: log.setting.seed):
        groups.setdefault(replace(log.setting, seed=0), []).append(log)
    places = {(log.setting.problem, log.setting.split) for log in logs}
    if len(places) != 1:
        names = ", ".join(" ".join(place) for place in sorted(places)) or "none"
        raise ValueError(f"the logs must be of one problem and split, they are of: {names}")
    return sorted(map(_entry, groups.values()), key=lambda entry: -entry.score.value)


def ranked(entries: Sequence[Entry]) -> list[Entry]:
    """Return the entries without those that evaluated designs past the door."""
    return [entry for entry in entries if not entry.outside]


def check_log(log: EvaluationLog) -> None:
    """Refuse a log of another version of a problem or its split, or of other tasks or designs.

    Raises:
        ValueError: in one sentence.
    """
    problem, split = _split_of(log.setting)
    _check_designs(log, problem, len(split))


def _split_of(setting: Setting) -> tuple[DesignProblem, Pool]:
    """Return the problem and the split of a log's setting, as they were when it was run.

    Raises:
        ValueError: in one sentence, where there is none, or another version of them.
    """
    folder = splits_folder(setting)
    problem, split = load_split(setting.problem, setting.split, folder)
    own = sha256(split_file(problem, setting.split, folder))
    if (setting.hash, setting.sha256) != (problem.hash(), own):
        raise ValueError(
            f"the log of {setting.method} belongs to another version of {problem.name} or its "
            f"{setting.split} split: run it again"
        )
    return problem, split


def _entry(logs: Sequence[EvaluationLog]) -> Entry:
    setting = logs[0].setting
    problem, split = _split_of(setting)
    rows = logs[0].rows
    for log in logs:
        _check_designs(log, problem, len(split))
        if not np.array_equal(log.rows, rows):
            raise ValueError(
                f"the seeds of {setting.method} were run on different tasks ({len(rows)} with seed "
                f"{setting.seed}, {len(log)} with seed {log.setting.seed}): run them again"
            )
    return Entry(
        setting=setting,
        rows=rows[split.solvable[rows]],
        regret=np.array([regrets(log, problem, split) for log in logs]),
        violation=np.array([violations(log, problem, split) for log in logs]),
        seconds=sum(log.seconds.sum() for log in logs)
        / max(1, sum(log.counts.sum() for log in logs)),
        version=logs[0].version,
        command=logs[0].command,
        training=logs[0].training,
        preparation=logs[0].preparation,
        pool=_pool_cost(setting, problem),
        learned=float(np.mean([log.learned.mean() if len(log) else 0.0 for log in logs])),
        outside=max(int(log.outside.max(initial=0)) for log in logs),
        part=0 < setting.pool < count_tasks(split_file(problem, "train", splits_folder(setting))),
    )


def _check_designs(log: EvaluationLog, problem: DesignProblem, tasks: int) -> None:
    """Refuse tasks that the split doesn't have, and designs outside the search bounds."""
    method = log.setting.method
    if len(log) and log.rows[-1] >= tasks:
        raise ValueError(
            f"the log of {method} has a task {log.rows[-1]}: the {log.setting.split} split of "
            f"{problem.name} has {tasks}, numbered from 0"
        )
    if log.designs.shape[2] != len(problem.low):
        raise ValueError(
            f"the log of {method} has designs of {log.designs.shape[2]} variables: {problem.name} "
            f"has {len(problem.low)}"
        )
    outside = (log.designs < problem.low) | (log.designs > problem.high)
    if outside.any():
        i, k, j = np.argwhere(outside)[0]
        variable = problem.variables[j]
        raise ValueError(
            f"the log of {method} has {variable.name} = {log.designs[i, k, j]!r} in task "
            f"{log.rows[i]}: designs lie within {variable.low:g} to {variable.high:g} "
            f"{variable.unit}".rstrip()
        )


def _pool_cost(setting: Setting, problem: DesignProblem) -> Cost:
    """Return what it cost to solve the training tasks that a method knew."""
    if setting.pool == 0:
        return Cost()
    path = split_file(problem, "train", splits_folder(setting))
    whole, share = manifest(path.parent)[path.name], setting.pool / count_tasks(path)
    return Cost(round(share * whole.evaluations), share * whole.seconds)


def compare(one: Entry, k: int, other: Entry, other_k: int) -> Duel:
    """Compare one method after k evaluations with another after its own number of them.

    On the tasks that both were run on.
    """
    shared = np.intersect1d(one.rows, other.rows)
    pair = ((one, k), (other, other_k))
    return duel(*(e.regret[:, np.searchsorted(e.rows, shared), at - 1] for e, at in pair))


def pays_after(entry: Entry, others: Iterable[Entry], k: int = SCORED) -> float | None:
    """Return after how many tasks the cost before the first one is made up for.

    Counted in evaluations: on each task the method needs k and what it evaluates on training tasks,
    and the fastest of the *scratch* methods as many as bring its median regret as low; where none
    gets there, the largest number that one was allowed, so that the answer is too large rather than
    too small. None if nothing is saved.
    """
    target = entry.median(k)
    scratch = [other for other in others if other.setting.knowledge == "scratch"]
    needed = []
    for other in scratch:
        medians = np.median(np.quantile(other.regret, 0.5, axis=1, method="higher"), axis=0)
        reached = np.flatnonzero(medians <= target)
        needed.append(reached[0] + 1 if len(reached) else np.inf)
    fastest = min(needed, default=np.inf)
    if not np.isfinite(fastest):
        fastest = max((other.setting.budget for other in scratch), default=0)
    saved = fastest - k - entry.learned
    return entry.cost.evaluations / saved if saved > 0 else None
