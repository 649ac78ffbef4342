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
        version: of pkm_gym.
        command: what wrote it.
        training: what the method cost before the first task, besides the pool.
    """

    setting: Setting
    rows: npt.NDArray[np.int64]
    designs: FloatArray
    seconds: FloatArray
    version: str
    command: str
    training: Cost = Cost()

    def __len__(self) -> int:
        """Return the number of tasks."""
        return len(self.rows)

    @property
    def counts(self) -> npt.NDArray[np.int64]:
        """Array (n,), how many designs were evaluated on each task."""
        return np.isfinite(self.designs).all(axis=2).sum(axis=1)

    def joined(self, other: EvaluationLog) -> EvaluationLog:
        """Return this log with the tasks of another part of the same run."""
        rows = np.concatenate([self.rows, other.rows])
        order = np.argsort(rows, kind="stable")
        return replace(
            self,
            rows=rows[order],
            designs=np.concatenate([self.designs, other.designs])[order],
            seconds=np.concatenate([self.seconds, other.seconds])[order],
        )

    def only(self, rows: npt.NDArray[np.int64]) -> EvaluationLog:
        """Return the part of these tasks; all of them must be there."""
        at = np.searchsorted(self.rows, rows)
        return replace(self, rows=self.rows[at], designs=self.designs[at], seconds=self.seconds[at])

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the log; the file appears whole or not at all."""
        content = {name: getattr(self, name) for name in ARRAYS + TEXTS}
        content |= dict(zip(COST, astuple(self.training), strict=True))
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
        evaluations, seconds = (content[name] for name in COST)
        return cls(setting, **values, training=Cost(int(evaluations), float(seconds)))


ARRAYS = ("rows", "designs", "seconds")
TEXTS = ("version", "command")
COST = ("training_evaluations", "training_seconds")
TRACKS = {"start": ("given", "free"), "knowledge": ("transfer", "scratch")}
KINDS = {"str": str, "int": int, "float": float}
SETTINGS: dict[str, Any] = {item.name: KINDS[str(item.type)] for item in fields(Setting)}
DTYPES = {str: "U", int: "iu", float: "iuf"}
WANTED: dict[str, tuple[str, tuple[int | str, ...]]] = {
    "rows": ("iu", ("n",)),
    "designs": ("f", ("n", "budget", "d")),
    "seconds": ("f", ("n",)),
    **dict.fromkeys(TEXTS, ("U", ())),
    **dict.fromkeys(COST, ("iuf", ())),
    **{name: (DTYPES[kind], ()) for name, kind in SETTINGS.items()},
}


def _read(path: Path) -> dict[str, np.ndarray]:
    wanted = "expected an npz file as EvaluationLog.save writes it"
    content = read_npz(path, wanted)
    content.setdefault("folder", np.array(""))  # of the problem's own splits: older logs say none
    with about(path, "log of a run"):
        check_arrays(content, WANTED)
    return content


def _impossible(setting: Setting, content: dict[str, np.ndarray]) -> Iterator[str]:
    """Yield what no run writes."""
    if setting.split not in SPLITS:
        yield unknown("split", setting.split, SPLITS)
    for name, allowed in TRACKS.items():
        if (own := getattr(setting, name)) not in allowed:
            yield f"{name} is {own!r}, it must be {' or '.join(allowed)}"
    rows, designs, seconds = (content[name] for name in ARRAYS)
    if rows.dtype.kind not in "iu" or rows.ndim != 1 or (np.diff(rows, prepend=-1) <= 0).any():
        yield "its rows must number different tasks, in their order"
    if designs.dtype.kind != "f" or designs.shape[1] != setting.budget:
        yield f"its designs must be numbers, {setting.budget} designs a task"
    evaluated = np.isfinite(designs).all(axis=2)
    if (np.isnan(designs).all(axis=2) == evaluated).any() or np.diff(evaluated * 1).max(initial=0):
        yield "its designs must be finite up to the last that was evaluated, and NaN after it"
    costs = [content[name] for name in COST]
    times = np.concatenate([seconds.ravel(), [setting.delay, setting.noise], costs])
    if (times < 0.0).any() or not np.isfinite(times[:-1]).all():
        yield "times, costs and noise must be numbers from 0 on"
    if (setting.pool > 0) != (setting.knowledge == "transfer"):
        yield f"it knew {setting.pool} training tasks in the track {setting.knowledge!r}"
