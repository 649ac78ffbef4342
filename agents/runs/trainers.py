"""Which trainer an algorithm needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pkm_gym.agents.planner.trainer import SurrogateTrainer
from pkm_gym.agents.runs.run import Run
from pkm_gym.agents.runs.trainer import Report, Trainer
from pkm_gym.agents.sb3.trainer import PolicyTrainer


def trainer_for(
    run: Run,
    course: Any,
    report: Report = lambda *_: None,
    stop: Callable[[], bool] = lambda: False,
    scored: Callable[[float], None] = lambda _: None,
) -> Trainer[Any]:
    """Return the trainer of a run, for its algorithm; see ``Trainer``."""
    kind: type[Trainer[Any]] = SurrogateTrainer if run.algorithm == "model" else PolicyTrainer
    return kind(run, course, report, stop, scored)
