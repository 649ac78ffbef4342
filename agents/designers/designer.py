"""Designer: a trained agent that answers tasks with designs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from pkm_gym.agents.designers.memory import Memory
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import Task
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.envs.opening import given_tasks
from pkm_gym.envs.rules import Rules
from pkm_gym.envs.session import Answer


class Policy(Protocol):
    """Says which designs to evaluate next."""

    def propose(self, memory: Memory) -> FloatArray:
        """Return one design (n, d) for each of the sessions, within the bounds."""
        ...

    def tensors(self) -> dict[str, Any]:
        """Return all arrays by name, for a file."""
        ...

    def settings(self) -> dict[str, Any]:
        """Return what else a file has to hold."""
        ...


class Starts(Protocol):
    """Says where a session on a task starts."""

    def designs(self, tasks: FloatArray) -> FloatArray:
        """Return the start (n, d) of each packed task (n, m)."""
        ...


@dataclass(frozen=True)
class Designs:
    """What a designer evaluated and answers, for n tasks.

    Attributes:
        tasks: array (n, m), packed.
        designs: array (n, k, d), in the order evaluated.
        merit: array (n, k).
        feasible: array (n, k).
        answer: for each task the design (n, d), its objective, its log merit, if it's feasible.
    """

    tasks: FloatArray
    designs: FloatArray
    merit: FloatArray
    feasible: BoolArray
    answer: Answer

    def regrets(self, optima: FloatArray) -> FloatArray:
        """Return the regrets (n, k) after each evaluation, for log merits (n,) of the optima.

        Only feasible designs count: infinite until one is found.
        """
        gap = np.where(self.feasible, np.log(self.merit) - optima[:, None], np.inf)
        regrets: FloatArray = np.minimum.accumulate(gap, axis=1)
        return regrets


@dataclass(frozen=True)
class Designer:
    """A policy and what it was trained with.

    Attributes:
        problem: the problem it designs for.
        rules: budget and step sizes of its sessions.
        policy: what it does in them.
        starts: where its sessions start.
    """

    problem: DesignProblem
    rules: Rules
    policy: Policy
    starts: Starts

    def open(self, tasks: FloatArray) -> Memory:
        """Return new sessions on packed tasks (n, m), nothing evaluated yet."""
        return Memory(self.problem, self.rules, tasks, self.starts.designs(tasks))

    def propose(self, memory: Memory) -> FloatArray:
        """Return the designs (n, d) that it would evaluate next."""
        return self.policy.propose(memory)

    def design(
        self, tasks: Task | Mapping[str, float] | FloatArray, budget: int | None = None
    ) -> Designs:
        """Design for one task, or for packed tasks (n, m).

        Args:
            tasks: a Task, a mapping of the fields that differ from the paper's, or packed tasks.
            budget: evaluations for each task; as many as it was trained with if None.

        Raises:
            ValueError: for a budget that it wasn't trained for, or an illegal task.
        """
        steps = self.rules.budget if budget is None else budget
        if not (isinstance(steps, int) and 1 <= steps <= self.rules.budget):
            raise ValueError(
                f"budget is {steps!r}: this designer was trained for {self.rules.budget} "
                f"evaluations, so it must be from 1 to {self.rules.budget}"
            )
        count = len(tasks) if isinstance(tasks, np.ndarray) and tasks.ndim == 2 else 1
        packed = given_tasks(self.problem, tasks, count)
        session, rows = self.open(packed), np.arange(len(packed))
        evaluations = []
        for _ in range(steps):
            evaluations.append(self.problem.evaluate(self.propose(session), packed))
            session.record(rows, evaluations[-1])
        return Designs(
            tasks=packed,
            designs=np.stack([e.designs for e in evaluations], axis=1),
            merit=np.stack([e.merit for e in evaluations], axis=1),
            feasible=np.stack([e.feasible for e in evaluations], axis=1),
            answer=session.answer,
        )


class Centre:
    """The centre of the box as the start, whatever the task."""

    def __init__(self, problem: DesignProblem) -> None:
        self._centre = 0.5 * (problem.low + problem.high)

    def designs(self, tasks: FloatArray) -> FloatArray:
        """Return the same design for each of the tasks: (n, d)."""
        return np.repeat(self._centre[None], len(tasks), axis=0)
