"""Trainer: a run that is trained, scored and kept in its folder, whatever the algorithm."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from pkm_gym.agents.runs.files import Origin
from pkm_gym.agents.runs.recipe import LEARNERS
from pkm_gym.agents.runs.run import BEST, SCORES, Run, versions
from pkm_gym.core.files import append_lines
from pkm_gym.core.names import imported

# Which trainer an algorithm needs.
SB3 = "pkm_gym.agents.sb3.trainer:PolicyTrainer"
PLANNER = "pkm_gym.agents.planner.trainer:SurrogateTrainer"

Policy_contra = TypeVar("Policy_contra", contravariant=True)
Report = Callable[[int, float], None]


class Course(Protocol[Policy_contra]):
    """What an agent is trained and scored on."""

    @property
    def goal(self) -> str:
        """What the agent is scored on."""
        ...

    def score(self, policy: Policy_contra) -> float:
        """Return the score of a policy; larger is better."""
        ...

    def write(self, policy: Policy_contra, path: Path, origin: Origin) -> None:
        """Write a policy so that it can be used."""
        ...


class Stopped(Exception):  # noqa: N818 (it is no error)
    """Training was asked to stop and has kept its state."""


@dataclass
class Trainer(ABC, Generic[Policy_contra]):
    """A run that is trained.

    Attributes:
        run: what is trained, and where it is kept.
        course: what it is trained and scored on.
        report: called with the steps done and the best score so far.
        stop: asked now and then whether to keep the state and end.
        scored: called with each score.
        best: the best score so far.
    """

    run: Run
    course: Course[Policy_contra]
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

    def score(self, policy: Policy_contra, steps: int) -> float:
        """Score what was trained in so many steps, and keep it if it is the best so far."""
        run = self.run
        reached = self.course.score(policy)
        if reached > self.best:
            self.best = reached
            origin = Origin(run.env_id, run.command, steps, reached, versions())
            self.course.write(policy, run.folder / BEST, origin)
        line = {"steps": steps, "score": reached}
        append_lines(run.folder / SCORES, json.dumps(line) + "\n")
        return reached


def trainer_for(
    run: Run,
    course: Any,
    report: Report = lambda *_: None,
    stop: Callable[[], bool] = lambda: False,
    scored: Callable[[float], None] = lambda _: None,
) -> Trainer[Any]:
    """Return the trainer of a run, for its algorithm; see ``Trainer``."""
    trainer: Trainer[Any] = imported(SB3 if run.algorithm in LEARNERS else PLANNER)(
        run, course, report, stop, scored
    )
    return trainer
