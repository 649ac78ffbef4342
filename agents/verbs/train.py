"""``pkm-gym train``: train an agent, with a bar, until done or Ctrl-C."""

from __future__ import annotations

import threading
from contextlib import nullcontext
from functools import partial
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)

from pkm_gym.agents.runs.course import check_course, course_for
from pkm_gym.agents.runs.environments import find_spec, find_trained
from pkm_gym.agents.runs.options import (
    USUAL,
    AlgorithmOption,
    HyperparametersOption,
    ParamsOption,
    PoolOption,
    StepsOption,
    ValidationOption,
)
from pkm_gym.agents.runs.recipe import read_recipe, resumed_recipe
from pkm_gym.agents.runs.run import BEST, RUN, Run, threads_that_tell
from pkm_gym.studies.cli.options import output_option
from pkm_gym.studies.cli.runs import if_full, own_command, run_folder
from pkm_gym.studies.cli.terminal import console
from pkm_gym.studies.search.runner import interruptible

if TYPE_CHECKING:
    from pkm_gym.agents.runs.trainer import Course

INTERRUPTED = 130  # as the front door says it


def command(
    env: Annotated[
        str,
        typer.Argument(
            metavar="ENV|RUN",
            help="Id of a design or motion environment: PKM/DiamondFamily-v0, my_package:Mine; "
            "with --resume the folder of a run.",
        ),
    ],
    algo: AlgorithmOption = None,
    steps: StepsOption = None,
    seed: Annotated[
        int | None,
        typer.Option(metavar="S", min=0, help="Of the random numbers; 0 if not said."),
    ] = None,
    params: ParamsOption = None,
    set_: HyperparametersOption = None,
    pool: PoolOption = None,
    validation: ValidationOption = None,
    output: Annotated[
        Path | None,
        output_option("Of the run; runs/agents/ENV-ALGORITHM-SEED if not said.", "FOLDER"),
    ] = None,
    resume: Annotated[
        bool,
        typer.Option(
            "--resume",
            help="Go on from the last checkpoint of a run, as it was asked for; more --steps (of a "
            "model more algorithm.updates) lengthen it.",
        ),
    ] = False,
    threads: Annotated[
        int, typer.Option(metavar="N", min=1, help="Of PyTorch; results differ with it.")
    ] = 1,
) -> None:
    """Train an agent on a design or a motion environment.

    The folder keeps the resolved settings, the scores, the last checkpoint and the best agent so
    far. Ctrl-C keeps the state; `pkm-gym train RUN --resume` goes on from there as if nothing had
    happened.
    """
    known = Path(env) if resume and (Path(env) / RUN).is_file() else None
    if known is not None and output is not None:
        raise ValueError(f"{env} and -o {output} are two folders: leave one out")
    spec = None if known is not None else find_spec(env, motion=True)
    name = spec.id.rpartition("/")[2] if spec else ""
    folder = known or output or run_folder("agents") / f"{name}-{algo or USUAL}-{seed or 0}"
    if resume:
        run = Run.read(folder)
        recipe = resumed_recipe(
            run.recipe, run.algorithm, run.env_id, file=params, settings=set_ or (), steps=steps
        )
        run = run.lengthened(
            env_id=spec and spec.id, algorithm=algo, seed=seed, recipe=recipe, pool=pool,
            validation=validation,
        )  # fmt: skip
    else:
        assert spec is not None
        algo = algo or USUAL
        find_trained(spec.id, algo)
        recipe = read_recipe(algo, spec.id, file=params, settings=set_ or (), steps=steps)
        run = Run(spec.id, algo, seed or 0, recipe, pool, validation, folder, own_command())
    screen = console()
    kept = f"{folder} keeps the last checkpoint, if there is one: --resume goes on from there"
    with if_full(kept, folder), threads_that_tell():
        best, goal = _train(run, screen, resume=resume, threads=threads)
    screen.print(f"best score {best:.4f} on {goal}")
    screen.print(f"agent: {folder / BEST}", soft_wrap=True)


def _train(run: Run, screen: Console, *, resume: bool, threads: int) -> tuple[float, str]:
    """Return the best score, and what it was measured on."""
    check_course(run.env_id, run.recipe, run.pool, run.validation)
    with nullcontext() if resume else run.begun():
        course: Course[Any] = course_for(
            run.env_id, run.recipe, run.folder, pool=run.pool, validation=run.validation,
            screen=screen,
        )  # fmt: skip
        if resume:
            run.state()  # it may be longer now
        import torch

        from pkm_gym.agents.runs.trainer import Stopped, trainer_for

        torch.set_num_threads(threads)
        try:
            with _bar(screen) as bar, interruptible(stop := threading.Event()):
                line = bar.add_task("", total=run.recipe.steps, score="")
                trainer = trainer_for(run, course, partial(_show, bar, line), stop.is_set)
                return trainer.train(resume=resume), course.goal
        except Stopped:
            screen.print(
                f"kept in {run.folder}: `pkm-gym train {run.folder} --resume` goes on",
                soft_wrap=True,
            )
            raise typer.Exit(INTERRUPTED) from None


def _bar(screen: Console) -> Progress:
    return Progress(
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("steps, {task.fields[score]}left"),
        TimeRemainingColumn(elapsed_when_finished=True),
        console=screen,
        transient=True,
        disable=not screen.is_terminal,
    )


def _show(bar: Progress, line: TaskID, steps: int, best: float) -> None:
    score = f"best score {best:.4f}, " if isfinite(best) else ""
    bar.update(line, completed=steps, score=score)
