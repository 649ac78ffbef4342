"""The objectives as a vector of rewards, by MO-Gymnasium's conventions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.trial import trial_values
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.rules import Rules

Rewards = npt.NDArray[np.float32]


def objective_rewards(evaluation: Evaluation) -> Rewards:
    """Return the objectives (n, k) of designs, larger is better.

    Where a design breaks a constraint, each objective's ``worst`` made worse by the violation.
    """
    return (_signs(evaluation.problem) * trial_values(evaluation)).astype(np.float32)


class RewardSpace:
    """What MO-Gymnasium asks of an environment, where the reward is "objectives"."""

    problem: DesignProblem
    rules: Rules

    @property
    def reward_space(self) -> spaces.Box:
        """The box of a session's rewards (k,).

        Raises:
            AttributeError: where the reward is a number.
        """
        if self.rules.reward != "objectives":
            raise AttributeError(
                f"reward is {self.rules.reward!r}, a number: a reward_space has an environment "
                "that is made with reward='objectives'"
            )
        worst = _signs(self.problem) * [item.worst for item in self.problem.objectives]
        lowest = (worst - len(self.problem.constraint_names)).astype(np.float32)
        return spaces.Box(lowest, np.full_like(lowest, np.inf), dtype=np.float32)

    @property
    def reward_dim(self) -> int:
        """The number of a session's rewards."""
        return len(self.reward_space.low)


def _signs(problem: DesignProblem) -> FloatArray:
    return np.array([-item.sign for item in problem.objectives])
