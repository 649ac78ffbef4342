"""Hyperparameters by Optuna, scored on validation tasks, pruned on the way."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean
from typing import Any

import optuna
from optuna import Study, Trial
from optuna.trial import TrialState
from rich.console import Console

from pkm_gym.agents.runs.course import course_for
from pkm_gym.agents.runs.recipe import Recipe
from pkm_gym.agents.runs.run import CHECKPOINT, Run
from pkm_gym.agents.runs.trainer import trainer_for
from pkm_gym.studies.cli.runs import own_command
from pkm_gym.studies.storage.storages import open_storage

SEEDS = (0, 1)  # of each trial
FRESH = range(100, 105)  # of the winner's runs
STARTUP = 5  # trials before any is pruned

Range = tuple[float, float]

# What is searched: key -> (low, high), on a log scale where both are above 0 and far apart.
COMMON: dict[str, Range] = {"algorithm.learning_rate": (1e-4, 3e-3), "algorithm.gamma": (0.8, 1.0)}
SPACES: dict[str, dict[str, Range]] = {
    "ppo": {
        **COMMON,
        "algorithm.gae_lambda": (0.5, 1.0),
        "algorithm.clip_range": (0.1, 0.4),
        "policy.log_std_init": (-3.0, 0.0),
    },
    "sac": {**COMMON, "algorithm.tau": (1e-3, 5e-2)},
    "td3": {**COMMON, "algorithm.tau": (1e-3, 5e-2)},
    "tqc": {**COMMON, "algorithm.tau": (1e-3, 5e-2)},
    "model": {"algorithm.learning_rate": (1e-3, 1e-2), "algorithm.slopes": (3e-3, 0.3)},
}
FAR = 10.0
FALLS_TO = 0.01  # the share of the learning rate that is left at the end


@dataclass(frozen=True)
class Tuning:
    """What is tuned, and where its runs are kept."""

    env_id: str
    algorithm: str
    recipe: Recipe
    pool: Path | None
    validation: Path | None
    folder: Path
    screen: Console | None = None

    def run(self, settings: Mapping[str, float], seed: int, folder: Path,
            scored: Callable[[float], None] = lambda _: None) -> float:  # fmt: skip
        """Train with some settings and return the best score."""
        recipe = changed(self.recipe, settings)
        own = Run(self.env_id, self.algorithm, seed, recipe, self.pool, self.validation, folder)
        begun = (folder / CHECKPOINT).exists()
        if not begun:
            own.write()
        course = course_for(
            self.env_id, recipe, self.folder, pool=self.pool, validation=self.validation,
            screen=self.screen,
        )  # fmt: skip
        return trainer_for(own, course, scored=scored).train(resume=begun)

    def objective(self, trial: Trial) -> float:
        """Return the mean of the best scores of two training seeds; prune what lags behind."""
        settings = {
            name: trial.suggest_float(name, low, high, log=low > 0.0 and high > FAR * low)
            for name, (low, high) in SPACES[self.algorithm].items()
        }
        reports = iter(range(1_000_000))

        def scored(score: float) -> None:
            trial.report(score, next(reports))
            if trial.should_prune():
                raise optuna.TrialPruned

        folders = [self.folder / f"trial-{trial.number}-{seed}" for seed in SEEDS]
        return mean(self.run(settings, s, f, scored) for s, f in zip(SEEDS, folders, strict=True))


def changed(recipe: Recipe, settings: Mapping[str, float]) -> Recipe:
    """Return a recipe with some of its hyperparameters changed."""
    groups = {"algorithm": dict(recipe.algorithm), "policy": dict(recipe.policy)}
    for key, value in settings.items():
        group, _, name = key.partition(".")
        falling = name == "learning_rate"
        groups[group][name] = [value, FALLS_TO * value] if falling else value
    return replace(recipe, algorithm=groups["algorithm"], policy=groups["policy"])


def open_study(tuning: Tuning) -> Study:
    """Return the study, new or as an earlier run left it.

    Raises:
        ValueError: if it tunes something else.
    """
    tuning.folder.mkdir(parents=True, exist_ok=True)
    study = optuna.create_study(
        study_name="tune",
        storage=open_storage(str(tuning.folder / "studies.journal")),
        direction="maximize",
        sampler=optuna.samplers.TPESampler(),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=STARTUP),
        load_if_exists=True,
    )
    whole = Run(tuning.env_id, tuning.algorithm, 0, tuning.recipe, tuning.pool, tuning.validation,
                tuning.folder)  # fmt: skip
    identity: dict[str, Any] = json.loads(json.dumps(whole.settings()))
    kept = study.user_attrs.get("settings", identity)
    if kept != identity:
        name = next(name for name in identity if kept.get(name) != identity[name])
        raise ValueError(
            f"{str(tuning.folder)!r} tunes another {name}: {kept.get(name)} there, "
            f"{identity[name]} here"
        )
    study.set_user_attr("settings", identity)
    study.set_user_attr("command", own_command())
    return study


def count_ended(study: Study) -> int:
    """Return how many trials have ended, to their end or pruned."""
    ended = (TrialState.COMPLETE, TrialState.PRUNED)
    return len(study.get_trials(deepcopy=False, states=ended))
