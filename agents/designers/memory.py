"""Memory: sessions that keep all that was evaluated."""

from __future__ import annotations

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.rules import Rules
from pkm_gym.envs.session import Rows, Session


class Memory(Session):
    """n design sessions, with every evaluation in its order.

    Attributes:
        designs: array (n, budget, d).
        log_merit: array (n, budget).
        constraints: array (n, budget, c).
        improved: array (n,), how many of the evaluations gave a better answer.
    """

    def __init__(
        self, problem: DesignProblem, rules: Rules, tasks: FloatArray, starts: FloatArray
    ) -> None:
        n, d, c = len(tasks), len(problem.low), len(problem.constraint_names)
        super().__init__(problem, rules, n)
        self.designs = np.full((n, rules.budget, d), np.nan)
        self.log_merit = np.full((n, rules.budget), np.nan)
        self.constraints = np.full((n, rules.budget, c), np.nan)
        self.improved = np.zeros(n, dtype=np.int64)
        self.open(np.arange(n), tasks, starts, np.full(n, np.nan))

    def record(self, rows: Rows, evaluation: Evaluation) -> None:
        """Count the evaluated designs (k) in, and keep them."""
        at = self.evaluations[rows]
        self.designs[rows, at] = evaluation.designs
        self.log_merit[rows, at] = evaluation.log_merit
        self.constraints[rows, at] = evaluation.constraints
        super().record(rows, evaluation)
        self.improved[rows] += (self.answer.designs[rows] == evaluation.designs).all(axis=1)
