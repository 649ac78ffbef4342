"""Reference: every number a paper prints, its verdict, and our verified value."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Self

from pkm_gym.core.calibration import package_file
from pkm_gym.core.names import unknown


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
    """The content of a mechanism's paper.toml; ``data`` holds its tables of its own."""

    paper: Mapping[str, str]
    design: Mapping[str, float]
    values: Mapping[str, Value]
    optima: Mapping[str, Optimum]
    claims: tuple[Claim, ...]
    data: Mapping[str, Any]

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
        """
        return cls._read(package, file)

    @classmethod
    @cache
    def _read(cls, package: str, file: str) -> Self:
        source = package_file(package, file)
        if source is None:
            return cls({}, {}, {}, {}, (), {})
        table = tomllib.loads(source.read_text(encoding="utf-8"))
        return cls(
            paper=table.pop("paper"),
            design=table.pop("design"),
            values={
                name: Value(name=name, **{"printed": None, **entry})
                for name, entry in table.pop("values").items()
            },
            optima={
                name: Optimum(name=name, **{**entry, "active": tuple(entry["active"])})
                for name, entry in table.pop("optima").items()
            },
            claims=tuple(Claim(**entry) for entry in table.pop("claims", [])),
            data=table,
        )

    def __bool__(self) -> bool:
        """Whether there is a paper."""
        return bool(self.paper)

    def __getitem__(self, name: str) -> Value:
        """Return the printed number of that name.

        Raises:
            KeyError: with the closest match.
        """
        if name not in self.values:
            raise KeyError(unknown("printed value", name, self.values))
        return self.values[name]
