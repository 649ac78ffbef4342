"""``pkm-gym train``: train an agent, with a bar, until done or Ctrl-C."""

from __future__ import annotations

import threading
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

from pkm_gym.agents.runs.course import check_course, design_course
from pkm_gym.agents.runs.environments import find_spec, is_motion
from pkm_gym.agents.runs.options import (
    AlgorithmOption,
    HyperparametersOption,
    ParamsOption,
    PoolOption,
    StepsOption,
    ValidationOption,
)
from pkm_gym.agents.runs.recipe import ALGORITHMS, LEARNERS, read_recipe
from pkm_gym.agents.runs.run import BEST, Run, threads_that_tell
from pkm_gym.agents.sb3.motion import motion_course
from pkm_gym.studies.cli.options import SeedOption, output_option
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
            metavar="ENV",
            help="Id of a design or motion environment: PKM/DiamondFamily-v0, my_package:Mine.",
        ),
    ],
    algo: AlgorithmOption = "ppo",
    steps: StepsOption = None,
    seed: SeedOption = 0,
    params: ParamsOption = None,
    set_: HyperparametersOption = None,
    pool: PoolOption = None,
    validation: ValidationOption = None,
    output: Annotated[
        Path | None,
        output_option("Of the run; runs/agents/ENV-ALGORITHM-SEED if not said.", "FOLDER"),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on from the last checkpoint of the folder.")
    ] = False,
    threads: Annotated[
        int, typer.Option(metavar="N", min=1, help="Of PyTorch; results differ with it.")
    ] = 1,
) -> None:
    """Train an agent on a design or a motion environment.

    The folder keeps the resolved settings, the scores, the last checkpoint and the best agent so
    far. Ctrl-C keeps the state; --resume goes on from there as if nothing had happened.
    """
    spec = find_spec(env, motion=True)
    if is_motion(spec) and algo in set(ALGORITHMS) - set(LEARNERS):
        raise ValueError(f"{spec.id} is trained by one of {', '.join(LEARNERS)}, not by {algo}")
    folder = output or run_folder("agents") / f"{spec.id.rpartition('/')[2]}-{algo}-{seed}"
    recipe = read_recipe(algo, spec.id, file=params, settings=set_ or (), steps=steps)
    run = Run(spec.id, algo, seed, recipe, pool, validation, folder, own_command())
    screen = console()
    kept = f"{folder} keeps the last checkpoint, if there is one: --resume goes on from there"
    with if_full(kept, folder), threads_that_tell():
        best, goal = _train(run, screen, resume=resume, threads=threads)
    screen.print(f"best score {best:.4f} on {goal}")
    screen.print(f"agent: {folder / BEST}", soft_wrap=True)


def _train(run: Run, screen: Console, *, resume: bool, threads: int) -> tuple[float, str]:
    """Return the best score, and what it was measured on."""
    spec = find_spec(run.env_id, motion=True)
    if not is_motion(spec):
        check_course(spec.id, run.recipe, run.pool, run.validation)
    if resume:
        run.check()
    else:
        run.write()
    course: Course[Any]
    if is_motion(spec):
        course = motion_course(spec, run.recipe, pool=run.pool, validation=run.validation)
    else:
        course = design_course(
            spec.id, run.recipe, run.folder, pool=run.pool, validation=run.validation
        )
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
            f"kept in {run.folder}: the same command with --resume goes on", soft_wrap=True
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
