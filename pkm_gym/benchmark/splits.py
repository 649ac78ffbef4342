"""Splits: the benchmark's tasks with their optima, as files: ours are shipped.

``train`` is the pool that a *transfer* method may learn from, ``val`` is for tuning, ``test`` for
the published tables, ``ood`` asks for more than the training range holds. They are drawn from
``SeedSequence([problem.version, k])``, k = 0, 1, 2, 3, and made by ``pkm-gym splits NAME``, as many
tasks of each as the problem declares. One that declares none is no benchmark.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pkm_gym.core.declaration import SPLITS
from pkm_gym.core.files import read_bytes, whole_file
from pkm_gym.core.names import check_known
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import about, read_npz, read_toml, shaped
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import called, family_problem, lasting

# How far a task of ``ood`` may lie outside the training range, a share of the range's width.
BEYOND = 0.25

FOLDER = Path(__file__).parent / "data"
MANIFEST = "splits.toml"


class Drawn(NamedTuple):
    """The tasks of a split before they are solved."""

    tasks: FloatArray  # (n, m), packed
    starts: FloatArray  # (n, d)


@dataclass(frozen=True)
class Entry:
    """What the manifest says of a split.

    Attributes:
        sha256: of the file.
        evaluations: how many designs were evaluated to certify its optima.
        seconds: processor time of that.
    """

    sha256: str
    evaluations: int
    seconds: float


# The method that is being imported, prepared or run: it loads no split by itself.
_closed_to: list[str] = []


@contextmanager
def closed_to(method: str) -> Iterator[None]:
    """Refuse to load splits meanwhile: what a method may know of other tasks is handed to it."""
    _closed_to.append(method)
    try:
        yield
    finally:
        _closed_to.pop()


def draw(problem: DesignProblem, split: str) -> Drawn:
    """Draw the tasks (n, m) and starts (n, d) of a split: the same numbers every time.

    Raises:
        ValueError: for an unknown split, or a problem without a Family or splits.
    """
    check_split(problem, split)
    k, n = list(SPLITS).index(split), problem.declared.splits[split]
    sequence = np.random.SeedSequence([problem.declared.version, k])
    for_tasks, for_starts = map(np.random.default_rng, sequence.spawn(2))
    outside = split == "ood"
    tasks = _beyond(problem, n, for_tasks) if outside else problem.draw_tasks(n, for_tasks)
    span = problem.high - problem.low
    return Drawn(tasks, problem.low + span * for_starts.random((n, len(span))))


def _beyond(problem: DesignProblem, n: int, generator: np.random.Generator) -> FloatArray:
    """Draw n legal tasks (n, m), each with at least one field outside the training range."""
    low, high, legal_low, legal_high = np.array(
        [(v.low, v.high, v.legal_low, v.legal_high) for v in problem.task_variables]
    ).T
    margin = BEYOND * (high - low)
    widest_low = np.maximum(low - margin, legal_low)
    widest_high = np.minimum(high + margin, legal_high)
    rows = np.empty((0, len(low)))
    while len(rows) < n:
        drawn = widest_low + (widest_high - widest_low) * generator.random((n, len(low)))
        outside = ((drawn < low) | (drawn > high)).any(axis=1)
        rows = np.concatenate([rows, drawn[outside]])
    fields = np.array([variable.drawn for variable in problem.task_variables])
    return np.where(fields, rows[:n], problem.pack(None))


def check_splits(problem: DesignProblem) -> None:
    """Refuse a problem that draws no tasks, or declares no splits of them.

    Raises:
        ValueError: in one sentence.
    """
    if not any(variable.drawn for variable in problem.task_variables):
        raise ValueError(f"{problem.name} has no Family: it draws no tasks to be measured on")
    if not problem.declared.splits:
        raise ValueError(f"{problem.name} declares no splits: no methods are measured on it")


def check_split(problem: DesignProblem, split: str) -> None:
    """Refuse an unknown split, or a problem without any.

    Raises:
        ValueError: in one sentence.
    """
    check_splits(problem)
    check_known("split", [split], problem.declared.splits)


def default_folder(problem: DesignProblem) -> Path:
    """Return where a problem's splits are: ours in the package, others' under runs/."""
    own = lasting(problem) == problem.name
    return FOLDER if own else Path("runs") / problem.name / "splits"


def split_path(name: str, split: str, folder: Path | None = None) -> Path:
    """Return the file of a split of the problem of that name, by default a shipped one."""
    return (folder or FOLDER) / f"{name}_{split}.npz"


def split_file(problem: DesignProblem, split: str, folder: Path | None = None) -> Path:
    """Return the file of a problem's split, in its default folder if none is given."""
    return split_path(problem.name, split, folder or default_folder(problem))


def load_split(name: str, split: str, folder: Path | None = None) -> tuple[DesignProblem, Pool]:
    """Return a problem, that of its Family, with one of its splits.

    Args:
        name: of the problem, or "module:Class".
        split: one that the problem declares.
        folder: where its files are; for ours the package, for others' runs/NAME/splits.

    Raises:
        ValueError: in one sentence, for an unknown name, or a file that is missing, edited or of
            another version of the problem; and for a method that is being run.
    """
    if _closed_to:
        raise ValueError(
            f"{_closed_to[-1]} loads the split {split} itself: what a method may know of other "
            "tasks is handed to its prepare, in the track transfer"
        )
    problem = family_problem(name)
    check_split(problem, split)
    path = split_file(problem, split, folder)
    make = f"`pkm-gym splits {called(problem)}{f' -o {folder}' if folder else ''}`"
    if not path.exists():
        raise ValueError(f"{problem.name} has no split {split} yet: make it with {make}")
    entry, actual = manifest(path.parent).get(path.name), sha256(path)
    if entry is None or entry.sha256 != actual:
        wanted = entry.sha256[:12] if entry else "none"
        raise ValueError(
            f"{str(path)!r} was changed (sha256 {actual[:12]}, expected {wanted}): "
            f"restore it, or make it again with {make}"
        )
    return problem, Pool.load(path, problem)


def count_tasks(path: Path) -> int:
    """Return how many tasks a split's file has, 0 where there is no file."""
    if not path.exists():
        return 0
    content = read_npz(path, "expected a split's file")
    if content.get("optima", np.array(0)).ndim != 1:
        raise ValueError(f"{str(path)!r} lacks optima: expected a split's file")
    return len(content["optima"])


def manifest(folder: Path = FOLDER) -> dict[str, Entry]:
    """Return what is known of a folder's files, by name.

    Raises:
        ValueError: in one sentence that names the manifest, for a damaged one.
    """
    path = folder / MANIFEST
    if not path.exists():
        return {}
    content = read_toml(path, "manifest of splits")
    with about(path, "manifest of splits"):
        return shaped(dict[str, Entry], content)


def write_manifest(entries: dict[str, Entry], folder: Path = FOLDER) -> None:
    """Write the manifest; the file appears whole or not at all."""
    lines = ["# Written by `pkm-gym splits`: what the split files must be, and what they cost."]
    for name, entry in sorted(entries.items()):
        lines += [
            f'\n["{name}"]',
            f'sha256 = "{entry.sha256}"',
            f"evaluations = {entry.evaluations}",
            f"seconds = {entry.seconds:.1f}",
        ]
    with whole_file(folder / MANIFEST) as part:
        part.write_text("\n".join(lines) + "\n", encoding="utf-8")


def sha256(path: Path) -> str:
    """Return the sha256 of a file."""
    return hashlib.sha256(read_bytes(path)).hexdigest()
