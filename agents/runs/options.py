"""The options that the verbs of training share, as typer reads them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

from pkm_gym.agents.runs.recipe import ALGORITHMS
from pkm_gym.studies.cli.options import set_option

USUAL = "ppo"

AlgorithmOption: TypeAlias = Annotated[
    str | None,
    typer.Option(metavar="ALGORITHM", help=f"One of {', '.join(ALGORITHMS)}; {USUAL} if not said."),
]
StepsOption: TypeAlias = Annotated[
    int | None,
    typer.Option(metavar="N", min=1, help="Steps of a run; as the recipe says if not said."),
]
ParamsOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Hyperparameters (TOML) instead of those shipped."),
]
HyperparametersOption: TypeAlias = Annotated[
    list[str] | None,
    set_option(
        "Hyperparameters: algorithm.gamma=0.9 policy.net_arch=[64,64] environment.budget=24 "
        "envs=256."
    ),
]
PoolOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Solved tasks to train on, by `pkm-gym solve-tasks`."),
]
ValidationOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="Solved tasks to be scored on: they choose the best agent."),
]
