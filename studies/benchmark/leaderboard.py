"""The leaderboard: a csv file with one line for each method, split and version."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from pkm_gym.benchmark.standings import Entry
from pkm_gym.core.files import whole_file
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
    with path.open(newline="", encoding="utf-8") as file:
        reader = csv.DictReader(file)
        if list(reader.fieldnames or ()) != columns:
            raise ValueError(
                f"{str(path)!r} is no leaderboard: its first line must be {','.join(columns)}"
            )
        return list(reader)
