"""Fitting: a run in which a surrogate learns what the designs near solved tasks' optima give."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pkm_gym.agents.designers.designer import Policy
from pkm_gym.agents.planner.planner import Planner
from pkm_gym.agents.planner.samples import draw
from pkm_gym.agents.planner.settings import Settings
from pkm_gym.agents.planner.training import Fit
from pkm_gym.agents.runs.course import Lessons
from pkm_gym.agents.runs.run import CHECKPOINT
from pkm_gym.agents.runs.trainer import Stopped, Training

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter

CHECK_EVERY = 100  # updates between two looks at whether to stop


class Fitting(Training[Policy]):
    """A run that fits a surrogate, for a designer that plans with it."""

    lessons: Lessons

    def train(self, *, resume: bool = False) -> float:
        """Fit to the end, from the last checkpoint if ``resume``; return the best score.

        Raises:
            ValueError: without solved tasks, for a bad setting or an unreadable checkpoint.
            Stopped: after ``stop`` said so; the state is kept.
        """
        fit, path = self.begin(), self.run.folder / CHECKPOINT
        if resume:
            self.best = fit.load(path)
        updates = fit.settings.updates
        every = max(1, updates // self.run.recipe.checkpoints)
        with _board(self.run.folder / "tensorboard") as board:
            while fit.done < updates:
                loss = fit.update()
                if fit.done % every == 0 or fit.done == updates:
                    self._keep(fit, path)
                if fit.done % CHECK_EVERY == 0:
                    board.add_scalar("fit/loss", loss, fit.done)
                    self.report(self._steps(fit), self.best)
                    if self.stop():
                        fit.save(path, self.best)
                        raise Stopped
        return self.best

    def begin(self) -> Fit:
        """Return the fit at its beginning: the samples are drawn, nothing is learned.

        Raises:
            ValueError: without solved tasks, or for fewer than two samples of each.
        """
        pool, recipe, seed = self.lessons.pool, self.run.recipe, self.run.seed
        if pool is None:
            raise ValueError("a model learns from solved tasks: give --pool FILE.npz")
        tasks = int(pool.solvable.sum())
        if recipe.steps < 2 * tasks:
            raise ValueError(
                f"steps is {recipe.steps}: {tasks} solved tasks need at least {2 * tasks}"
            )
        generator = np.random.default_rng(seed)
        samples = draw(self.lessons.problem, pool, recipe.steps // tasks, generator)
        return Fit(self.lessons.problem, samples, Settings(**recipe.algorithm), seed)

    def _keep(self, fit: Fit, path: Path) -> None:
        reached = self.score(Planner(fit.surrogate()), self._steps(fit))
        fit.save(path, self.best)
        self.scored(reached)

    def _steps(self, fit: Fit) -> int:
        """Return the share of the evaluations that the updates done have made use of."""
        return round(self.run.recipe.steps * fit.done / fit.settings.updates)


def _board(folder: Path) -> SummaryWriter:
    from torch.utils.tensorboard import SummaryWriter

    return SummaryWriter(str(folder))
