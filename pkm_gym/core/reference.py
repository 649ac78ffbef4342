"""Reference: every number a paper prints, its verdict, and our verified value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import cache
from math import isclose
from typing import TYPE_CHECKING, Any, Self, TypeVar

from pkm_gym.core.calibration import package_file
from pkm_gym.core.names import unknown
from pkm_gym.core.reading import about, read_toml, shaped

if TYPE_CHECKING:
    from pkm_gym.core.problem import DesignProblem

T = TypeVar("T")

CITED = ("authors", "year", "title", "journal", "volume", "pages")
SAME = 1e-6  # share within which two values of an optimum are the same: 8 digits are recorded
PRINTED = {"printed": None}  # what the entry of a value needn't say


@dataclass(frozen=True)
class Value:
    """One printed number: where it stands, what we get, and how the two compare.

    ``kind`` says what ``ours`` is: an "index" or a "dimension" of the printed design, or a
    coordinate of the "optimum". ``printed`` is None where the paper gives no number.
    """

    name: str
    kind: str
    symbol: str
    unit: str
    where: str
    printed: float | None
    ours: float
    tolerance: float
    verdict: str
    note: str = ""


@dataclass(frozen=True)
class Optimum:
    """A verified optimum, on the feasible side of its constraints."""

    name: str
    objective: str
    value: float
    tolerance: float
    design: Mapping[str, float]
    active: tuple[str, ...]
    note: str = ""
    fixed: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Claim:
    """What the paper says in words, what the model says, and the verdict."""

    claim: str
    ours: str
    verdict: str


@dataclass(frozen=True)
class Reference:
    """The content of a mechanism's paper.toml; ``table`` reads its tables of its own."""

    paper: Mapping[str, str]
    design: Mapping[str, float]
    values: Mapping[str, Value]
    optima: Mapping[str, Optimum]
    claims: tuple[Claim, ...]
    data: Mapping[str, Any]
    path: str = ""

    @property
    def citation(self) -> str:
        """How the paper is cited, "" without one."""
        if not self.paper:
            return ""
        paper = self.paper
        return (
            f"{paper['authors']} ({paper['year']}). {paper['title']}. {paper['journal']} "
            f"{paper['volume']}, {paper['pages']}."
        )

    @classmethod
    def load(cls, package: str, file: str = "paper.toml") -> Self:
        """Read paper.toml of a mechanism's package, such as ``pkm_gym.mechanisms.diamond``.

        A package with more than one problem has a file for each. Where there is none, nothing is
        printed: the reference is empty, and false.

        Raises:
            ValueError: in one sentence that names the file, for a damaged one.
        """
        return cls._read(package, file)

    @classmethod
    @cache
    def _read(cls, package: str, file: str) -> Self:
        source = package_file(package, file)
        if source is None:
            return cls({}, {}, {}, {}, (), {}, file)
        table = read_toml(source, "reference")
        own = {item.name: table.pop(item.name) for item in fields(cls) if item.name in table}
        for name in ("values", "optima"):
            own[name] = _named(own.get(name), PRINTED if name == "values" else {})
        with about(source, "reference"):
            read = shaped(cls, {"claims": [], **own, "data": table, "path": str(source)})
            if missing := [name for name in CITED if read.paper and name not in read.paper]:
                raise ValueError(f"it lacks {', '.join(f'paper.{name}' for name in missing)}")
        return read

    def __bool__(self) -> bool:
        """Whether there is a paper."""
        return bool(self.paper)

    def __getitem__(self, name: str) -> Value:
        """Return the printed number of that name.

        Raises:
            ValueError: with the closest match.
        """
        if name not in self.values:
            raise ValueError(f"{self.path}: {unknown('printed value', name, self.values)}")
        return self.values[name]

    def optimum(self, name: str) -> Optimum:
        """Return the verified optimum of that name.

        Raises:
            ValueError: with the closest match.
        """
        if name not in self.optima:
            raise ValueError(f"{self.path}: {unknown('verified optimum', name, self.optima)}")
        return self.optima[name]

    def table(self, name: str, kind: type[T]) -> T:
        """Return a table of the mechanism's own, as a type says: see ``shaped``.

        Args:
            name: its own, with dots where it stands in another.
            kind: the type.

        Raises:
            ValueError: in one sentence that names the file, where it is missing or another.
        """
        held: Any = self.data
        with about(self.path, "reference"):
            for part in name.split("."):
                if not isinstance(held, Mapping) or part not in held:
                    raise ValueError(f"it lacks the table [{name}]")
                held = held[part]
            return shaped(kind, held, name)


def disagreement(problem: DesignProblem, optimum: Optimum) -> str:
    """Return a sentence where a problem's model doesn't give a verified optimum, or nothing.

    Args:
        problem: whose optimum it is, with the objective and what it fixes.
        optimum: of the problem's reference.

    Raises:
        ValueError: in one sentence that names the file, for a design that isn't the problem's.
    """
    path = problem.reference.path
    with about(path, "reference"):
        design = problem.design(optimum.design)
    evaluation = problem.evaluate(design[None])
    given = float(evaluation.objectives[0, 0])
    said = f"{path} says that {optimum.objective} is {optimum.value!r} at its optimum"
    if not isclose(given, optimum.value, rel_tol=SAME):
        return f"{said} {optimum.name!r}, the model gives {given:.9g}"
    if not evaluation.feasible[0]:
        words = "; ".join(evaluation.explain(0).splitlines())
        return f"{said} {optimum.name!r}, which breaks a limit: {words}"
    return ""


def _named(table: Any, usual: Mapping[str, Any]) -> Any:
    """Return a table's entries with their names, and what they needn't say, in them."""
    if not isinstance(table, dict):
        return table
    return {
        name: {**usual, **entry, "name": name} if isinstance(entry, dict) else entry
        for name, entry in table.items()
    }
