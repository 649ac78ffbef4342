"""``pkm-gym agent-eval``: trained agents by the benchmark's protocol."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.agents.designers.files import read_designer
from pkm_gym.agents.designers.library import designer_path
from pkm_gym.agents.designers.scoring import SCORED, Agent, record
from pkm_gym.agents.sb3.models import load_model
from pkm_gym.benchmark.standings import standings
from pkm_gym.core.names import check_known
from pkm_gym.studies.benchmark.tables import show
from pkm_gym.studies.cli.options import SplitsOption, output_option
from pkm_gym.studies.cli.runs import own_command
from pkm_gym.studies.cli.terminal import console


def command(
    models: Annotated[
        list[str],
        typer.Argument(
            metavar="MODEL ...",
            help="A shipped designer's name, a run's folder, a .json file, or with --trust an "
            "SB3 .zip. Several count as training seeds of one designer.",
        ),
    ],
    split: Annotated[str, typer.Option(metavar="|".join(SCORED), help="Which tasks.")] = "val",
    output: Annotated[
        Path | None, output_option("Keep the logs there, for `pkm-gym score`.", "FOLDER")
    ] = None,
    splits: SplitsOption = None,
    trust: Annotated[
        bool, typer.Option("--trust", help="Unpickle .zip files: they may run any code.")
    ] = False,
    env: Annotated[
        str | None,
        typer.Option(metavar="ENV", help="Where a .zip was trained.", show_default=False),
    ] = None,
    algo: Annotated[str, typer.Option(metavar="ALGORITHM", help="What trained a .zip.")] = "ppo",
    pool: Annotated[
        int, typer.Option(metavar="N", min=0, help="Solved tasks that a .zip was trained on.")
    ] = 0,
) -> None:
    """Score trained agents on tasks that they never saw.

    Tune on val only; test is for what is published. Its training counts as a cost, and so do the
    solved tasks that it was trained on.
    """
    check_known("split", [split], SCORED)
    agents = []
    for model in models:
        if model.endswith(".zip"):
            loaded = load_model(model, trust=trust, env_id=env, algorithm=algo)
            agents.append(Agent(*loaded, pool))
        else:
            designer, origin = read_designer(designer_path(model))
            agents.append(Agent(designer, origin.steps, origin.pool))
    logs = record(agents, split, own_command(), splits)
    if output:
        for log in logs:
            log.save(output / f"designer-{log.setting.seed}.npz")
    show(console(), standings(logs))
