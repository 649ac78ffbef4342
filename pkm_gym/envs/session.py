"""Session: the state of n design sessions side by side, and how one step changes it.

``DesignEnv`` holds one session, ``DesignVectorEnv`` n of them: both run this code and no other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.merit import WORST, precedence
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.envs.objectives import Rewards, objective_rewards
from pkm_gym.envs.rules import Rules

Rows = npt.NDArray[np.intp]


class Point(NamedTuple):
    """An evaluated design of each session."""

    designs: FloatArray  # (n, d)
    log_merit: FloatArray  # (n,)
    constraints: FloatArray  # (n, c)


class Answer(NamedTuple):
    """The design that each session would answer with."""

    designs: FloatArray  # (n, d)
    values: FloatArray  # (n,), the first objective, NaN where undefined
    log_merit: FloatArray  # (n,)
    feasible: BoolArray  # (n,)


class Session:
    """n design sessions on their own tasks.

    Attributes:
        problem: the problem whose designs are evaluated.
        rules: budget, step sizes, reward.
        tasks: array (n, m), packed.
        optima: array (n,), the log merit of each task's optimum, NaN where unknown.
        evaluations: array (n,), how many designs have been evaluated.
        last: array (n, d), the design evaluated last; the start before the first evaluation.
        best: the incumbent, of lowest merit. Until something is evaluated it is the start, with
            the worst log merit, 7, and no constraint broken.
        other: the point that lost the latest comparison with the best; meaningful from the second
            evaluation on.
        answer: the best feasible design by objective; without one the design of lowest merit.
    """

    def __init__(self, problem: DesignProblem, rules: Rules, n: int) -> None:
        d, c = len(problem.low), len(problem.constraint_names)
        self.problem = problem
        self.rules = rules
        self.tasks = np.empty((n, len(problem.task_variables)))
        self.optima = np.empty(n)
        self.evaluations = np.empty(n, dtype=np.int64)
        self.last = np.empty((n, d))
        self.best, self.other = (
            Point(np.empty((n, d)), np.empty(n), np.empty((n, c))) for _ in range(2)
        )
        self.answer = Answer(
            np.empty((n, d)), np.empty(n), np.empty(n), np.empty(n, dtype=np.bool_)
        )
        centre = 0.5 * (problem.low + problem.high)
        self.open(np.arange(n), problem.pack(None), centre, np.full(n, np.nan))
        self.evaluations[:] = rules.budget  # over before it is opened

    def open(self, rows: Rows, tasks: FloatArray, starts: FloatArray, optima: FloatArray) -> None:
        """Start the sessions of ``rows`` anew: tasks (k, m), starts (k, d), optima (k,)."""
        self.tasks[rows] = tasks
        self.optima[rows] = optima
        self.evaluations[rows] = 0
        self.last[rows] = starts
        for point in (self.best, self.other):
            point.designs[rows] = starts
            point.log_merit[rows] = WORST
            point.constraints[rows] = 0.0
        self.answer.designs[rows] = starts
        self.answer.values[rows] = np.nan
        self.answer.log_merit[rows] = np.inf
        self.answer.feasible[rows] = False

    @property
    def step_size(self) -> FloatArray:
        """Array (n,), the size of the next step, a share of the range."""
        return self.rules.step_sizes[self.evaluations]

    @property
    def left(self) -> npt.NDArray[np.int64]:
        """Array (n,), the evaluations that are left."""
        return self.rules.budget - self.evaluations

    def propose(self, rows: Rows, actions: FloatArray) -> FloatArray:
        """Return the designs (k, d) that finite actions (k, d) mean, clipped to the box."""
        low, span = self.problem.low, self.problem.high - self.problem.low
        moves = np.clip(actions, -1.0, 1.0)
        if self.rules.action_mode == "absolute":
            designs = low + span * (0.5 + 0.5 * moves)
        else:
            designs = self.best.designs[rows] + span * moves * self.step_size[rows, None]
        return np.clip(designs, low, self.problem.high)

    def step(self, rows: Rows, actions: FloatArray) -> tuple[Evaluation, FloatArray | Rewards]:
        """Take one step in the sessions of ``rows``: return the evaluation (k) and the rewards.

        Rewards are (k,), or (k, objectives).
        """
        before = self.best.log_merit[rows]
        designs = self.propose(rows, actions)
        evaluation = self.problem.evaluate(designs, self.tasks[rows])
        self.record(rows, evaluation)
        if self.rules.reward == "objectives":
            return evaluation, objective_rewards(evaluation)
        after, optima = self.best.log_merit[rows], self.optima[rows]
        return evaluation, self.rules.earned(before, after, optima, self.left[rows] == 0)

    def record(self, rows: Rows, evaluation: Evaluation) -> None:
        """Count the evaluated designs (k) in and keep the best, the other and the answer."""
        designs, log_merit = evaluation.designs, evaluation.log_merit
        first = self.evaluations[rows] == 0
        better = first | (log_merit < self.best.log_merit[rows])
        new = Point(designs, log_merit, evaluation.constraints)
        for best, other, value in zip(self.best, self.other, new, strict=True):
            incumbent = best[rows]
            wins = better if value.ndim == 1 else better[:, None]
            best[rows] = np.where(wins, value, incumbent)
            other[rows] = np.where(wins, incumbent, value)
        self._answer(rows, evaluation)
        self.last[rows] = designs
        self.evaluations[rows] += 1

    def _answer(self, rows: Rows, evaluation: Evaluation) -> None:
        """Take the evaluated designs (k) for answers where they are better."""
        known, sign = self.answer, self.problem.objectives[0].sign
        values, log_merit = evaluation.objectives[:, 0], evaluation.log_merit
        infeasible, number = precedence(values, evaluation.feasible, log_merit, sign)
        before = known.values[rows], known.feasible[rows], known.log_merit[rows]
        known_infeasible, known_number = precedence(*before, sign)
        alike = infeasible == known_infeasible
        wins = np.where(alike, number < known_number, known_infeasible)
        new = Answer(evaluation.designs, values, log_merit, evaluation.feasible)
        for array, value in zip(known, new, strict=True):
            array[rows[wins]] = value[wins]
