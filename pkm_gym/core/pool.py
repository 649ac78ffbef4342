"""Pool: tasks solved beforehand, each with a start and its optimum, in one npz file."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from pkm_gym.core.files import whole_file
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions
from pkm_gym.core.types import BoolArray, FloatArray

ARRAYS = (
    "tasks", "starts", "designs", "optima", "active", "solvable", "constraints", "values",
    "certified",
)  # fmt: skip
TEXTS = ("hash", "command")

# Within this share of it an optimum must be what an older file says, for the file to be renewed.
RENEWED = 1e-9


@dataclass(frozen=True)
class Pool:
    """Solved tasks of one problem.

    Attributes:
        tasks: array (n, m), packed.
        starts: array (n, d), where a session on the task may start.
        designs: array (n, d), the optimum; the least violating design found if unsolvable.
        optima: array (n,), the first objective there; NaN if unsolvable.
        active: array (n, c), the constraints that hold the optimum back.
        solvable: array (n,), whether the task has a feasible design.
        constraints: array (n, c) of the designs.
        values: array (n,), the first objective of the designs, feasible or not.
        certified: array (n,), whether searches agree on the optimum; otherwise the best known.
        hash: ``hash()`` of the problem.
        command: what wrote the pool.
    """

    tasks: FloatArray
    starts: FloatArray
    designs: FloatArray
    optima: FloatArray
    active: BoolArray
    solvable: BoolArray
    constraints: FloatArray
    values: FloatArray
    certified: BoolArray
    hash: str
    command: str

    def __len__(self) -> int:
        """Return the number of tasks, the unsolvable ones included."""
        return len(self.tasks)

    def first(self, n: int) -> Self:
        """Return the pool of the first n tasks."""
        return self.only(slice(n))

    def only(self, rows: npt.NDArray[np.intp] | slice) -> Self:
        """Return the pool of some of the tasks."""
        return replace(self, **{name: getattr(self, name)[rows] for name in ARRAYS})

    @classmethod
    def from_solutions(
        cls, solutions: Solutions, starts: FloatArray, problem: DesignProblem, command: str
    ) -> Self:
        """Return the pool of ``solve_tasks``'s solutions with starts (n, d)."""
        return cls(
            tasks=solutions.tasks,
            starts=np.asarray(starts, dtype=float),
            designs=solutions.designs,
            optima=solutions.optima,
            active=solutions.active,
            solvable=solutions.solvable,
            constraints=solutions.constraints,
            values=solutions.values,
            certified=solutions.certified,
            hash=problem.hash(),
            command=command,
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the pool; the file appears whole or not at all."""
        write_npz(path, {name: getattr(self, name) for name in ARRAYS + TEXTS})

    @classmethod
    def load(cls, path: str | os.PathLike[str], problem: DesignProblem) -> Self:
        """Read a pool of this problem.

        Raises:
            ValueError: in one sentence naming the file and what was expected, if it is missing,
                unreadable, damaged, no pool at all or another problem's.
        """
        content = _read(Path(path), problem)
        complaint = next(_complaints(content, problem), None)
        if complaint:
            raise ValueError(f"{str(path)!r} {complaint}: {_wanted(problem)}")
        values: dict[str, Any] = {name: content[name] for name in ARRAYS}
        return cls(**values, hash=problem.hash(), command=str(content["command"]))


def renewed(path: str | os.PathLike[str], problem: DesignProblem, *, certified: bool) -> Pool:
    """Return a pool of an older version of a file or of a problem, if its optima still hold.

    Args:
        path: the file.
        problem: what it is a pool of.
        certified: whether an older file that doesn't say so held certified optima only.

    Raises:
        ValueError: in one sentence, for a file that is no pool of such a problem, or an optimum
            that the problem evaluates to something else.
    """
    content = _read(Path(path), problem)
    missing = [name for name in (*ARRAYS[:6], "command") if name not in content]
    if missing:
        raise ValueError(f"{str(path)!r} lacks {', '.join(missing)}: {_wanted(problem)}")
    evaluation = problem.evaluate(content["designs"], content["tasks"])
    values, solvable = evaluation.objectives[:, 0], content["solvable"]
    kept = np.isclose(values, content["optima"], rtol=RENEWED, atol=0.0) & evaluation.feasible
    if (solvable & ~kept).any():
        at = int(np.flatnonzero(solvable & ~kept)[0])
        raise ValueError(
            f"{str(path)!r} says that the optimum of its task {at} is {content['optima'][at]!r}, "
            f"and {problem.name} evaluates it to {values[at]!r}: solve its tasks again"
        )
    return Pool(
        **{name: content[name] for name in ARRAYS[:6]},
        constraints=evaluation.constraints,
        values=values,
        certified=content.get("certified", np.full(len(values), certified)),
        hash=problem.hash(),
        command=str(content["command"]),
    )


def write_npz(path: str | os.PathLike[str], content: Mapping[str, Any]) -> None:
    """Write arrays to an npz file that appears whole or not at all."""
    with whole_file(Path(path)) as part, part.open("wb") as file:
        np.savez_compressed(file, **content)
        file.flush()
        os.fsync(file.fileno())


def _read(path: Path, problem: DesignProblem) -> dict[str, np.ndarray]:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}
    except FileNotFoundError:
        reason = "does not exist"
    except OSError as error:
        reason = f"cannot be read ({error.strerror or error})"
    except Exception:  # zip, zlib, npy headers and pickles: each raises its own
        reason = "is damaged or no npz file"
    raise ValueError(f"{str(path)!r} {reason}: {_wanted(problem)}")


def _wanted(problem: DesignProblem) -> str:
    return (
        f"expected an npz file with {', '.join(ARRAYS + TEXTS)} of {problem.name} "
        f"(hash {problem.hash()[:12]}), as Pool.save writes it; "
        "`pkm-gym restamp` renews older files"
    )


def _complaints(content: dict[str, np.ndarray], problem: DesignProblem) -> Iterator[str]:
    """Say what is wrong with the content of a file; each check relies on those before it."""
    missing = [name for name in ARRAYS + TEXTS if name not in content]
    if missing:
        yield f"lacks {', '.join(missing)}"
    if str(content["hash"]) != problem.hash():
        yield f"belongs to another problem (hash {str(content['hash'])[:12]})"
    n = content["tasks"].shape[:1]
    m, d, c = len(problem.task_variables), len(problem.low), len(problem.constraint_names)
    shapes = ((*n, m), (*n, d), (*n, d), n, (*n, c), n, (*n, c), n, n)
    kinds = (*[float] * 4, bool, bool, float, float, bool)
    for name, kind, shape in zip(ARRAYS, kinds, shapes, strict=True):
        array = content[name]
        if array.dtype != kind or array.shape != shape:
            yield f"has {name} as {array.dtype} of shape {array.shape}, not of shape {shape}"
    for name in ("tasks", "starts", "designs"):
        if not np.isfinite(content[name]).all():
            yield f"has {name} that are not finite"
    if not np.isfinite(content["optima"][content["solvable"]]).all():
        yield "has solvable tasks without an optimum"
    try:
        problem.task_type.check_rows(content["tasks"])
    except ValueError as error:
        yield f"has an illegal task ({error})"
