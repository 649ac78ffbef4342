"""Pool: tasks solved beforehand, each with a start and its optimum, in one npz file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from pkm_gym.core.files import whole_file
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import check_arrays, read_npz
from pkm_gym.core.solve import Solutions
from pkm_gym.core.types import BoolArray, FloatArray

ARRAYS = (
    "tasks", "starts", "designs", "optima", "active", "solvable", "constraints", "values",
    "certified",
)  # fmt: skip
TEXTS = ("hash", "command")
OLDEST = ARRAYS[:6]  # what any file has

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
        return self.only(np.arange(len(self))[:n])

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

    def solutions(self, problem: DesignProblem, evaluations: int, seconds: float) -> Solutions:
        """Return the solutions that it was made of, and what they are said to have cost."""
        kept = {name: getattr(self, name) for name in ARRAYS if name != "starts"}
        log_merit = problem.evaluate(self.designs, self.tasks).log_merit
        return Solutions(**kept, log_merit=log_merit, evaluations=evaluations, seconds=seconds)

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
        content = _read(Path(path), problem, ARRAYS + TEXTS)
        values: dict[str, Any] = {name: content[name] for name in ARRAYS}
        return cls(**values, hash=problem.hash(), command=str(content["command"]))

    def check(self, problem: DesignProblem) -> None:
        """Refuse a pool of another problem, or one that doesn't fit together.

        Raises:
            ValueError: in one sentence.
        """
        try:
            content = {name: np.asarray(getattr(self, name)) for name in ARRAYS + TEXTS}
            _check(content, problem, ARRAYS + TEXTS)
        except ValueError as error:
            raise ValueError(f"the pool can't be used: {error}") from None

    def only(self, rows: npt.NDArray[Any]) -> Self:
        """Return the pool of some tasks: of a mask (n,), or of their numbers."""
        return replace(self, **{name: getattr(self, name)[rows] for name in ARRAYS})


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
    content = _read(Path(path), problem, (*OLDEST, "command"), ("certified",))
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
        **{name: content[name] for name in OLDEST},
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


def _read(
    path: Path, problem: DesignProblem, needed: tuple[str, ...], welcome: tuple[str, ...] = ()
) -> dict[str, np.ndarray]:
    """Return the arrays of a file, those checked that are needed, or welcome and there."""
    content = read_npz(path, _wanted(problem))
    try:
        _check(content, problem, (*needed, *(name for name in welcome if name in content)))
    except ValueError as error:
        raise ValueError(f"{str(path)!r} is no pool: {error}; {_wanted(problem)}") from None
    return content


def _wanted(problem: DesignProblem) -> str:
    return (
        f"expected an npz file with {', '.join(ARRAYS + TEXTS)} of {problem.name} "
        f"(hash {problem.hash()[:12]}), as Pool.save writes it; "
        "`pkm-gym restamp` renews older files"
    )


def _check(content: dict[str, np.ndarray], problem: DesignProblem, needed: tuple[str, ...]) -> None:
    """Refuse what a file needs where something is wrong with it.

    Raises:
        ValueError: in one sentence.
    """
    m, d, c = len(problem.task_variables), len(problem.low), len(problem.constraint_names)
    sizes = {"tasks": (m,), "starts": (d,), "designs": (d,), "active": (c,), "constraints": (c,)}
    kinds = dict.fromkeys(("active", "solvable", "certified"), "b")
    wanted = {name: (kinds.get(name, "f8"), ("n", *sizes.get(name, ()))) for name in ARRAYS}
    wanted |= dict.fromkeys(TEXTS, ("U", ()))
    if missing := [name for name in needed if name not in content]:
        raise ValueError(f"it lacks {', '.join(missing)}")
    if "hash" in needed and str(content["hash"]) != problem.hash():
        raise ValueError(f"it belongs to another problem (hash {str(content['hash'])[:12]})")
    check_arrays(content, {name: wanted[name] for name in needed})
    for name in {"tasks", "starts", "designs", "constraints"}.intersection(needed):
        if not np.isfinite(content[name]).all():
            raise ValueError(f"it has {name} that are not finite")
    for name in {"optima", "values"}.intersection(needed):
        if not np.isfinite(content[name][content["solvable"]]).all():
            raise ValueError(f"it has solvable tasks without an optimum ({name})")
    try:
        problem.task_type.check_rows(content["tasks"])
    except ValueError as error:
        raise ValueError(f"it has an illegal task ({error})") from None
