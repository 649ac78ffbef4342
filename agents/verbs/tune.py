"""``pkm-gym tune``: hyperparameters by Optuna, scored on validation tasks, pruned on the way."""

from __future__ import annotations

from pathlib import Path
from statistics import median
from typing import Annotated

import torch
import typer

from pkm_gym.agents.runs.course import check_course
from pkm_gym.agents.runs.environments import find_trained
from pkm_gym.agents.runs.options import (
    USUAL,
    AlgorithmOption,
    HyperparametersOption,
    ParamsOption,
    PoolOption,
    StepsOption,
    ValidationOption,
)
from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.agents.runs.run import threads_that_tell
from pkm_gym.agents.runs.tuning import FRESH, Tuning, count_ended, open_study
from pkm_gym.studies.cli.options import (
    CsvOption,
    PlainJsonOption,
    TrialsOption,
    output_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import if_full, run_folder
from pkm_gym.studies.cli.terminal import FAINT, section, table
from pkm_gym.studies.storage.storages import quiet
from pkm_gym.studies.storage.studies import count_finished, fail_stale


def command(
    env: Annotated[
        str, typer.Argument(metavar="ENV", help="Id of a design or motion environment.")
    ],
    algo: AlgorithmOption = None,
    trials: TrialsOption = 20,
    steps: StepsOption = None,
    params: ParamsOption = None,
    set_: HyperparametersOption = None,
    pool: PoolOption = None,
    validation: ValidationOption = None,
    output: Annotated[
        Path | None,
        output_option(
            "Of the study and its runs; runs/agents/tune-ENV-ALGORITHM if not said.", "FOLDER"
        ),
    ] = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Search the hyperparameters of an algorithm; two training seeds a trial.

    A trial that lags behind is pruned. The winner is trained again with five fresh seeds, and only
    those count. Stopped by Ctrl-C, the same command goes on.
    """
    out = Output(as_json, csv)
    torch.set_num_threads(1)  # more are slower for nets so small
    algo = algo or USUAL
    spec = find_trained(env, algo)
    folder = output or run_folder("agents") / f"tune-{spec.id.rpartition('/')[2]}-{algo}"
    recipe = read_recipe(algo, spec.id, file=params, settings=set_ or (), steps=steps)
    check_course(spec.id, recipe, pool, validation)
    tuning = Tuning(spec.id, algo, recipe, pool, validation, folder, out.bars)
    screen = out.screen
    kept = f"{folder} keeps the trials that have ended; the same command goes on from there"
    with quiet(), if_full(kept, folder), threads_that_tell():
        study = open_study(tuning)
        fail_stale(study)
        missing = trials - count_ended(study)
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
    screen.print(section(f"The best of {count_ended(study)} trials, trial {winner.number}"))
    screen.print(rows)
    screen.print(f"score {winner.value:.4f} when it was chosen, which flatters it", style=FAINT)
    several = f"median of {len(fresh)} fresh seeds ({min(fresh):.4f} to {max(fresh):.4f})"
    screen.print(f"score {median(fresh):.4f}, {several if len(fresh) > 1 else 'one fresh seed'}")
    rows_told = [{"hyperparameter": name, "value": x} for name, x in winner.params.items()]
    scores = {"score_when_chosen": winner.value, "score": median(fresh), "fresh_scores": fresh}
    out.give({"environment": spec.id, "trial": winner.number, **scores, "rows": rows_told})
