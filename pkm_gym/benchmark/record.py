"""EvaluationLog: everything a run evaluated, in one npz file. Scores come from it alone."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import astuple, dataclass, fields, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from pkm_gym.core.declaration import SPLITS
from pkm_gym.core.names import unknown
from pkm_gym.core.pool import write_npz
from pkm_gym.core.reading import about, check_arrays, read_npz
from pkm_gym.core.types import FloatArray


@dataclass(frozen=True)
class Setting:
    """How a method was run: two logs of one setting are parts of the same run.

    Attributes:
        problem: name of the design problem, or "module:Class" of one from outside.
        split: name of the split.
        hash: ``hash()`` of the problem.
        sha256: of the split's file.
        method: its name.
        source: sha256 of the files that define it.
        start: its track, "given" or "free".
        knowledge: its track, "transfer" or "scratch".
        seed: of its random numbers.
        budget: evaluations allowed on a task.
        pool: how many training tasks it knew, 0 in the *scratch* track.
        noise: standard deviation of the relative error in what the method was told.
        delay: seconds that each evaluation took longer.
        folder: of the splits, empty for the problem's own.
    """

    problem: str
    split: str
    hash: str
    sha256: str
    method: str
    source: str
    start: str
    knowledge: str
    seed: int
    budget: int
    pool: int
    noise: float = 0.0
    delay: float = 0.0
    folder: str = ""


@dataclass(frozen=True)
class Cost:
    """Evaluations and processor time (s, NaN if unknown) spent before the first task."""

    evaluations: int = 0
    seconds: float = 0.0


@dataclass(frozen=True)
class EvaluationLog:
    """What a method evaluated on tasks of a split, in this order.

    Attributes:
        setting: how it was run.
        rows: array (n,), which tasks of the split.
        designs: array (n, budget, d), NaN after the last evaluation.
        seconds: array (n,), wall time on each task.
        learned: array (n,), designs evaluated on training tasks in each task's session.
        outside: array (n,), designs evaluated past the door on each task, or while its method
            prepared. A log with any isn't ranked.
        version: of pkm_gym.
        command: what wrote it.
        training: what the method cost before the first task, besides the pool, as it states.
        preparation: what it evaluated on training tasks before the first one, and its time.
    """

    setting: Setting
    rows: npt.NDArray[np.int64]
    designs: FloatArray
    seconds: FloatArray
    learned: npt.NDArray[np.int64]
    outside: npt.NDArray[np.int64]
    version: str
    command: str
    training: Cost = Cost()
    preparation: Cost = Cost()

    def __len__(self) -> int:
        """Return the number of tasks."""
        return len(self.rows)

    @property
    def counts(self) -> npt.NDArray[np.int64]:
        """Array (n,), how many designs were evaluated on each task."""
        return np.isfinite(self.designs).all(axis=2).sum(axis=1)

    def joined(self, other: EvaluationLog) -> EvaluationLog:
        """Return this log with the tasks of another part of the same run."""
        order = np.argsort(np.concatenate([self.rows, other.rows]), kind="stable")
        parts = [self.preparation, other.preparation]  # every process prepares the same
        arrays: dict[str, Any] = {
            name: np.concatenate([getattr(self, name), getattr(other, name)])[order]
            for name in ARRAYS
        }
        return replace(self, **arrays, preparation=max(parts, key=lambda cost: cost.evaluations))

    def only(self, rows: npt.NDArray[np.int64]) -> EvaluationLog:
        """Return the part of these tasks; all of them must be there."""
        at = np.searchsorted(self.rows, rows)
        arrays: dict[str, Any] = {name: getattr(self, name)[at] for name in ARRAYS}
        return replace(self, **arrays)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the log; the file appears whole or not at all."""
        content = {name: getattr(self, name) for name in ARRAYS + TEXTS}
        costs = astuple(self.training) + astuple(self.preparation)
        content |= dict(zip(COSTS, costs, strict=True))
        write_npz(path, content | {name: getattr(self.setting, name) for name in SETTINGS})

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read a log.

        Raises:
            ValueError: in one sentence naming the file, if it is missing, damaged, no log, or one
                that no run writes.
        """
        content = _read(Path(path))
        setting = Setting(**{name: kind(content[name]) for name, kind in SETTINGS.items()})
        with about(path, "log of a run"):
            for wrong in _impossible(setting, content):
                raise ValueError(wrong)
        values: dict[str, Any] = {name: content[name] for name in ARRAYS}
        values |= {name: str(content[name]) for name in TEXTS}
        costs = [content[name] for name in COSTS]
        training, preparation = (
            Cost(int(n), float(s)) for n, s in zip(costs[::2], costs[1::2], strict=True)
        )
        return cls(setting, **values, training=training, preparation=preparation)


ARRAYS = ("rows", "designs", "seconds", "learned", "outside")
TEXTS = ("version", "command")
COSTS = (
    "training_evaluations", "training_seconds", "preparation_evaluations", "preparation_seconds",
)  # fmt: skip
TRACKS = {"start": ("given", "free"), "knowledge": ("transfer", "scratch")}
KINDS = {"str": str, "int": int, "float": float}
SETTINGS: dict[str, Any] = {item.name: KINDS[str(item.type)] for item in fields(Setting)}
DTYPES = {str: "U", int: "iu", float: "iuf"}
WANTED: dict[str, tuple[str, tuple[int | str, ...]]] = {
    "rows": ("iu", ("n",)),
    "designs": ("f", ("n", "budget", "d")),
    "seconds": ("f", ("n",)),
    **dict.fromkeys(TEXTS, ("U", ())),
    **dict.fromkeys(("learned", "outside"), ("iu", ("n",))),
    **dict.fromkeys(COSTS, ("iuf", ())),
    **{name: (DTYPES[kind], ()) for name, kind in SETTINGS.items()},
}


# What older logs don't say: the problem's own splits, and nothing of what is counted since.
_OLDER = {
    "folder": "", "learned": None, "outside": None, "preparation_evaluations": 0,
    "preparation_seconds": 0.0,
}  # fmt: skip


def _read(path: Path) -> dict[str, np.ndarray]:
    wanted = "expected an npz file as EvaluationLog.save writes it"
    content = read_npz(path, wanted)
    nothing = np.zeros(np.shape(content.get("rows", ())), dtype=np.int64)
    for name, said in _OLDER.items():
        content.setdefault(name, nothing if said is None else np.array(said))
    with about(path, "log of a run"):
        check_arrays(content, WANTED)
    return content


def _impossible(setting: Setting, content: dict[str, np.ndarray]) -> Iterator[str]:
    """Yield what no run writes."""
    rows, designs, seconds, *counts = (content[name] for name in ARRAYS)
    if (np.diff(rows, prepend=-1) <= 0).any():
        yield "its rows must number different tasks, in their order"
    if designs.shape[1] != setting.budget:
        yield f"it must hold {setting.budget} designs a task"
    if any((count < 0).any() for count in counts):
        yield "its counts of evaluations must be whole numbers from 0 on"
    evaluated = np.isfinite(designs).all(axis=2)
    if (np.isnan(designs).all(axis=2) == evaluated).any() or np.diff(evaluated * 1).max(initial=0):
        yield "its designs must be finite up to the last that was evaluated, and NaN after it"
    costs = [content[name] for name in COSTS]
    times = np.concatenate([seconds, [setting.delay, setting.noise], costs])
    unstated = int(np.isnan(costs[1]))  # the seconds of a training may be
    if (times < 0.0).any() or np.isfinite(times).sum() + unstated != len(times):
        yield "times, costs and noise must be numbers from 0 on"
    yield from _impossible_track(setting, int(content["training_evaluations"]))


def _impossible_track(setting: Setting, trained: int) -> Iterator[str]:
    """Yield what contradicts the split or the track that is stated."""
    if setting.split not in SPLITS:
        yield unknown("split", setting.split, SPLITS)
    for name, allowed in TRACKS.items():
        if (own := getattr(setting, name)) not in allowed:
            yield f"{name} is {own!r}, it must be {' or '.join(allowed)}"
    if setting.knowledge == "scratch" and (setting.pool or trained):
        yield (
            f"it knew {setting.pool} training tasks and was trained with {trained} evaluations in "
            "the track 'scratch'"
        )
    if setting.knowledge == "transfer" and not (setting.pool or trained):
        yield "in the track 'transfer' it knew no training tasks and had no training"
