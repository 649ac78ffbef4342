"""``pkm-gym search``: search a design space with Optuna, resumable, in batches, by workers."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Annotated

import typer
from rich.console import Console

from pkm_gym.mechanisms import called
from pkm_gym.studies.buildable.robust_search import (
    robust_from,
    robust_rows,
    robust_told,
    show_robust,
)
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
    SeedOption,
    SetOption,
    SigmaOption,
    StorageOption,
    TrialsOption,
    study_name_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import file_name, own_command, redacted
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.cli.terminal import BAD, FAINT
from pkm_gym.studies.report.answer import hand_over, handed_over
from pkm_gym.studies.report.records import told
from pkm_gym.studies.report.rows import Row, rich_table, rows_beside_paper
from pkm_gym.studies.search.polish import told_optimum
from pkm_gym.studies.search.samplers import SAMPLERS
from pkm_gym.studies.search.search import TRIALS, SearchResult, search, search_bar


def command(
    name: Name,
    sampler: Annotated[
        str, typer.Option(metavar="SAMPLER", help=f"One of {', '.join(SAMPLERS)}.")
    ] = "tpe",
    trials: TrialsOption = TRIALS,
    seed: SeedOption = 0,
    storage: StorageOption = None,
    study_name: Annotated[
        str | None, study_name_option("Of the study; NAME-SAMPLER if not said.")
    ] = None,
    set_: SetOption = None,
    design: DesignFileOption = None,
    free: FreeOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
    warm_start: Annotated[
        list[str] | None,
        typer.Option(
            metavar="paper|grid|designer:N|STUDY",
            help="Try these designs first: the printed one, the first N of a trained designer, or "
            "the best ten of the grid or of a study in the same storage. Repeat it for "
            "several.",
        ),
    ] = None,
    robust: Annotated[
        float | None,
        typer.Option(
            metavar="SHARE",
            help="Answer for this share of the machines that are built with the errors of --sigma: "
            "their quantile of the objective, and the yield as a limit.",
            show_default=False,
        ),
    ] = None,
    sigma: SigmaOption = None,
    batch: Annotated[
        int, typer.Option(metavar="N", min=1, help="Designs asked for and evaluated at once.")
    ] = 1,
    jobs: Annotated[int, typer.Option(metavar="N", min=1, help="Threads.")] = 1,
    worker: Annotated[
        int,
        typer.Option(
            metavar="K",
            min=0,
            help="Number of this process, when several search the same study at once.",
        ),
    ] = 0,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Search the design space with Optuna; the same command again goes on where it was.

    Example: pkm-gym search diamond --sampler cmaes --trials 300 --set task.payload=1kg
    """
    asked = problem_from(name, set_, fix, range_, objective, free, file=design)
    problem = robust_from(asked, robust, sigma or (), sampler)
    if problem is not asked:
        study_name = study_name or f"{problem.name}-{sampler}-robust"
    check_memory("--trials", trials, TRIAL)
    check_memory("--batch", batch, TRIAL)
    out = Output(as_json, csv)
    screen = out.screen
    began = time.monotonic()
    with search_bar(out.bars, problem, trials) as report:
        result = search(
            problem,
            sampler=sampler,
            trials=trials,
            seed=seed,
            storage=storage,
            name=study_name,
            warm_start=warm_start or (),
            batch=batch,
            jobs=jobs,
            worker=worker,
            command=own_command(),
            report=report,
        )
    if result.stopped:
        out.bars.print(
            f"stopped: {result.finished} of {trials} trials are finished and kept; the same "
            "command goes on from there",
            soft_wrap=True,
        )
        raise KeyboardInterrupt
    best = result.best if problem is asked else asked.evaluate(result.best.designs)
    if problem is asked:
        rows = _rows(out, result)
        show(screen, result, rows)
        content = told(problem, rows)
    else:
        machines = robust_rows(out.bars, result, best)
        show_robust(screen, result, machines)
        content = robust_told(result, best, machines)
    path = task_folder(asked) / file_name(f"{result.study.study_name}.toml")
    hand_over(screen, best, path)
    out.give(
        {
            **content,
            "study": result.study.study_name,
            "storage": redacted(result.storage),
            "trials": result.finished,
            "trial": result.trial,
            **handed_over(best, path),
        }
    )
    screen.print(f"{time.monotonic() - began:.1f} s", style=FAINT)


def _rows(out: Output, result: SearchResult) -> list[Row]:
    optimum = told_optimum(out.bars, result.best.problem)
    return rows_beside_paper(result.best, f"best, trial {result.trial}", optimum)


def show(screen: Console, result: SearchResult, rows: Sequence[Row]) -> None:
    """Print what a search found beside the paper's numbers, and where it is."""
    best, study = result.best, result.study
    problem = best.problem
    screen.print(rich_table(problem, rows))
    if not best.feasible[0]:
        screen.print("no feasible design was found; the one of lowest merit breaks:", style=BAD)
        screen.print(best.explain(0), style=BAD)
    if len(problem.objectives) > 1:
        words = " ".join(f"--objective {objective.name}" for objective in problem.objectives)
        verb = f"pkm-gym pareto {called(problem)} {words}"
        front = f"{len(study.best_trials)} designs on the Pareto front"
        screen.print(f"{front}, shown by {verb}", soft_wrap=True)
    if result.note:
        screen.print(result.note, style=FAINT)
    screen.print(
        f"study: {study.study_name} in {redacted(result.storage)}, {result.finished} trials",
        soft_wrap=True,
    )
