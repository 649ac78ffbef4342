"""``pkm-gym agent-eval``: trained agents by the benchmark's protocol."""

from __future__ import annotations

import time
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pkm_gym.agents.designer import Designer
from pkm_gym.agents.files import read_designer
from pkm_gym.agents.library import designer_path
from pkm_gym.agents.models import load_model
from pkm_gym.benchmark.record import Cost, EvaluationLog
from pkm_gym.benchmark.run import setting
from pkm_gym.benchmark.splits import load_split
from pkm_gym.benchmark.standings import standings
from pkm_gym.core.names import check_known
from pkm_gym.studies.search import own_command
from pkm_gym.studies.standings import show
from pkm_gym.studies.terminal import console

SCORED = ("val", "ood", "test")


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
        Path | None,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Keep the logs there, for `pkm-gym score`."
        ),
    ] = None,
    trust: Annotated[
        bool, typer.Option("--trust", help="Unpickle .zip files: they may run any code.")
    ] = False,
    env: Annotated[
        str | None,
        typer.Option(metavar="ENV", help="Where a .zip was trained.", show_default=False),
    ] = None,
    algo: Annotated[str, typer.Option(metavar="ALGORITHM", help="What trained a .zip.")] = "ppo",
) -> None:
    """Score trained agents on tasks that they never saw.

    Tune on val only; test is for what is published.
    """
    check_known("split", [split], SCORED)
    designers, costs = [], []
    for model in models:
        if model.endswith(".zip"):
            designers.append(load_model(model, trust=trust, env_id=env, algorithm=algo))
            costs.append(Cost())
        else:
            designer, origin = read_designer(designer_path(model))
            designers.append(designer)
            costs.append(Cost(origin.steps, np.nan))  # its time isn't recorded
    logs = record(designers, costs, split, own_command())
    if output:
        for log in logs:
            log.save(output / f"designer-{log.setting.seed}.npz")
    show(console(), standings(logs))


def record(
    designers: Sequence[Designer], costs: Sequence[Cost], split: str, command: str
) -> list[EvaluationLog]:
    """Return the logs of designers of one problem on a split; they count as training seeds.

    Args:
        designers: trained agents.
        costs: what training each of them cost.
        split: which tasks.
        command: what asked for it.

    Raises:
        ValueError: for designers of other problems, or a problem that the benchmark doesn't have.
    """
    name = designers[0].problem.name
    problem, tasks = load_split(name, split)
    logs = []
    for seed, (designer, cost) in enumerate(zip(designers, costs, strict=True)):
        if designer.problem.hash() != problem.hash():
            raise ValueError(f"agent {seed + 1} designs for another problem than {name}'s split")
        how = setting(name, split, "designer", seed=seed, evaluations=designer.rules.budget)
        began = time.perf_counter()
        designs = designer.design(tasks.tasks).designs
        seconds = np.full(len(tasks), (time.perf_counter() - began) / len(tasks))
        rows = np.arange(len(tasks), dtype=np.int64)
        logs.append(EvaluationLog(how, rows, designs, seconds, version("pkm_gym"), command, cost))
    return logs
