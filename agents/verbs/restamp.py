"""``pkm-gym restamp``: pools and designers of an older version, renewed where they still hold."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from pkm_gym.agents.designers.library import shipped
from pkm_gym.agents.designers.renewal import renew
from pkm_gym.agents.runs.files import CONFIG
from pkm_gym.benchmark.splits import manifest, sha256, split_file, write_manifest
from pkm_gym.core.pool import Pool, renewed
from pkm_gym.core.problem import DesignProblem
from pkm_gym.mechanisms import family_problem
from pkm_gym.studies.cli.options import Name
from pkm_gym.studies.cli.terminal import console


def command(
    name: Name,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="FILE ...",
            help="Pools (.npz) or designers (.json); what is shipped of the mechanism if not said.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Renew files of an older version of a problem: pools of solved tasks, and designers.

    Every stored optimum must still be what the problem evaluates it to, and every designer must
    still design what it did; then the problem's hash and what newer files hold are written into it.
    """
    problem = family_problem(name)
    screen = console()
    for path in files or shipped_files(problem):
        changed = renew(path) if path.suffix == CONFIG else renew_pool(path, problem)
        screen.print(f"{path}: {'renewed' if changed else 'is as it should be'}", soft_wrap=True)


def shipped_files(problem: DesignProblem) -> list[Path]:
    """Return the shipped splits and designers of a problem."""
    splits = [split_file(problem, split) for split in problem.declared.splits]
    designers = [path for path in shipped().values() if f'"{problem.name}"' in path.read_text()]
    return [path for path in (*splits, *designers) if path.exists()]


def renew_pool(path: Path, problem: DesignProblem) -> bool:
    """Write an older pool anew, and in the manifest if it is a split; return whether it is one."""
    with suppress(ValueError):
        Pool.load(path, problem)
        return False
    entries = manifest(path.parent)
    entry = entries.get(path.name)
    split = entry is not None and entry.sha256 == sha256(path)
    renewed(path, problem, certified=split).save(path)
    if split and entry is not None:
        renewed_entry = replace(entry, sha256=sha256(path))
        write_manifest(entries | {path.name: renewed_entry}, path.parent)
    return True
