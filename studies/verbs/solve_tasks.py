"""``pkm-gym solve-tasks``: tasks of the Family with their certified optima, in a pool."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms import called
from pkm_gym.studies.cli.arguments import problem_from
from pkm_gym.studies.cli.bounds import check_memory, solved_task
from pkm_gym.studies.cli.options import (
    FixOption,
    FreeOption,
    Name,
    ObjectiveOption,
    RangeOption,
    SeedOption,
    SetOption,
    output_option,
)
from pkm_gym.studies.cli.runs import run_folder
from pkm_gym.studies.cli.terminal import console
from pkm_gym.studies.search.solving import Job, solve


def command(
    name: Name,
    number: Annotated[
        int, typer.Option("-n", "--number", metavar="N", min=1, help="How many tasks.")
    ] = 4096,
    output: Annotated[
        Path | None, output_option("The pool; runs/NAME/pool.npz if not said.")
    ] = None,
    seed: SeedOption = 0,
    set_: SetOption = None,
    free: FreeOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
) -> None:
    """Draw tasks from the Family and solve each: two seeds must agree on its optimum.

    What is drawn depends on the seed alone. Stopped by Ctrl-C, the same command goes on where it
    was.
    """
    problem = problem_from(name, set_, fix, range_, objective, free, family=True)
    check_memory("-n", number, solved_task(problem))
    output = output or run_folder(problem.name) / "pool.npz"
    if output.exists():
        raise ValueError(f"{str(output)!r} exists: delete it, or choose another file with -o")
    settings = {
        "--set": set_,
        "--free": free,
        "--fix": fix,
        "--range": range_,
        "--objective": objective,
    }
    job = _job(problem, number, seed, settings, output)
    screen = console()
    solved = solve(job, screen)
    Pool.from_solutions(solved, job.starts, problem, job.command).save(output)
    job.part.unlink(missing_ok=True)
    screen.print(f"pool: {output}", soft_wrap=True)


def _job(
    problem: DesignProblem,
    number: int,
    seed: int,
    settings: dict[str, list[str] | None],
    output: Path,
) -> Job:
    words = [called(problem), "-n", str(number), "--seed", str(seed)]
    for flag, values in settings.items():
        words += [word for value in values or () for word in (flag, value)]
    for_tasks, for_starts = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(2))
    span = problem.high - problem.low
    return Job(
        problem=problem,
        tasks=problem.draw_tasks(number, for_tasks),
        starts=problem.low + span * for_starts.random((number, len(span))),
        seed=seed,
        command=f"pkm-gym solve-tasks {shlex.join(words)}",
        part=output.with_name(output.name + ".part"),
    )
