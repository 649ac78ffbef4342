"""``pkm-gym agent-eval``: trained agents by the benchmark's protocol."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.agents.designers.designer import Designer
from pkm_gym.agents.designers.files import read_designer
from pkm_gym.agents.designers.library import designer_path
from pkm_gym.agents.designers.scoring import AT, SCORED, Agent, record, score_on
from pkm_gym.agents.sb3.models import load_model
from pkm_gym.agents.verbs.zoo import median_words
from pkm_gym.benchmark.standings import standings
from pkm_gym.core.names import check_known
from pkm_gym.core.pool import Pool
from pkm_gym.studies.benchmark.scored import REGRET, scored
from pkm_gym.studies.benchmark.tables import show
from pkm_gym.studies.cli.options import (
    CsvOption,
    PlainJsonOption,
    SplitsOption,
    output_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import own_command
from pkm_gym.studies.cli.terminal import FAINT, table


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
    tasks: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Solved tasks to be scored on instead, by `pkm-gym solve-tasks`: for agents of "
            "another objective, or with other variables, than the splits'.",
            show_default=False,
        ),
    ] = None,
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
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Score trained agents on tasks that they never saw.

    Tune on val only; test is for what is published. Its training counts as a cost, and so do the
    solved tasks that it was trained on.
    """
    out = Output(as_json, csv)
    check_known("split", [split], SCORED)
    if tasks is not None and (output or splits):
        raise ValueError("--tasks is no split: leave out --output and --folder")
    agents = []
    for model in models:
        if model.endswith(".zip"):
            loaded = load_model(model, trust=trust, env_id=env, algorithm=algo)
            agents.append(Agent(*loaded, pool))
        else:
            designer, origin = read_designer(designer_path(model))
            agents.append(Agent(designer, origin.steps, origin.pool))
    if tasks is not None:
        _show_on(
            out, tasks, {name: agent.designer for name, agent in zip(models, agents, strict=True)}
        )
        return
    logs = record(agents, split, own_command(), splits)
    if output:
        for log in logs:
            log.save(output / f"designer-{log.setting.seed}.npz")
    measured = standings(logs)
    show(out.screen, measured)
    out.give(scored(measured))


def _show_on(out: Output, tasks: Path, designers: Mapping[str, Designer]) -> None:
    """Print how good designers are on a file of solved tasks."""
    scores = {
        name: score_on(designer, Pool.load(tasks, designer.problem))
        for name, designer in designers.items()
    }
    counts = [k for k in AT if any(k in one.medians for one in scores.values())]
    heads = ["tasks", "score", *(f"k = {k}" for k in counts), "feasible"]
    rows = table("agent", *heads, numbers=heads)
    for name, one in scores.items():
        medians = [median_words(one.medians[k]) if k in one.medians else "" for k in counts]
        rows.add_row(
            name, f"{one.tasks}", f"{one.score:.4f}", *medians, f"{100.0 * one.feasible:.1f} %"
        )
    out.screen.print(rows)
    objective = next(iter(designers.values())).problem.objectives[0].name
    out.screen.print(
        f"solved tasks of {tasks}, objective {objective}; k = 1, 4, ...: median regret in per cent "
        "after k evaluations",
        style=FAINT,
    )
    told = [
        {
            "agent": name,
            "tasks": one.tasks,
            "score": one.score,
            "median_regret": one.medians,
            "feasible": one.feasible,
        }
        for name, one in scores.items()
    ]
    out.give({"solved_tasks": tasks, "objective": objective, "regret": REGRET, "rows": told})
