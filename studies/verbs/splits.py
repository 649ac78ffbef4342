"""``pkm-gym splits``: draw the benchmark's tasks, certify their optima, write the files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.benchmark.splits import (
    Entry,
    check_split,
    check_splits,
    default_folder,
    draw,
    manifest,
    sha256,
    split_file,
    write_manifest,
)
from pkm_gym.core.declaration import SPLITS
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import called, family_problem
from pkm_gym.studies.cli.bounds import check_memory, solved_task
from pkm_gym.studies.cli.options import Name, output_option
from pkm_gym.studies.cli.terminal import BAD, console, section
from pkm_gym.studies.search.bettering import from_evolution, from_neighbours
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
        Path | None,
        output_option(
            "Where the files go; the package, or runs/NAME/splits, by default.", "FOLDER"
        ),
    ] = None,
) -> None:
    """Make the benchmark's splits of a problem: its tasks, starts and optima.

    What is drawn depends on the problem's version alone. An optimum on which searches disagree is
    kept as the best known; so is one to which the optimum of a neighbouring training task leads, or
    an evolution, where the problem declares that they are asked. Stopped by Ctrl-C, the same
    command goes on where it was.
    """
    problem = family_problem(name)
    check_splits(problem)
    chosen = split or list(problem.declared.splits)
    for one in chosen:
        check_split(problem, one)
        check_memory(f"split {one} of", problem.declared.splits[one], solved_task(problem))
    folder = output or default_folder(problem)
    folder.mkdir(parents=True, exist_ok=True)
    for one in chosen:
        _make(problem, one, folder)


def _make(problem: DesignProblem, split: str, folder: Path) -> None:
    path, screen, drawn = split_file(problem, split, folder), console(), draw(problem, split)
    screen.print(section(f"{problem.name}, {split}: {len(drawn.tasks)} tasks"))
    job = Job(
        problem=problem,
        tasks=drawn.tasks,
        starts=drawn.starts,
        seed=list(SPLITS).index(split),
        command=f"pkm-gym splits {called(problem)} --split {split}",
        part=path.with_name(f"{path.name}.part"),
        effort=problem.declared.thorough[split != "train"],
    )
    solved = solve(job, screen)
    if problem.declared.neighbours:
        solved = from_neighbours(job, solved, screen, _known(problem, split, folder))
    if problem.declared.evolutions and split != "train":
        solved = from_evolution(job, solved, screen)
    Pool.from_solutions(solved, drawn.starts, problem, job.command).save(path)
    write_manifest(
        manifest(folder) | {path.name: Entry(sha256(path), solved.evaluations, solved.seconds)},
        folder,
    )
    job.part.unlink(missing_ok=True)
    best_known = int((~solved.certified).sum())
    if best_known:
        screen.print(f"{best_known} of the optima are the best known, not certified", style=BAD)
    screen.print(f"split: {path}", soft_wrap=True)


def _known(
    problem: DesignProblem, split: str, folder: Path
) -> tuple[FloatArray, FloatArray] | None:
    """Return tasks and optima of the training split, None for itself."""
    if split == "train":
        return None
    pool = Pool.load(split_file(problem, "train", folder), problem)
    return pool.tasks[pool.solvable], pool.designs[pool.solvable]
