"""How the verbs write to the terminal: one console, one kind of table."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from pkm_gym.core.units import shown

GOOD, BAD, FAINT, HEAD = "green", "bold red", "dim", "bold"


def console() -> Console:
    """Return a console on stdout that colours nothing by itself and takes no markup."""
    return Console(highlight=False, markup=False)


def table(*heads: str, numbers: Iterable[str] = ()) -> Table:
    """Return an empty table with these heads, the columns of ``numbers`` right-aligned.

    They and the first column are never wrapped.
    """
    empty = Table(
        box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0), header_style=FAINT
    )
    right = set(numbers)
    for head in heads:
        whole = head in right or head == heads[0]
        empty.add_column(head, justify="right" if head in right else "left", no_wrap=whole)
    return empty


def listing(values: Mapping[str, tuple[float, str]]) -> Table:
    """Return named values in SI as lines of name, number and unit as people read them."""
    lines = Table.grid(padding=(0, 1))
    lines.add_column(no_wrap=True)
    lines.add_column(no_wrap=True, justify="right")
    lines.add_column(no_wrap=True, style=FAINT)
    for name, (value, unit) in values.items():
        lines.add_row(name, *shown(value, unit))
    return lines


def section(title: str) -> Text:
    """Return the line above a part of the output."""
    return Text(f"\n{title}", style=HEAD)


def counter(screen: Console, unit: str) -> Progress:
    """Return a bar that counts units, with what is being done and the time left; none in a file."""
    return Progress(
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(f"{unit}, {{task.description}}, left"),
        TimeRemainingColumn(elapsed_when_finished=True),
        console=screen,
        transient=True,
        disable=not screen.is_terminal,
    )
