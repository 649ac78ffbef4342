"""Which training an algorithm needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pkm_gym.agents.planner.trainer import Fitting
from pkm_gym.agents.runs.run import Run
from pkm_gym.agents.runs.trainer import Report, Training
from pkm_gym.agents.sb3.trainer import Learning


def training_of(
    run: Run,
    lessons: Any,
    report: Report = lambda *_: None,
    stop: Callable[[], bool] = lambda: False,
    scored: Callable[[float], None] = lambda _: None,
) -> Training[Any]:
    """Return the training of a run, as its algorithm learns; see ``Training``."""
    kind: type[Training[Any]] = Fitting if run.algorithm == "model" else Learning
    return kind(run, lessons, report, stop, scored)
