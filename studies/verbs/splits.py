"""``pkm-gym splits``: draw the benchmark's tasks, certify their optima, write the files."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pkm_gym.benchmark.splits import (
    FOLDER,
    SPLITS,
    Entry,
    check_split,
    draw,
    manifest,
    sha256,
    split_path,
    write_manifest,
)
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms import make_problem
from pkm_gym.studies.cli.options import Name, output_option
from pkm_gym.studies.cli.terminal import console, section
from pkm_gym.studies.search.solving import Job, solve


def command(
    name: Name,
    split: Annotated[
        list[str] | None,
        typer.Option(
            metavar="|".join(SPLITS),
            help="Only this split; repeat it for several.",
            show_default=False,
        ),
    ] = None,
    output: Annotated[
        Path, output_option("Where the files go; the package by default.", "FOLDER")
    ] = FOLDER,
) -> None:
    """Make the benchmark's splits of a problem: its tasks, starts and certified optima.

    What is drawn depends on the problem's version alone. Stopped by Ctrl-C, the same command goes
    on where it was.
    """
    problem = make_problem(name)
    for chosen in split or SPLITS:
        check_split(problem, chosen)
    output.mkdir(parents=True, exist_ok=True)
    for chosen in split or SPLITS:
        _make(problem, chosen, output)


def _make(problem: DesignProblem, split: str, folder: Path) -> None:
    path = folder / split_path(problem.name, split).name
    screen = console()
    screen.print(section(f"{problem.name}, {split}: {SPLITS[split]} tasks"))
    drawn = draw(problem, split)
    job = Job(
        problem=problem,
        tasks=drawn.tasks,
        starts=drawn.starts,
        seed=list(SPLITS).index(split),
        command=f"pkm-gym splits {problem.name} --split {split}",
        part=path.with_name(f"{path.name}.part"),
    )
    kept = job.kept()
    before = kept.evaluations if kept else 0
    began = time.process_time()
    solved = solve(job, screen)
    share = solved.evaluations / max(1, solved.evaluations - before)
    seconds = (time.process_time() - began) * share
    if not solved.certified.all():
        open_tasks = np.flatnonzero(~solved.certified).tolist()
        raise ValueError(
            f"{problem.name} {split}: tasks {open_tasks} are not certified, so {str(path)!r} was "
            "not written"
        )
    Pool.from_solutions(solved, drawn.starts, problem, job.command).save(path)
    write_manifest(
        manifest(folder) | {path.name: Entry(sha256(path), solved.evaluations, seconds)}, folder
    )
    job.part.unlink(missing_ok=True)
    screen.print(f"split: {path}", soft_wrap=True)
