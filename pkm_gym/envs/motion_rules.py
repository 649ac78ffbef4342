"""The rules of a run along a path: how it is driven, what ends it, and what it earns."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, log1p
from typing import Any

import numpy as np

from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.checks import check_whole

STARTS = ("beginning", "anywhere")
CLOSE = 1e-3  # m, where the tracking term bends
HIGH = 0.9  # share of the force limit where its term begins
MOST_OFFSET = 0.1

# The terms of the reward before the first step.
NOTHING = {"reward_tracking": 0.0, "reward_effort": 0.0, "reward_limit": 0.0}


@dataclass(frozen=True)
class MotionRules:
    """How a path is run and what that earns; the arguments of ``MotionEnv`` of the same names."""

    speed: float = 1.0
    frame_skip: int = 5
    force_limit: float | None = None
    error_limit: float = 0.05
    loop_limit: float = 1e-3
    effort_weight: float = 0.05
    limit_weight: float = 0.1
    start: str = "beginning"
    start_offset: float = 0.0

    def __post_init__(self) -> None:
        """Refuse rules that make no run.

        Raises:
            ValueError: naming the argument, its value and what is allowed.
        """
        check_whole("frame_skip", self.frame_skip)
        check_known("start", [self.start], STARTS)
        for name in ("speed", "error_limit", "loop_limit"):
            _check(name, getattr(self, name), above=True)
        if self.force_limit is not None:
            _check("force_limit", self.force_limit, above=True)
        for name in ("effort_weight", "limit_weight"):
            _check(name, getattr(self, name))
        _check("start_offset", self.start_offset, most=MOST_OFFSET)

    def terms(self, error: float, action: FloatArray, *, failed: bool) -> dict[str, float]:
        """Return the terms of a step's reward.

        Args:
            error: m, the tool's distance from the path.
            action: array (joints,), in [-1, 1].
            failed: whether the step ended the run before the path's end.
        """
        lost = log1p(error / CLOSE) / log1p(self.error_limit / CLOSE)
        beyond = np.maximum(0.0, np.abs(action) - HIGH) / (1.0 - HIGH)
        return {
            "reward_tracking": 0.0 if failed else 1.0 - lost,
            "reward_effort": -self.effort_weight * float((action**2).mean()),
            "reward_limit": -self.limit_weight * float(beyond.mean()),
        }


def _check(name: str, value: Any, *, above: bool = False, most: float = 1e9) -> None:
    """Refuse what isn't a number from 0, or above it, to ``most``."""
    number = isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
    if not (number and 0.0 <= value <= most and not (above and value == 0.0)):
        least = "greater than 0" if above else "at least 0"
        raise ValueError(f"{name} is {value!r}: it must be {least} and at most {most:g}")
