"""Tables of the benchmark in the terminal and in a file."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from pkm_gym.benchmark.record import Setting
from pkm_gym.benchmark.scoring import (
    SCORED,
    WITHIN,
    over_seeds,
    quantile,
    share_feasible,
    share_within,
)
from pkm_gym.benchmark.standings import AT, Entry, compare, pays_after, ranked
from pkm_gym.core.files import whole_file
from pkm_gym.mechanisms import problem_type
from pkm_gym.studies.benchmark.scored import stated, statistics
from pkm_gym.studies.cli.terminal import FAINT, section, table

PER_CENT = 100.0
SMALL = 0.01  # per cent: what is below is written with an exponent where there's little room
SHORT = (1, 4, 12, 60, 300)  # evaluations in the Markdown table
AGAINST = (12, 120, 300)  # evaluations of the others in a paired comparison
EQUAL = (1, 2, 4, 8, 12, 16, 24)  # evaluations of both


def show(screen: Console, measured: Sequence[Entry]) -> None:
    """Print the standings of a problem's split: one set of tables for each track.

    What went past the door is named, not ranked.
    """
    setting, entries = measured[0].setting, ranked(measured)
    name = problem_type(setting.problem).name
    screen.print(section(f"{name}, {setting.split}: regret in per cent of the optimum"))
    for entry in measured:
        if entry.outside:
            screen.print(
                f"{entry.name} is not ranked: for a task it evaluated up to {entry.outside:,} "
                "designs outside, that is past session.evaluate and training.evaluate"
            )
    for track in sorted({entry.track for entry in entries}):
        own = [entry for entry in entries if entry.track == track]
        screen.print(section(track))
        screen.print(_scores(own))
        screen.print(_medians(own))
        screen.print(_shares(own))
    for entry in entries:
        if len(entry.beaten):
            screen.print(
                f"{entry.name} is better than the best known, not certified, on tasks "
                f"{', '.join(map(str, entry.beaten))}"
            )
    if any(entry.violation.size for entry in entries):
        screen.print(section("unsolvable tasks: log merit above the least violation known"))
        screen.print(_violations(entries))
    if len(entries) > 1:
        champion = entries[0]
        screen.print(section(f"{champion.name} after {SCORED} evaluations is better on"))
        screen.print(_duels(champion, entries[1:]))
        screen.print("of the tasks (in brackets: at least, at 95 %)", style=FAINT)
        screen.print(section(f"{champion.name} is better after as many evaluations on"))
        screen.print(_equal_duels(champion, entries[1:]))
        screen.print("of the tasks, in per cent; alike on others", style=FAINT)
    if any(entry.cost.evaluations for entry in entries):
        screen.print(section("What was spent besides the evaluations on a task"))
        screen.print(_costs(entries))
        screen.print(
            "An evaluation of these models takes microseconds, and a whole search milliseconds: "
            "knowing other tasks pays where an evaluation is dear (a twin, finite elements, a "
            "prototype), and so evaluations are what is counted.",
            style=FAINT,
        )


def show_failed(screen: Console, failures: Mapping[Setting, str]) -> None:
    """Print which methods failed, and why."""
    lines = table("failed", "reason")
    for setting, reason in failures.items():
        lines.add_row(setting.method, reason.removeprefix(f"{setting.method} "))
    screen.print(section("failed, and not ranked"))
    screen.print(lines)


def _scores(entries: Sequence[Entry]) -> Any:
    lines = table(
        "method", "tasks", "seeds", "score", "95 %", "ms/design",
        numbers=["tasks", "seeds", "score", "95 %", "ms/design"],
    )  # fmt: skip
    for entry in entries:
        score = entry.score
        lines.add_row(
            entry.name,
            str(len(entry.rows)),
            str(entry.seeds),
            f"{score.value:.3f}",
            f"{score.low:.3f} to {score.high:.3f}",
            f"{1e3 * entry.seconds:.2g}",
        )
    return lines


def _medians(entries: Sequence[Entry]) -> Any:
    counts = [k for k in AT if any(entry.has(k) for entry in entries)]
    lines = table("median after", *map(str, counts), numbers=list(map(str, counts)))
    for entry in entries:
        lines.add_row(entry.name, *(brief(entry.median(k)) if entry.has(k) else "" for k in counts))
    return lines


def _shares(entries: Sequence[Entry]) -> Any:
    heads = ("after", "90th pct", *(f"<= {100 * limit:g} %" for limit in WITHIN), "feasible")
    lines = table("share of tasks", *heads, numbers=heads)
    for entry in entries:
        for k in sorted({min(SCORED, entry.setting.budget), entry.setting.budget}):
            figures = [over_seeds(share_within(k, limit), entry.regret) for limit in WITHIN]
            figures.append(over_seeds(share_feasible(k), entry.regret))
            tail = over_seeds(quantile(k, 0.9), entry.regret)
            lines.add_row(
                entry.name, str(k), percent(tail), *(f"{100 * share:.1f} %" for share in figures)
            )
    return lines


def _violations(entries: Sequence[Entry]) -> Any:
    heads = ("tasks", f"median after {SCORED}", "after all")
    lines = table("method", *heads, numbers=heads)
    for entry in entries:
        if entry.violation.size:
            last = entry.setting.budget
            figures = [
                over_seeds(quantile(k, 0.5), entry.violation) for k in (min(SCORED, last), last)
            ]
            number = str(entry.violation.shape[1])
            lines.add_row(entry.name, number, *(f"{figure:.2g}" for figure in figures))
    return lines


def _duels(champion: Entry, others: Sequence[Entry]) -> Any:
    counts = [k for k in AGAINST if any(other.has(k) for other in others)]
    heads = [f"after {k}" for k in counts]
    lines = table("than", *heads, numbers=heads)
    own_k = min(SCORED, champion.setting.budget)
    for other in others:
        duels = [compare(champion, own_k, other, k) if other.has(k) else None for k in counts]
        cells = [
            f"{100 * duel.share:.0f} % (>= {100 * duel.low:.0f} %)" if duel else ""
            for duel in duels
        ]
        lines.add_row(other.name, *cells)
    return lines


def _equal_duels(champion: Entry, others: Sequence[Entry]) -> Any:
    counts = [k for k in EQUAL if champion.has(k)]
    lines = table("than, after", *map(str, counts), numbers=list(map(str, counts)))
    for other in others:
        duels = [compare(champion, k, other, k) if other.has(k) else None for k in counts]
        lines.add_row(other.name, *(f"{100 * duel.share:.0f}" if duel else "" for duel in duels))
    return lines


def _costs(entries: Sequence[Entry]) -> Any:
    heads = ("before the first", "processor s", "for each task", "pays after")
    lines = table("method", *heads, numbers=heads)
    never = "never" if any(e.setting.knowledge == "scratch" for e in entries) else ""
    for entry in entries:
        cost = entry.cost
        if cost.evaluations:
            tasks = pays_after(entry, entries, min(SCORED, entry.setting.budget))
            lines.add_row(
                entry.name,
                f"{cost.evaluations:,}",
                f"{cost.seconds:,.0f}" if np.isfinite(cost.seconds) else "unknown",
                f"{entry.learned:,.0f}",
                never if tasks is None else f"{tasks:,.0f} tasks",
            )
    return lines


def percent(regret: float) -> str:
    """Return a regret as people read it, in per cent; "none" where nothing feasible was found."""
    if not np.isfinite(regret):
        return "none"
    return "0" if regret <= 0.0 else f"{PER_CENT * regret:.2g}"


def brief(regret: float) -> str:
    """Return what ``percent`` does in at most five characters, for a row of nine."""
    text = percent(regret)
    small = np.isfinite(regret) and 0.0 < PER_CENT * regret < SMALL
    return f"{PER_CENT * regret:.0e}".replace("e-0", "e-") if small else text


def records(entries: Sequence[Entry]) -> Iterator[dict[str, Any]]:
    """Yield all figures of each entry, as they go into a file."""
    for entry in entries:
        score = entry.score
        record: dict[str, Any] = {
            **stated(entry),
            "score": f"{score.value:.4f}",
            "score_low": f"{score.low:.4f}",
            "score_high": f"{score.high:.4f}",
        }
        for k in AT:
            record |= _figures(entry, k)
        yield record | {
            "seconds_per_design": f"{entry.seconds:.3g}",
            "cost_evaluations": entry.cost.evaluations,
            "cost_seconds": f"{entry.cost.seconds:.0f}" if np.isfinite(entry.cost.seconds) else "",
            "cost_per_task": f"{entry.learned:.4g}",
            "unsolvable": entry.violation.shape[1],
            "version": entry.version,
            "command": entry.command,
        }


def _figures(entry: Entry, k: int) -> dict[str, str]:
    return {
        f"{name}_{k}": f"{over_seeds(statistic, entry.regret):.4g}" if entry.has(k) else ""
        for name, statistic in statistics(k).items()
    }


def markdown(entries: Sequence[Entry]) -> str:
    """Return the standings as Markdown, a table for each track."""
    counts = [k for k in SHORT if any(entry.has(k) for entry in entries)]
    heads = ["method", "tasks", "seeds", "score (95 %)", *map(str, counts), f"feasible, {SCORED}"]
    tables = []
    for track in sorted({entry.track for entry in entries}):
        lines = [
            f"**{track}**: median regret in per cent after so many evaluations",
            "",
            f"| {' | '.join(heads)} |",
            f"| --- |{' ---: |' * (len(heads) - 1)}",
        ]
        own = [entry for entry in entries if entry.track == track]
        lines += [f"| {' | '.join(_cells(entry, counts))} |" for entry in own]
        tables.append("\n".join(lines))
    return "\n\n".join(tables)


def _cells(entry: Entry, counts: Sequence[int]) -> list[str]:
    score = entry.score
    medians = [percent(entry.median(k)) if entry.has(k) else "" for k in counts]
    feasible = over_seeds(share_feasible(min(SCORED, entry.setting.budget)), entry.regret)
    return [
        entry.name,
        str(len(entry.rows)),
        str(entry.seeds),
        f"{score.value:.3f} ({score.low:.3f} to {score.high:.3f})",
        *medians,
        f"{100 * feasible:.0f} %",
    ]


def save_table(entries: Sequence[Entry], path: Path) -> None:
    """Write all figures of the entries to a csv file, and the chief ones as Markdown beside it."""
    rows = list(records(entries))
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    with whole_file(path.with_suffix(".md")) as part:
        part.write_text(markdown(entries) + "\n", encoding="utf-8")
