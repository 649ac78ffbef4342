"""PolicyTrainer: an SB3 algorithm on design sessions, resumable to the bit."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any, Protocol

import torch
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import configure
from stable_baselines3.common.utils import LinearSchedule
from stable_baselines3.common.vec_env import VecEnv

from pkm_gym.agents.runs.recipe import algorithm_class
from pkm_gym.agents.runs.run import CHECKPOINT, Run
from pkm_gym.agents.runs.state import best_score, restoring
from pkm_gym.agents.runs.trainer import Course, Stopped, Trainer
from pkm_gym.agents.sb3.checkpoint import load_checkpoint, save_checkpoint
from pkm_gym.agents.sb3.network import Network

ACTIVATIONS = {"relu": torch.nn.ReLU, "silu": torch.nn.SiLU, "tanh": torch.nn.Tanh}


class VecCourse(Course[Network], Protocol):
    """What an SB3 algorithm is trained on."""

    def vec_env(self, n: int) -> VecEnv:
        """Return n environments to train on; their state can be saved and restored."""
        ...


class PolicyTrainer(Trainer[Network]):
    """A run of an SB3 algorithm."""

    course: VecCourse

    def train(self, *, resume: bool = False) -> float:
        """Train to the end, from the last checkpoint if ``resume``; return the best score.

        Raises:
            ValueError: for a checkpoint that can't be read, or a setting that SB3 refuses.
            Stopped: after ``stop`` said so; the state is kept.
        """
        model = make_model(self.run, self.course)
        keeper = Keeper(self)
        if resume:
            path = self.run.folder / CHECKPOINT
            kept = load_checkpoint(model, path)
            with restoring(path):
                self.best = best_score(kept["best"])
        left = self.run.recipe.steps - model.num_timesteps
        if left > 0:
            model.learn(left, callback=keeper, reset_num_timesteps=False)
            keeper.keep()
        return self.best


def make_model(run: Run, course: VecCourse) -> Any:
    """Return an untrained SB3 model of a run.

    Raises:
        ValueError: for a setting that SB3 refuses.
    """
    recipe = run.recipe
    env = course.vec_env(recipe.envs)
    env.seed(run.seed)
    algorithm = dict(recipe.algorithm)
    rate = algorithm.get("learning_rate")
    if isinstance(rate, list):
        algorithm["learning_rate"] = LinearSchedule(float(rate[0]), float(rate[1]), 1.0)
    if isinstance(algorithm.get("train_freq"), list):
        algorithm["train_freq"] = tuple(algorithm["train_freq"])
    policy = dict(recipe.policy)
    policy["activation_fn"] = ACTIVATIONS[policy.pop("activation", "relu")]
    try:
        model = algorithm_class(run.algorithm)(
            "MlpPolicy", env, policy_kwargs=policy, seed=run.seed, device="cpu", **algorithm
        )
    except (TypeError, AssertionError) as error:
        raise ValueError(f"{run.algorithm} refuses its settings: {error}") from None
    board = ["tensorboard"] if find_spec("tensorboard") else []
    model.set_logger(configure(str(run.folder / "tensorboard"), board))
    return model


class Keeper(BaseCallback):
    """Between rollouts: reports, scores, keeps the state and the best designer, stops."""

    def __init__(self, trainer: PolicyTrainer) -> None:
        super().__init__()
        self.trainer = trainer
        recipe = trainer.run.recipe
        self._interval = max(1, recipe.steps // recipe.checkpoints)

    def _on_rollout_start(self) -> None:
        done = self.num_timesteps
        before = done - self._last_rollout()
        if done and done // self._interval > before // self._interval:
            self.keep()
        self.trainer.report(done, self.trainer.best)
        if self.trainer.stop():
            self._save()
            raise Stopped

    def _on_step(self) -> bool:
        return True

    def keep(self) -> None:
        """Score the agent and keep the state."""
        reached = self.trainer.score(Network.of_model(self.model), self.num_timesteps)
        self.model.logger.record("validation/score", reached)
        self._save()
        self.trainer.scored(reached)

    def _save(self) -> None:
        path = self.trainer.run.folder / CHECKPOINT
        save_checkpoint(self.model, path, best=self.trainer.best)

    def _last_rollout(self) -> int:
        """Return how many steps the last rollout had."""
        model: Any = self.model
        frequency = getattr(model, "train_freq", None)
        steps = frequency.frequency if frequency else model.n_steps
        count: int = steps * model.n_envs
        return count
