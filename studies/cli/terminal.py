"""How the verbs write to the terminal: one console, one kind of table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from pkm_gym.core.units import shown

GAP = 2  # between columns
GOOD, BAD, FAINT, HEAD = "green", "bold red", "dim", "bold"


def console() -> Console:
    """Return a console on stdout that colours nothing by itself and takes no markup."""
    return Console(highlight=False, markup=False)


class Sheet:
    """Rows of text under heads, never cut: words fold, and columns that don't fit stand below.

    Numbers are whole and right-aligned. The first column stands beside every part, whole where it
    takes no more than half of a line.
    """

    def __init__(self, heads: Sequence[str], numbers: Iterable[str]) -> None:
        self._columns: list[list[Text]] = [[Text(head)] for head in heads]
        self._numbers = {heads.index(head) for head in numbers}
        self._styles: list[str] = []

    @property
    def row_count(self) -> int:
        """How many rows there are under the heads."""
        return len(self._styles)

    def add_row(self, *cells: str | Text, style: str = "") -> None:
        """Add a row, one cell for each head."""
        for column, cell in zip(self._columns, cells, strict=True):
            column.append(cell if isinstance(cell, Text) else Text(cell))
        self._styles.append(style)

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Table]:
        """Yield the parts, each as wide as it must be."""
        wide = options.max_width
        least = [self._least(i, wide) for i in range(len(self._columns))]
        part = [0]
        for i in range(1, len(least)):
            if len(part) > 1 and sum(least[j] + GAP for j in (*part, i)) - GAP > wide:
                yield self._part(part, least, wide)
                part = [0]
            part.append(i)
        yield self._part(part, least, wide)

    def _least(self, i: int, wide: int) -> int:
        """Return how narrow a column may be."""
        whole = max(map(_width, self._columns[i]))
        if i in self._numbers or (i == 0 and whole <= wide // 2):
            return whole
        words = (word for cell in self._columns[i] for word in cell.plain.split())
        return max(map(cell_len, words), default=0)

    def _part(self, columns: Sequence[int], least: Sequence[int], wide: int) -> Table:
        """Return some of the columns, the widest folded until all fit."""
        whole = {i: max(map(_width, self._columns[i])) for i in columns}
        widest = max(whole.values())
        widths = whole
        while sum(widths.values()) + GAP * (len(columns) - 1) > wide and widest > 0:
            widest -= 1
            widths = {i: max(least[i], min(widest, whole[i])) for i in columns}
        part = Table(
            box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0),
            header_style=FAINT,
        )  # fmt: skip
        for i in columns:
            part.add_column(
                self._columns[i][0],
                justify="right" if i in self._numbers else "left",
                width=widths[i],
                overflow="fold",
            )
        for row, style in enumerate(self._styles, 1):
            part.add_row(*(self._columns[i][row] for i in columns), style=style)
        return part


def _width(cell: Text) -> int:
    return max(map(cell_len, cell.plain.split("\n")))


def table(*heads: str, numbers: Iterable[str] = ()) -> Sheet:
    """Return an empty table with these heads, those of ``numbers`` over numbers."""
    return Sheet(heads, numbers)


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
