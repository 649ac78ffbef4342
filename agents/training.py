"""Training: a run that is trained, scored and kept in its folder, whatever the algorithm."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pkm_gym.agents.designer import Designer
from pkm_gym.agents.files import Origin, write_designer
from pkm_gym.agents.lessons import Lessons
from pkm_gym.agents.runs import BEST, SCORES, Run, versions
from pkm_gym.benchmark.scoring import score

Report = Callable[[int, float], None]


class Stopped(Exception):  # noqa: N818 (it is no error)
    """Training was asked to stop and has kept its state."""


@dataclass
class Training(ABC):
    """A run that is trained.

    Attributes:
        run: what is trained, and where it is kept.
        lessons: what it learns and is scored on.
        report: called with the steps done and the best score so far.
        stop: asked now and then whether to keep the state and end.
        scored: called with each score.
        best: the best score so far.
    """

    run: Run
    lessons: Lessons
    report: Report = lambda *_: None
    stop: Callable[[], bool] = lambda: False
    scored: Callable[[float], None] = lambda _: None
    best: float = field(default=-np.inf, init=False)

    @abstractmethod
    def train(self, *, resume: bool = False) -> float:
        """Train to the end, from the last checkpoint if ``resume``; return the best score.

        Raises:
            ValueError: for a checkpoint that can't be read, or a setting that is refused.
            Stopped: after ``stop`` said so; the state is kept.
        """

    def score(self, designer: Designer, steps: int) -> float:
        """Score what was learned in so many steps, and keep it if it is the best so far."""
        run, lessons = self.run, self.lessons
        reached = score(designer.design(lessons.tasks).regrets(lessons.optima))
        if reached > self.best:
            self.best = reached
            origin = Origin(run.env_id, run.command, steps, reached, versions())
            write_designer(designer, run.folder / BEST, origin, lessons.problem_arguments)
        line = {"steps": steps, "score": reached}
        with (run.folder / SCORES).open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        return reached


def training_of(
    run: Run,
    lessons: Lessons,
    report: Report = lambda *_: None,
    stop: Callable[[], bool] = lambda: False,
    scored: Callable[[float], None] = lambda _: None,
) -> Training:
    """Return the training of a run, as its algorithm learns."""
    if run.algorithm == "model":
        from pkm_gym.agents.fitting import Fitting

        return Fitting(run, lessons, report, stop, scored)
    from pkm_gym.agents.learning import Learning

    return Learning(run, lessons, report, stop, scored)
