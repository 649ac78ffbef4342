"""A folder for each task of a problem under runs/NAME, and an index of them."""

from __future__ import annotations

import hashlib
import json
import tomllib
from pathlib import Path

from pkm_gym.core.files import whole_file
from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.cli.runs import file_name, run_folder
from pkm_gym.studies.cli.words import with_products, words_of

TASK = "task.toml"
INDEX = "index.md"
LONGEST = 60  # letters of a folder's name, before its digest


def differences(problem: DesignProblem) -> dict[str, str]:
    """Return what is asked of a problem that isn't by default: task, options, space, objectives."""
    words = {k: x for k, x in words_of(problem).items() if k not in problem.declared.reporting}
    usual = {v.name: v for v in problem.all_variables}
    words |= {f"fix.{name}": repr(x) for name, x in problem.space.unusual().items()}
    for variable in problem.variables:
        own = usual[variable.name]
        if not own.searched:
            words[f"free.{variable.name}"] = "yes"
        if (variable.low, variable.high) != (own.low, own.high):
            words[f"range.{variable.name}"] = f"{variable.low!r}:{variable.high!r}"
    names = [objective.name for objective in problem.objectives]
    if names != [problem.declared.objectives[0].name]:
        words["objective"] = ",".join(names)
    return words


def task_folder(problem: DesignProblem) -> Path:
    """Return the folder of what is found for a problem as it is asked: runs/NAME by default.

    Whatever else is asked has a folder of its own below, with a file that says what, and a line in
    runs/NAME/index.md.

    Raises:
        OSError: where it can't be made.
    """
    words, folder = with_products(problem, differences(problem)), run_folder(problem.name)
    if not words:
        return folder
    text = "_".join(f"{key.removeprefix('task.')}={_short(x)}" for key, x in words.items())
    digest = hashlib.sha256(json.dumps(words, sort_keys=True).encode()).hexdigest()[:6]
    own = folder / f"{file_name(text)[:LONGEST]}-{digest}"
    if not (own / TASK).exists():
        _enter(own, words)
    return own


def _short(text: str) -> str:
    """Return a number with the digits that a name needs."""
    try:
        return f"{float(text):.4g}"
    except ValueError:
        return text


def _enter(own: Path, words: dict[str, str]) -> None:
    with whole_file(own / TASK) as part:
        part.write_text(
            "\n".join(f"{json.dumps(k)} = {json.dumps(x)}" for k, x in words.items()) + "\n",
            encoding="utf-8",
        )
    lines = ["| folder | what is asked (SI) |", "|---|---|"]
    known = sorted(own.parent.glob(f"*/{TASK}"))
    lines += [f"| {path.parent.name} | {_listed(path)} |" for path in known]
    with whole_file(own.parent / INDEX) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _listed(path: Path) -> str:
    """Return what a folder's file says; a damaged one must not stop what is found for another."""
    try:
        asked = tomllib.loads(path.read_text(encoding="utf-8"))
    except ValueError:
        return f"{TASK} is damaged"
    return ", ".join(f"{key} = {x}" for key, x in asked.items())
