"""The rules of a design session: how many steps, how large, and what they earn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pkm_gym.core.names import check_known
from pkm_gym.core.reading import is_number
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.envs.checks import check_whole

ACTION_MODES = ("relative", "absolute")
REWARDS = ("improvement", "final", "regret", "objectives")
REGRET_WEIGHT = 0.3


@dataclass(frozen=True)
class Rules:
    """What a session allows and rewards; the arguments of ``DesignEnv`` of the same names."""

    budget: int = 12
    step_first: float = 1.0
    step_decay: float = 0.5
    step_min: float = 5e-4
    action_mode: str = "relative"
    reward: str = "improvement"
    regret_floor: float = 1e-5

    def __post_init__(self) -> None:
        """Refuse rules that make no session.

        Raises:
            ValueError: naming the argument, its value and what is allowed.
        """
        check_whole("budget", self.budget)
        for name in ("step_first", "step_decay", "step_min", "regret_floor"):
            value = getattr(self, name)
            if not (is_number(value) and 0.0 < value <= 1.0):
                raise ValueError(f"{name} is {value!r}: it must be greater than 0 and at most 1")
        if self.step_min > self.step_first:
            raise ValueError(
                f"step_min is {self.step_min:g}: it must be at most step_first, {self.step_first:g}"
            )
        check_known("action_mode", [self.action_mode], ACTION_MODES)
        check_known("reward", [self.reward], REWARDS)

    @cached_property
    def step_sizes(self) -> FloatArray:
        """Array (budget + 1,), the step size after 0, 1, ... evaluations, a share of the range."""
        decayed = self.step_first * self.step_decay ** np.arange(self.budget + 1)
        return np.maximum(self.step_min, decayed)

    def earned(
        self, before: FloatArray, after: FloatArray, optimum: FloatArray, last: BoolArray
    ) -> FloatArray:
        """Return the rewards (n,) of steps, where they are numbers.

        Args:
            before: array (n,), the best log merit before the step.
            after: array (n,), the best log merit after it.
            optimum: array (n,), the log merit of the task's optimum; only "regret" reads it.
            last: array (n,), whether it was the session's last step.
        """
        if self.reward == "improvement":
            return before - after
        if self.reward == "final":
            return np.where(last, -after, 0.0)
        regrets = (
            np.maximum(0.0, merit - optimum) + self.regret_floor for merit in (before, after)
        )
        return REGRET_WEIGHT * np.subtract(*(np.log(regret) for regret in regrets))
