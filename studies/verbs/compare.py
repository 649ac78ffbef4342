"""``pkm-gym compare``: the paper, a grid, a polished design and the samplers, side by side."""

from __future__ import annotations

from typing import Annotated

import typer

from pkm_gym.studies.cli.arguments import problem_from
from pkm_gym.studies.cli.bounds import TRIAL, check_memory
from pkm_gym.studies.cli.options import (
    CsvOption,
    DesignFileOption,
    FixOption,
    FreeOption,
    Name,
    ObjectiveOption,
    PlainJsonOption,
    RangeOption,
    SetOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import own_command
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.comparison.compare import (
    EVALUATIONS,
    SEEDS,
    compare,
    comparison_bar,
    runs_of,
    save,
)
from pkm_gym.studies.report.records import told
from pkm_gym.studies.report.rows import rich_table
from pkm_gym.studies.search.polish import told_optimum


def command(
    name: Name,
    evaluations: Annotated[
        int, typer.Option(metavar="N", min=1, help="Designs that each run may evaluate.")
    ] = EVALUATIONS,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Runs of each sampler.")] = SEEDS,
    full: Annotated[
        bool,
        typer.Option("--full", help="With the sampler gp too, which takes many minutes."),
    ] = False,
    agents: Annotated[
        bool,
        typer.Option("--agents", help="With PPO and SAC trained on this task, some minutes each."),
    ] = False,
    set_: SetOption = None,
    design: DesignFileOption = None,
    free: FreeOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Compare the paper's optimum, a grid over its ranges, a polished design, Optuna's samplers.

    Each counts with its best feasible design; the table goes to runs/NAME/compare.md and, with
    every run, to compare.json.
    """
    problem = problem_from(name, set_, fix, range_, objective, free, file=design)
    check_memory("--evaluations", evaluations, TRIAL)
    out = Output(as_json, csv)
    screen = out.screen
    told_optimum(out.bars, problem)
    with comparison_bar(out.bars, seeds, full=full, agents=agents) as progress:
        comparison = compare(
            problem,
            evaluations=evaluations,
            seeds=seeds,
            full=full,
            agents=agents,
            progress=progress,
        )
    screen.print(rich_table(problem, comparison.rows))
    if comparison.verdict:
        screen.print(comparison.verdict)
    written = save(comparison, task_folder(problem), own_command())
    screen.print(f"written: {', '.join(map(str, written))}", soft_wrap=True)
    runs, verdict = runs_of(comparison), comparison.verdict
    out.give(told(problem, comparison.rows, verdict=verdict, written=list(written), runs=runs))
