"""Opening: the task, the start and the known optimum of a new session."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from pkm_gym.core.declaration import SPLITS
from pkm_gym.core.names import check_known, imported
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import disagreement
from pkm_gym.core.task import Task
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.checks import finite
from pkm_gym.mechanisms import lasting

STARTS = ("centre", "random", "pool", "interpolated")
OPTIONS = ("design", "task")

PoolLike: TypeAlias = str | os.PathLike[str] | Pool

# Of a higher room.
LOAD_SPLIT = "pkm_gym.benchmark.splits:load_split"
BETWEEN = "pkm_gym.benchmark.interpolation:Between"


class Drawn(NamedTuple):
    """What n new sessions start with."""

    tasks: FloatArray  # (n, m), packed
    starts: FloatArray  # (n, d)
    optima: FloatArray  # (n,), the log merit of each task's optimum, NaN where it isn't known


@dataclass(frozen=True)
class Solved:
    """Tasks whose optimum is known."""

    tasks: FloatArray  # (k, m), packed
    starts: FloatArray  # (k, d)
    optima: FloatArray  # (k,), log merit
    source: str

    def find(self, tasks: FloatArray) -> npt.NDArray[np.intp]:
        """Return the rows (n,) of packed tasks (n, m), -1 where one is unknown."""
        return np.array([self._row.get(task.tobytes(), -1) for task in tasks], dtype=np.intp)

    @cached_property
    def _row(self) -> dict[bytes, int]:
        return {task.tobytes(): i for i, task in enumerate(self.tasks)}


class Opening:
    """Where sessions start: on which task, at which design.

    Args:
        problem: the design problem.
        family: whether each session draws a task of its own.
        start: "centre" of the box, "random", "pool": the start stored with the task, or
            "interpolated" between the pool's optima.
        pool: solved tasks, None without them: their file, the name of a split, or a Pool; a Family
            then draws the solvable ones.
        regret: whether the optimum of each task must be known.

    Raises:
        ValueError: for an illegal argument, or a pool that is missing or bad.
    """

    def __init__(
        self,
        problem: DesignProblem,
        *,
        family: bool,
        start: str,
        pool: PoolLike | None,
        regret: bool,
    ) -> None:
        check_known("start", [start], STARTS)
        if family not in (True, False):
            raise ValueError(f"family is {family!r}: it must be True or False")
        of_pool = start in ("pool", "interpolated")
        if pool is None and (of_pool or (regret and family)):
            what = f"start={start!r}" if of_pool else "reward='regret' of a Family"
            raise ValueError(f"{what} needs solved tasks: give pool='FILE.npz' or pool='train'")
        self.problem = problem
        self.family = family
        self.start = start
        self.regret = regret
        self.pool = None if pool is None else read_pool(problem, pool)
        self.between: Any = None
        if start == "interpolated":
            self.between = imported(BETWEEN)(problem, self.pool)
        self.solved: Solved | None = None
        if self.pool is not None:
            words = "the pool" if isinstance(pool, Pool) else repr(str(pool))
            self.solved = solved_tasks(problem, self.pool, words)
        elif regret:
            self.solved = paper_optimum(problem)
        self._home = problem.pack(None)[None]
        if not family:
            self.check_stored(self._home)

    def check_stored(self, tasks: FloatArray) -> None:
        """Refuse packed tasks (n, m) that sessions can't be about, since no optimum is stored.

        Raises:
            ValueError: naming the first.
        """
        if self.regret or self.start == "pool":
            self._find(tasks)

    def draw(
        self, generators: Sequence[np.random.Generator], options: Mapping[str, Any] | None = None
    ) -> Drawn:
        """Draw what a new session of each generator starts with.

        A task and then a start are drawn, whether they are used or not: what follows must not
        depend on what is given.

        Args:
            generators: one for each of n sessions.
            options: "task" (a Task, a mapping of the fields that differ from the paper's, or packed
                (m,) or (n, m)) and "design" (a mapping of the variables, or an array (d,) or
                (n, d)) to start with.

        Raises:
            ValueError: for an unknown option or an illegal value.
        """
        given = options or {}
        check_known("reset option", given, OPTIONS)
        n, m, d = len(generators), self._home.shape[1], len(self.problem.low)
        unit = np.array([generator.random(m + d) for generator in generators])
        stored_start = self.start == "pool" and given.get("design") is None
        tasks, rows = self._tasks(unit[:, :m], given.get("task"), self.regret or stored_start)
        optima = np.full(n, np.nan)
        if self.solved and self.regret:
            optima = self.solved.optima[rows]
        if given.get("design") is not None:
            starts = given_designs(self.problem, given["design"], n)
        elif self.solved and stored_start:
            starts = self.solved.starts[rows]
        elif self.between:
            starts = self.between.designs(tasks)
        else:
            place = unit[:, m:] if self.start == "random" else np.full((n, d), 0.5)
            starts = self.problem.low + (self.problem.high - self.problem.low) * place
        return Drawn(tasks, starts, optima)

    def _tasks(
        self, unit: FloatArray, given: Any, stored: bool
    ) -> tuple[FloatArray, npt.NDArray[np.intp]]:
        """Return the tasks (n, m) and, if they must be stored ones, their rows (n,) there."""
        n = len(unit)
        if given is None and self.family and self.solved:
            rows = (unit[:, 0] * len(self.solved.tasks)).astype(np.intp)
            return self.solved.tasks[rows], rows
        if given is not None:
            tasks = given_tasks(self.problem, given, n)
        elif self.family:
            tasks = self.problem.spread_tasks(unit)
        else:
            tasks = np.repeat(self._home, n, axis=0)
        return tasks, self._find(tasks) if stored else np.zeros(n, dtype=np.intp)

    def _find(self, tasks: FloatArray) -> npt.NDArray[np.intp]:
        assert self.solved is not None
        rows = self.solved.find(tasks)
        if (rows < 0).any():
            task = self.problem.unpack(tasks[int(np.argmin(rows))])
            raise ValueError(f"{task} has no stored optimum: it isn't in {self.solved.source}")
        return rows


def read_pool(problem: DesignProblem, given: PoolLike) -> Pool:
    """Return solved tasks: a Pool, a split by name, or a file.

    Raises:
        ValueError: for what is no pool of the problem, or has no solvable task.
    """
    if isinstance(given, Pool):
        pool = given
        pool.check(problem)
    elif isinstance(given, str) and given in SPLITS:
        pool = _split(problem, given)
    else:
        pool = Pool.load(given, problem)
    if not pool.solvable.any():
        what = "the pool" if isinstance(given, Pool) else repr(str(given))
        raise ValueError(f"{what} has no solvable task: expected at least one")
    return pool


def _split(problem: DesignProblem, name: str) -> Pool:
    plain, pool = imported(LOAD_SPLIT)(lasting(problem), name)
    if plain.hash() != problem.hash():
        raise ValueError(
            f"pool={name!r} is of the Family of {problem.name} as it comes, which differs from "
            "this problem in variables or options: give pool='FILE.npz'"
        )
    found: Pool = pool
    return found


def solved_tasks(problem: DesignProblem, pool: Pool, source: str) -> Solved:
    """Return the solvable tasks of a pool with the log merit of their optima."""
    kept = pool.only(pool.solvable)
    optima = problem.evaluate(kept.designs, kept.tasks).log_merit
    return Solved(kept.tasks, kept.starts, optima, source)


def paper_optimum(problem: DesignProblem) -> Solved:
    """Return the paper's task with its verified optimum.

    Raises:
        ValueError: for a problem that differs from the paper's, or without a verified optimum.
    """
    objective = problem.objectives[0].name
    paper = type(problem)(objective=[item.name for item in problem.objectives])
    optimum = problem.reference.optima.get(objective)
    if optimum is None or paper.hash() != problem.hash() or paper.task != problem.task:
        raise ValueError(
            f"reward='regret' knows the optimum of the paper's {problem.name} only, with its task, "
            "variables and options as they come: give pool='FILE.npz' for another"
        )
    if wrong := disagreement(paper, optimum):
        raise ValueError(f"reward='regret' has no optimum to go by: {wrong}")
    task, design = paper.pack(None), paper.design(optimum.design)
    log_merit = paper.evaluate(design[None], task[None]).log_merit
    return Solved(task[None], design[None], log_merit, "paper.toml")


def given_tasks(problem: DesignProblem, given: Any, n: int) -> FloatArray:
    """Return the tasks (n, m) of a reset's option."""
    if isinstance(given, Task | Mapping):
        given = problem.pack(given)
    m = len(problem.task_variables)
    tasks = finite("option task", given, (m,), (n, m))
    rows = np.repeat(tasks[None], n, axis=0) if tasks.ndim == 1 else tasks
    problem.task_type.check_rows(rows)
    return rows


def given_designs(problem: DesignProblem, given: Any, n: int) -> FloatArray:
    """Return the designs (n, d) of a reset's option."""
    if isinstance(given, Mapping):
        given = problem.design(given)
    d = len(problem.low)
    designs = finite("option design", given, (d,), (n, d))
    rows = np.repeat(designs[None], n, axis=0) if designs.ndim == 1 else designs
    outside = (rows < problem.low) | (rows > problem.high)
    if outside.any():
        i, j = np.argwhere(outside)[0]
        variable = problem.variables[j]
        raise ValueError(
            f"option design: {variable.name} is {rows[i, j]:g}, it must be from "
            f"{variable.low:g} to {variable.high:g} {variable.unit}".rstrip()
        )
    return rows
