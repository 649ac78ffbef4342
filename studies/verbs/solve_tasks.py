"""``pkm-gym solve-tasks``: tasks of the Family with their certified optima, in a pool."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.units import show
from pkm_gym.mechanisms import called
from pkm_gym.studies.cli.arguments import problem_from
from pkm_gym.studies.cli.bounds import check_memory, solved_task
from pkm_gym.studies.cli.options import (
    CsvOption,
    FixOption,
    FreeOption,
    Name,
    ObjectiveOption,
    PlainJsonOption,
    RangeOption,
    SeedOption,
    SetOption,
    output_option,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.runs import run_folder
from pkm_gym.studies.report.records import solved_tasks
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
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Draw tasks from the Family and solve each: two seeds must agree on its optimum.

    What is drawn depends on the seed alone. Stopped by Ctrl-C, the same command goes on where it
    was.
    """
    out = Output(as_json, csv)
    problem = problem_from(name, set_, fix, range_, objective, free, family=True)
    _check_kept(problem)
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
    solved = solve(job, out.bars)
    pool = Pool.from_solutions(solved, job.starts, problem, job.command)
    pool.save(output)
    job.part.unlink(missing_ok=True)
    out.screen.print(f"pool: {output}", soft_wrap=True)
    if out.wanted:
        out.give(solved_tasks(problem, pool, output))


def _check_kept(problem: DesignProblem) -> None:
    """Refuse a value of what the Family draws: no task would have it."""
    for v in problem.task_variables:
        value = getattr(problem.task, v.name)
        if v.drawn and value != v.default:
            raise ValueError(
                f"task.{v.name} is set to {show(value, v.unit)}, and the Family draws it from "
                f"{show(v.low, v.unit)} to {show(v.high, v.unit)}: leave it out"
            )


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
