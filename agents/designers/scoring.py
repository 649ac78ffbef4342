"""Trained agents by the benchmark's protocol."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pkm_gym.agents.designers.designer import Designer
from pkm_gym.benchmark.record import Cost, EvaluationLog
from pkm_gym.benchmark.run import setting
from pkm_gym.benchmark.scoring import score
from pkm_gym.benchmark.splits import load_split
from pkm_gym.core.pool import Pool
from pkm_gym.core.tally import TALLY
from pkm_gym.mechanisms import lasting

SCORED = ("val", "ood", "test")
AT = (1, 4, 8, 12, 24)  # evaluations whose median regret is told


class Agent(NamedTuple):
    """A trained agent.

    Attributes:
        designer: what it does.
        steps: evaluations it was trained with.
        pool: how many solved tasks it was trained on; None: as many as the train split has.
    """

    designer: Designer
    steps: int
    pool: int | None


def record(
    agents: Sequence[Agent],
    split: str,
    command: str,
    folder: Path | None = None,
) -> list[EvaluationLog]:
    """Return the logs of agents of one problem on a split; they count as training seeds.

    Args:
        agents: designers with what they cost.
        split: which tasks.
        command: what asked for it.
        folder: of the splits; see ``load_split``.

    Raises:
        ValueError: for designers of other problems, or a problem that the benchmark doesn't have.
    """
    name = lasting(agents[0].designer.problem)
    problem, tasks = load_split(name, split, folder)
    logs = []
    for seed, (designer, steps, pool) in enumerate(agents):
        if designer.problem.hash() != problem.hash():
            first = designer.problem.objectives[0].name
            raise ValueError(
                f"agent {seed + 1} designs for another problem than {problem.name}'s splits (its "
                f"objective is {first}): score it on solved tasks of its own, with --tasks FILE.npz"
            )
        own = setting(
            name, split, "designer", seed=seed, evaluations=designer.rules.budget, folder=folder
        )
        own = own if pool is None else replace(own, pool=pool)
        began = time.perf_counter()
        before = TALLY.designs
        designs = designer.design(tasks.tasks).designs
        outside = TALLY.designs - before - designs.shape[0] * designs.shape[1]
        seconds = np.full(len(tasks), (time.perf_counter() - began) / len(tasks))
        rows = np.arange(len(tasks), dtype=np.int64)
        logs.append(
            EvaluationLog(
                own,
                rows,
                designs,
                seconds,
                learned=np.zeros_like(rows),
                outside=np.full_like(rows, outside),
                version=version("pkm_gym"),
                command=command,
                training=Cost(steps, np.nan),  # its time isn't recorded
            )
        )
    return logs


@dataclass(frozen=True)
class PoolScore:
    """How good a designer is on solved tasks.

    Attributes:
        tasks: how many of them are solvable.
        score: the benchmark's, over its whole budget or the first 12 evaluations.
        medians: evaluations -> the median regret after so many, infinite where most find nothing.
        feasible: the share of the tasks for which it finds a feasible design.
    """

    tasks: int
    score: float
    medians: Mapping[int, float]
    feasible: float


def score_on(designer: Designer, pool: Pool) -> PoolScore:
    """Return how good a designer is on solved tasks of its own problem.

    Raises:
        ValueError: where none of them can be solved.
    """
    rows = np.flatnonzero(pool.solvable)
    if len(rows) == 0:
        raise ValueError("none of the tasks can be solved: there is nothing to be scored on")
    optima = designer.problem.evaluate(pool.designs[rows], pool.tasks[rows]).log_merit
    regrets = designer.design(pool.tasks[rows]).regrets(optima)
    medians = np.quantile(regrets, 0.5, axis=0, method="higher")
    return PoolScore(
        len(rows),
        score(regrets),
        {k: float(medians[k - 1]) for k in AT if k <= len(medians)},
        float(np.isfinite(regrets[:, -1]).mean()),
    )
