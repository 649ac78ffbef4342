"""The leaderboard: a csv file with one line for each method, split and version."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from math import isfinite
from pathlib import Path
from typing import Any

from pkm_gym.benchmark.standings import Entry
from pkm_gym.core.files import whole_file
from pkm_gym.core.reading import about, read_text
from pkm_gym.studies.benchmark.tables import records

KEY = ("split", "start", "knowledge", "method", "pool", "noise", "delay", "version")


def enter(entries: Sequence[Entry], path: Path) -> None:
    """Put entries into a leaderboard; a line of the same method, split and version is replaced.

    Raises:
        ValueError: if the file is no leaderboard.
    """
    new = [{key: str(value) for key, value in record.items()} for record in records(entries)]
    lines = {tuple(line[key] for key in KEY): line for line in [*_read(path, list(new[0])), *new]}
    ranked = sorted(
        lines.values(),
        key=lambda line: (line["split"], line["start"], line["knowledge"], -float(line["score"])),
    )
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(new[0]))
        writer.writeheader()
        writer.writerows(ranked)


def _read(path: Path, columns: list[str]) -> list[dict[str, str]]:
    if not path.exists():
        return []
    text = read_text(path, "leaderboard")
    with about(path, "leaderboard"):
        reader = csv.DictReader(StringIO(text, newline=""), strict=True)
        try:
            lines = list(reader)
        except csv.Error as error:
            raise ValueError(str(error)) from None
        if list(reader.fieldnames or ()) != columns:
            raise ValueError(f"its first line must be {','.join(columns)}")
        for number, line in enumerate(lines, 2):
            _check(line, f"line {number}")
    return lines


def _check(line: dict[str, Any], place: str) -> None:
    """Refuse a line that lacks a column or has one too many, or a score that is no number."""
    if None in line or None in line.values():
        raise ValueError(f"its {place} has another number of columns than the first")
    try:
        finite = isfinite(float(line["score"]))
    except ValueError:
        finite = False
    if not finite:
        raise ValueError(f"the score in its {place} is {line['score']!r}, no finite number")
