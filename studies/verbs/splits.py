"""``pkm-gym splits``: draw the benchmark's tasks, certify their optima, write the files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from pkm_gym.benchmark.record import EvaluationLog
from pkm_gym.benchmark.splits import (
    Drawn,
    Entry,
    check_split,
    check_splits,
    default_folder,
    draw,
    load_split,
    manifest,
    sha256,
    split_file,
    write_manifest,
)
from pkm_gym.core.declaration import SPLITS
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import called, family_problem
from pkm_gym.studies.cli.bounds import check_memory, solved_task
from pkm_gym.studies.cli.options import Name, output_option
from pkm_gym.studies.cli.terminal import BAD, console, section
from pkm_gym.studies.search.bettering import from_evolution, from_log, from_neighbours
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
    from_: Annotated[
        list[Path] | None,
        typer.Option(
            "--from",
            metavar="LOG.npz",
            help="Better the optima of a split that is made: descend from the best designs of this "
            "log of a method; repeat it for several.",
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
    an evolution, where the problem declares that they are asked, or a design of a --from log.
    Stopped by Ctrl-C, the same command goes on where it was.
    """
    problem = family_problem(name)
    check_splits(problem)
    if from_:
        _better(problem, split, from_, output or default_folder(problem))
        return
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
    job = _job(problem, split, path, drawn)
    solved = solve(job, screen)
    if problem.declared.neighbours:
        solved = from_neighbours(job, solved, screen, _known(problem, split, folder))
    if problem.declared.evolutions and split != "train":
        solved = from_evolution(job, solved, screen)
    _write(job, solved, path, screen)


def _better(
    problem: DesignProblem, split: list[str] | None, files: Sequence[Path], folder: Path
) -> None:
    """Better the optima of the split that logs are of."""
    logs, screen = _logs(problem, files), console()
    one = logs[0].setting.split
    if any(log.setting.split != one for log in logs) or split not in (None, [one]):
        named = ", ".join(dict.fromkeys([*(split or []), *(log.setting.split for log in logs)]))
        raise ValueError(f"--from betters one split at a time, not {named}")
    pool, path = load_split(called(problem), one, folder)[1], split_file(problem, one, folder)
    entry = manifest(folder)[path.name]
    job = _job(problem, one, path, Drawn(pool.tasks, pool.starts))
    job = replace(job, command=" --from ".join([job.command, *map(str, files)]))
    solved = job.kept() or pool.solutions(problem, entry.evaluations, entry.seconds)
    screen.print(section(f"{problem.name}, {one}: {len(pool)} tasks"))
    for log in logs:
        solved = from_log(job, solved, screen, log)
    _write(job, solved, path, screen)


def _logs(problem: DesignProblem, files: Sequence[Path]) -> list[EvaluationLog]:
    """Return logs of runs on a problem's splits.

    Raises:
        ValueError: in one sentence, for a file that is none, or another problem's.
    """
    logs = [EvaluationLog.load(file) for file in files]
    for file, log in zip(files, logs, strict=True):
        if log.setting.hash != problem.hash():
            raise ValueError(
                f"{str(file)!r} is a log of {log.setting.problem}, or of another version of it: "
                f"{problem.name} as it is now is wanted"
            )
    return logs


def _write(job: Job, solved: Solutions, path: Path, screen: Console) -> None:
    Pool.from_solutions(solved, job.starts, job.problem, job.command).save(path)
    entry = Entry(sha256(path), solved.evaluations, solved.seconds)
    write_manifest(manifest(path.parent) | {path.name: entry}, path.parent)
    job.part.unlink(missing_ok=True)
    best_known = int((~solved.certified).sum())
    if best_known:
        screen.print(f"{best_known} of the optima are the best known, not certified", style=BAD)
    screen.print(f"split: {path}", soft_wrap=True)


def _job(problem: DesignProblem, split: str, path: Path, drawn: Drawn) -> Job:
    return Job(
        problem=problem,
        tasks=drawn.tasks,
        starts=drawn.starts,
        seed=list(SPLITS).index(split),
        command=f"pkm-gym splits {called(problem)} --split {split}",
        part=path.with_name(f"{path.name}.part"),
        effort=problem.declared.thorough[split != "train"],
    )


def _known(
    problem: DesignProblem, split: str, folder: Path
) -> tuple[FloatArray, FloatArray] | None:
    """Return tasks and optima of the training split, None for itself."""
    if split == "train":
        return None
    pool = Pool.load(split_file(problem, "train", folder), problem)
    return pool.tasks[pool.solvable], pool.designs[pool.solvable]
