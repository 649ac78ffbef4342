"""``pkm-gym search``: search a design space with Optuna, resumable, in batches, by workers."""

from __future__ import annotations

import shlex
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, TypeAlias

import typer
from optuna import Study
from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.units import show as show_value
from pkm_gym.studies.arguments import (
    FixOption,
    Name,
    ObjectiveOption,
    RangeOption,
    SetOption,
    problem_from,
)
from pkm_gym.studies.artifacts import Pictures, write_graphs, write_note
from pkm_gym.studies.report import rich_table, rows_beside_paper
from pkm_gym.studies.runner import Report, Runner, answer
from pkm_gym.studies.samplers import MAKERS, check_sampler, make_sampler, values_for
from pkm_gym.studies.starts import enqueue, warm_designs
from pkm_gym.studies.storage import (
    artifact_folder,
    count_finished,
    default_storage,
    fail_stale,
    open_storage,
    open_study,
    quiet,
    redacted,
    version_note,
)
from pkm_gym.studies.terminal import BAD, FAINT, console, counter

StorageOption: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="FILE|URL",
        help="A journal file or a database URL; runs/NAME/studies.journal if not said.",
        show_default=False,
    ),
]

TRIALS = 500


@dataclass(frozen=True)
class Found:
    """What a search found.

    Attributes:
        study: Optuna's study.
        best: the evaluation of the answer, one design.
        trial: number of its trial.
        storage: where the study is.
        finished: how many trials have values.
        stopped: whether Ctrl-C ended it early.
        note: what is worth saying of the study, or nothing.
    """

    study: Study
    best: Evaluation
    trial: int
    storage: str
    finished: int
    stopped: bool
    note: str


def search(
    problem: DesignProblem,
    *,
    sampler: str = "tpe",
    trials: int = TRIALS,
    seed: int = 0,
    storage: str | None = None,
    name: str | None = None,
    warm_start: Sequence[str] = (),
    batch: int = 1,
    jobs: int = 1,
    worker: int = 0,
    command: str = "",
    report: Report | None = None,
) -> Found:
    """Search until the study has ``trials`` finished trials; a study that exists is resumed.

    Args:
        problem: what is searched, with its task.
        sampler: "tpe", "cmaes", "gp", "nsga2", "qmc" or "random".
        trials: the target total.
        seed: of the sampler.
        storage: a journal file or a database URL; the problem's journal under runs/ by default.
        name: of the study; problem and sampler by default.
        warm_start: "paper", "grid" or names of studies in the storage, tried first.
        batch: designs an ``evaluate``.
        jobs: threads.
        worker: number of this process among those that share the study.
        command: kept with a new study.
        report: called after each batch with the finished trials and the best design.

    Raises:
        ValueError: in one sentence, for what isn't possible; the study is as it was then.
    """
    check_sampler(sampler, len(problem.objectives))
    for what, number in (("trials", trials), ("batch", batch), ("jobs", jobs)):
        if number < 1:
            raise ValueError(f"{what} is {number}: it must be at least 1")
    where, values = storage or default_storage(problem.name), values_for(sampler)
    with quiet():
        starts = [warm_designs(problem, source, where) for source in warm_start]
        store = open_storage(where)
        study = open_study(
            problem, store, name or f"{problem.name}-{sampler}", values=values, command=command
        )
        fail_stale(study)
        begun = len(study.get_trials(deepcopy=False))
        study.sampler = make_sampler(sampler, seed=seed, start=begun, worker=worker)
        if sampler == "cmaes" and begun == 0:
            # Its first trial belongs to no generation: let it be the mean of the first one.
            starts.insert(0, 0.5 * (problem.low + problem.high)[None])
        if count_finished(study) < trials:
            enqueue(study, problem, starts)
        pictures = Pictures(problem, study, artifact_folder(where))
        runner = Runner(
            study,
            problem,
            trials=trials,
            values=values,
            batch=batch,
            pictures=pictures,
            report=report,
        )
        stopped = runner.run(jobs)
        best, trial = answer(study, problem)
        if runner.ran:
            addresses = pictures.draw(study.get_trials(deepcopy=False)[trial], best.designs[0])
            write_note(study, best, f"best, trial {trial}", addresses)
            write_graphs(study, problem)
    return Found(study, best, trial, where, count_finished(study), stopped, version_note(study))


def command(
    name: Name,
    sampler: Annotated[
        str, typer.Option(metavar="SAMPLER", help=f"One of {', '.join(MAKERS)}.")
    ] = "tpe",
    trials: Annotated[
        int, typer.Option(metavar="N", min=1, help="How many finished trials the study shall have.")
    ] = TRIALS,
    seed: Annotated[int, typer.Option(metavar="S", min=0, help="Of the sampler.")] = 0,
    storage: StorageOption = None,
    study_name: Annotated[
        str | None,
        typer.Option(
            "--name",
            metavar="STUDY",
            help="Of the study; NAME-SAMPLER if not said.",
            show_default=False,
        ),
    ] = None,
    set_: SetOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
    warm_start: Annotated[
        list[str] | None,
        typer.Option(
            metavar="paper|grid|STUDY",
            help="Try these designs first: the printed one, or the best ten of the paper's grid "
            "or of a study in the same storage. Repeat it for several.",
        ),
    ] = None,
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
) -> None:
    """Search the design space with Optuna; the same command again goes on where it was.

    Example: pkm-gym search diamond --sampler cmaes --trials 300 --set task.payload=1kg
    """
    problem = problem_from(name, set_, fix, range_, objective)
    screen = console()
    began = time.monotonic()
    with search_bar(screen, problem, trials) as report:
        found = search(
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
    if found.stopped:
        screen.print(
            f"stopped: {found.finished} of {trials} trials are finished and kept; the same "
            "command goes on from there",
            soft_wrap=True,
        )
        raise KeyboardInterrupt
    show(screen, found)
    screen.print(f"{time.monotonic() - began:.1f} s", style=FAINT)


def own_command() -> str:
    """Return the command line as it was typed, without passwords."""
    return redacted(shlex.join(["pkm-gym", *sys.argv[1:]]))


def show(screen: Console, found: Found) -> None:
    """Print what a search found beside the paper's numbers, and where it is."""
    best, study = found.best, found.study
    problem = best.problem
    rows = rows_beside_paper(best, f"best, trial {found.trial}")
    screen.print(rich_table(problem, rows))
    if not best.feasible[0]:
        screen.print("no feasible design was found; the one of lowest merit breaks:", style=BAD)
        screen.print(best.explain(0), style=BAD)
    if len(problem.objectives) > 1:
        screen.print(f"{len(study.best_trials)} designs on the Pareto front")
    if found.note:
        screen.print(found.note, style=FAINT)
    screen.print(
        f"study: {study.study_name} in {redacted(found.storage)}, {found.finished} trials",
        soft_wrap=True,
    )


@contextmanager
def search_bar(screen: Console, problem: DesignProblem, trials: int) -> Iterator[Report]:
    """Give the report of a search that moves a bar and shows the best value so far."""
    progress = counter(screen, "trials")
    first = problem.objectives[0]
    line = progress.add_task("starting", total=trials)

    def report(count: int, best: Evaluation) -> None:
        value = f"best {first.name} {show_value(best.objectives[0, 0], first.unit)}"
        words = value if best.feasible[0] else "none feasible yet"
        progress.update(line, completed=count, description=words)

    with progress:
        yield report
