"""``pkm-gym grid``: a grid in one call, as an atlas and as a study of its best."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.cli.arguments import problem_from
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
    StorageOption,
    output_option,
    study_name_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import own_command, redacted
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import BAD
from pkm_gym.studies.grid.grid import (
    LOGGED,
    best_of_grid,
    grid,
    grid_bar,
    grid_line,
    grid_study_name,
)
from pkm_gym.studies.report.records import told
from pkm_gym.studies.report.rows import rich_table, rows_beside_paper
from pkm_gym.studies.search.polish import told_optimum
from pkm_gym.studies.storage.storages import default_storage


def command(
    name: Name,
    step: Annotated[
        float | None,
        typer.Option(
            metavar="S",
            help="Evaluate our grid, this step in SI apart in every variable over its bounds, in "
            "place of the problem's own grid; where it has none, the step that each variable "
            "declares.",
            show_default=False,
        ),
    ] = None,
    storage: StorageOption = None,
    study_name: Annotated[
        str | None,
        study_name_option("Of the study; NAME-grid, with a step NAME-grid-S, if not said."),
    ] = None,
    output: Annotated[
        Path | None, output_option("The atlas; runs/NAME/grid.nc if not said.")
    ] = None,
    set_: SetOption = None,
    design: DesignFileOption = None,
    free: FreeOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Evaluate a grid in one call, write all of it to a file and log its best designs.

    It is the paper's where that prints one, else, or with --step, one of ours. The file is NetCDF:
    xarray.open_dataset reads it.
    """
    problem = problem_from(name, set_, fix, range_, objective, free, file=design)
    out = Output(as_json, csv)
    screen = out.screen
    with grid_bar(out.bars, problem, step) as progress:
        evaluation = grid(
            problem, step=step, storage=storage, name=study_name, output=output,
            command=own_command(), progress=progress,
        )  # fmt: skip
    feasible = int(evaluation.feasible.sum())
    screen.print(grid_line(evaluation, step))
    best = problem.evaluate(evaluation.designs[evaluation.best()][None])
    optimum = told_optimum(out.bars, problem)
    rows = rows_beside_paper(best, best_of_grid(problem, step), optimum)
    screen.print(rich_table(problem, rows))
    where = redacted(storage or default_storage(problem.name))
    study, atlas = study_name or grid_study_name(problem, step), output or _atlas(problem)
    if not feasible:
        screen.print("no design of the grid is feasible, so none is logged", style=BAD)
    else:
        logged = f"{study} in {where}, the best {min(feasible, LOGGED)} designs"
        screen.print(f"study: {logged}", soft_wrap=True)
    screen.print(f"atlas: {atlas}", soft_wrap=True)
    counts = {"designs": len(evaluation), "feasible": feasible}
    out.give(told(problem, rows, **counts, study=study, storage=where, atlas=atlas))


def _atlas(problem: DesignProblem) -> Path:
    return task_folder(problem) / "grid.nc"
