"""SurrogateTrainer: a run that trains a surrogate on designs near solved tasks' optima."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.agents.designers.designer import Policy
from pkm_gym.agents.planner.nearby import Nearby
from pkm_gym.agents.planner.planner import Planner
from pkm_gym.agents.planner.samples import draw
from pkm_gym.agents.planner.settings import Settings
from pkm_gym.agents.planner.training import SurrogateTraining
from pkm_gym.agents.runs.course import DesignCourse
from pkm_gym.agents.runs.run import CHECKPOINT
from pkm_gym.agents.runs.trainer import Stopped, Trainer

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter

CHECK_EVERY = 100  # updates between two looks at whether to stop


class SurrogateTrainer(Trainer[Policy]):
    """A run that trains a surrogate, for a designer that plans with it."""

    course: DesignCourse

    def train(self, *, resume: bool = False) -> float:
        """Train to the end, from the last checkpoint if ``resume``; return the best score.

        Raises:
            ValueError: without solved tasks, for a bad setting or an unreadable checkpoint.
            Stopped: after ``stop`` said so; the state is kept.
        """
        training, path = self.begin(), self.run.folder / CHECKPOINT
        if resume:
            self.best = training.load(path)
        updates = training.settings.updates
        every = max(1, updates // self.run.recipe.checkpoints)
        with _board(self.run.folder / "tensorboard") as board:
            while training.done < updates:
                loss = training.update()
                if training.done % every == 0 or training.done == updates:
                    self._keep(training, path)
                if training.done % CHECK_EVERY == 0:
                    board.add_scalar("train/loss", loss, training.done)
                    self.report(self._steps(training), self.best)
                    if self.stop():
                        training.save(path, self.best)
                        raise Stopped
        return self.best

    def begin(self) -> SurrogateTraining:
        """Return the training at its beginning: the samples are drawn, no update is done.

        Raises:
            ValueError: without solved tasks, or for fewer than two samples of each.
        """
        pool, recipe, seed = self.course.pool, self.run.recipe, self.run.seed
        if pool is None:
            raise ValueError("a model is trained on solved tasks: give --pool FILE.npz")
        settings = Settings(**recipe.algorithm)
        tasks = settings.tasks or int(pool.solvable.sum())
        if recipe.steps < 2 * tasks:
            kind = "drawn" if settings.tasks else "solved"
            raise ValueError(
                f"steps is {recipe.steps}: {tasks} {kind} tasks need at least {2 * tasks}"
            )
        generator = np.random.default_rng(seed)
        samples = draw(self.course.problem, pool, settings, recipe.steps, generator)
        return SurrogateTraining(self.course.problem, samples, settings, seed)

    def _keep(self, training: SurrogateTraining, path: Path) -> None:
        reached = self.score(self._planner(training), self._steps(training))
        training.save(path, self.best)
        self.scored(reached)

    def _planner(self, training: SurrogateTraining) -> Planner:
        """Return the designer's policy; with drawn tasks it knows the optima of those solved."""
        pool = self.course.pool if training.settings.tasks else None
        nearby = None if pool is None else Nearby.of_pool(self.course.problem, pool)
        return Planner(training.surrogate(), nearby)

    def _steps(self, training: SurrogateTraining) -> int:
        """Return the share of the evaluations that the updates done have made use of."""
        return round(self.run.recipe.steps * training.done / training.settings.updates)


def _board(folder: Path) -> SummaryWriter:
    from torch.utils.tensorboard import SummaryWriter

    return SummaryWriter(str(folder))
