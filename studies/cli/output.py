"""What a verb hands to programs: JSON alone on stdout, a CSV file, all digits of each number."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from pkm_gym.core.files import check_regular, whole_file
from pkm_gym.studies.cli.terminal import console

ROWS, UNITS = "rows", "units"
ENDING = ".csv"


@dataclass(frozen=True)
class Output:
    """Where the result of a verb goes.

    Attributes:
        as_json: whether JSON stands on stdout, and what is for people nowhere.
        table: the CSV file, if one was asked for.
    """

    as_json: bool = False
    table: Path | None = None

    def __post_init__(self) -> None:
        """Refuse a table of another name before anything is done.

        Raises:
            ValueError: in one sentence.
            OSError: where there is a folder, a pipe or a device of that name.
        """
        if self.table is not None and self.table.suffix.lower() != ENDING:
            raise ValueError(f"can't write {str(self.table)!r}: its name must end in {ENDING}")
        if self.table is not None:
            check_regular(self.table)

    @property
    def wanted(self) -> bool:
        """Whether anything is handed out."""
        return self.as_json or self.table is not None

    @cached_property
    def screen(self) -> Console:
        """What people read; silent where programs do."""
        return Console(quiet=True) if self.as_json else console()

    @cached_property
    def bars(self) -> Console:
        """Where progress is shown: never on a stdout that a program reads."""
        return Console(stderr=True, highlight=False, markup=False) if self.as_json else self.screen

    def give(self, content: Mapping[str, Any]) -> None:
        """Hand out a result, SI throughout: as JSON, and its "rows", or all of it, as a table.

        Args:
            content: what JSON can say, numpy's scalars and arrays, and not finite numbers, which
                become null; its "units" has the form of a row, and says the unit of its numbers.

        Raises:
            OSError: where the table can't be written.
        """
        plain = plainly(content)
        if self.table is not None:
            own = {k: x for k, x in plain.items() if k not in (ROWS, UNITS)}
            write_table(self.table, plain.get(ROWS, [own]), plain.get(UNITS, {}))
            self.screen.print(f"table: {self.table}", soft_wrap=True)
        if self.as_json:
            print(json.dumps(plain, indent=2))


def plainly(value: Any) -> Any:
    """Return a value as JSON holds it, null for a number that is not finite."""
    if isinstance(value, Mapping):
        return {str(key): plainly(x) for key, x in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plainly(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plainly(x) for x in value]
    if isinstance(value, float):
        return value if isfinite(value) else None
    return str(value) if isinstance(value, Path) else value


def write_table(path: Path, rows: Sequence[Mapping[str, Any]], units: Mapping[str, Any]) -> None:
    """Write rows to a CSV file, a column for each name in any of them, with its unit in brackets.

    A name within another one stands behind a dot: "design.l1 [m]". Nothing stands for null, JSON
    for a list, all digits for a number.
    """
    flat, known = [dict(flattened(row)) for row in rows], dict(flattened(units))
    names = list(dict.fromkeys(name for row in flat for name in row))
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(f"{name} [{known[name]}]" if known.get(name) else name for name in names)
        writer.writerows([_cell(row.get(name)) for name in names] for row in flat)


def flattened(row: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of a row by their dotted names."""
    for key, value in row.items():
        if isinstance(value, Mapping):
            yield from flattened(value, f"{before}{key}.")
        else:
            yield f"{before}{key}", value


def _cell(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, bool | list) else value
