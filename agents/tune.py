"""``pkm-gym tune``: hyperparameters by Optuna, scored on validation tasks, pruned on the way."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import mean, median
from typing import Annotated, Any

import optuna
import torch
import typer
from optuna import Study, Trial
from optuna.trial import TrialState

from pkm_gym.agents.lessons import find_spec, prepare
from pkm_gym.agents.recipe import ALGORITHMS, Recipe, read_recipe
from pkm_gym.agents.runs import CHECKPOINT, Run
from pkm_gym.agents.trainings import training_of
from pkm_gym.studies.search import own_command
from pkm_gym.studies.storage import count_finished, open_storage, quiet
from pkm_gym.studies.terminal import FAINT, console, section, table

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

    def run(self, settings: Mapping[str, float], seed: int, folder: Path,
            scored: Callable[[float], None] = lambda _: None) -> float:  # fmt: skip
        """Train with some settings and return the best score."""
        recipe = changed(self.recipe, settings)
        own = Run(self.env_id, self.algorithm, seed, recipe, self.pool, self.validation, folder)
        known = (folder / CHECKPOINT).exists()
        if not known:
            own.write()
        lessons = prepare(
            self.env_id, recipe, self.folder, pool=self.pool, validation=self.validation
        )
        return training_of(own, lessons, scored=scored).train(resume=known)

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


def command(
    env: Annotated[str, typer.Argument(metavar="ENV", help="Id of a design environment.")],
    algo: Annotated[
        str, typer.Option(metavar="ALGORITHM", help=f"One of {', '.join(ALGORITHMS)}.")
    ] = "ppo",
    trials: Annotated[
        int, typer.Option(metavar="N", min=1, help="How many trials the study shall have.")
    ] = 20,
    steps: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Of each training run.")
    ] = None,
    params: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Hyperparameters to start from (TOML).")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE ...", help="Hyperparameters that are kept."),
    ] = None,
    pool: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Solved tasks to learn on.")
    ] = None,
    validation: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Solved tasks to be scored on.")
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="FOLDER",
            help="Of the study and its runs; runs/agents/tune-ENV-ALGORITHM if not said.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Search the hyperparameters of an algorithm; two training seeds a trial.

    A trial that lags behind is pruned. The winner is trained again with five fresh seeds, and only
    those count. Stopped by Ctrl-C, the same command goes on.
    """
    torch.set_num_threads(1)  # more are slower for nets so small
    spec = find_spec(env)
    folder = output or Path("runs/agents") / f"tune-{spec.id.rpartition('/')[2]}-{algo}"
    recipe = read_recipe(algo, spec.id, file=params, settings=set_ or (), steps=steps)
    tuning = Tuning(spec.id, algo, recipe, pool, validation, folder)
    screen = console()
    with quiet():
        study = _study(tuning)
        missing = trials - _count(study)
        if missing > 0:
            study.optimize(tuning.objective, n_trials=missing)
        if not count_finished(study):
            raise ValueError("no trial has finished: give more --trials")
        winner = study.best_trial
        fresh = [
            tuning.run(winner.params, s, folder / f"winner-{winner.number}-{s}") for s in FRESH
        ]
    rows = table("hyperparameter", "value", numbers=["value"])
    for name, value in winner.params.items():
        rows.add_row(name, f"{value:.4g}")
    screen.print(section(f"The best of {_count(study)} trials, trial {winner.number}"))
    screen.print(rows)
    screen.print(f"score {winner.value:.4f} when it was chosen, which flatters it", style=FAINT)
    screen.print(
        f"score {median(fresh):.4f}, median of {len(fresh)} fresh seeds "
        f"({min(fresh):.4f} to {max(fresh):.4f})"
    )


def _study(tuning: Tuning) -> Study:
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


def _count(study: Study) -> int:
    ended = (TrialState.COMPLETE, TrialState.PRUNED)
    return len(study.get_trials(deepcopy=False, states=ended))
