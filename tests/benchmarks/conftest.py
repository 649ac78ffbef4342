"""Prints one table of what was measured; a row is described by its benchmark's ``extra_info``.

``count`` things of a ``unit`` are done in each round (without a unit: a time is shown), ``row`` is
what the table calls it, ``versus`` maps other rows of the table to how a ratio calls them, and
``target`` is what to reach.
"""

from __future__ import annotations

from typing import Any

import pytest

HEADER = ("benchmark", "result", "ratio", "target")


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Leave pytest-benchmark's own table out; --benchmark-verbose shows it."""
    config.option.benchmark_quiet = True


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """Print the table."""
    rows = [_row(bench) for bench in config._benchmarksession.benchmarks if bench.stats.data]  # type: ignore[attr-defined]  # pytest-benchmark's
    if not rows:
        return
    times = {row["row"]: row["time"] for row in rows}
    lines = [HEADER] + [_cells(row, times) for row in rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(HEADER))]
    terminalreporter.section("benchmarks (best round)")
    for line in lines:
        cells = (cell.ljust(width) for cell, width in zip(line, widths, strict=True))
        terminalreporter.write_line("  ".join(cells).rstrip())


def _row(bench: Any) -> dict[str, Any]:
    """Return what a benchmark measured: time per thing in seconds, of its best round."""
    info = {"count": 1, "unit": "", "versus": {}, "target": "", **bench.extra_info}
    return {**info, "time": bench.stats.min / info["count"]}


def _cells(row: dict[str, Any], times: dict[str, float]) -> tuple[str, ...]:
    ratios = (
        f"{times[name] / row['time']:.1f}x {word}"
        for name, word in row["versus"].items()
        if name in times
    )
    result = f"{_scaled(1.0 / row['time'])} {row['unit']}/s" if row["unit"] else _time(row["time"])
    return row["row"], result, ", ".join(ratios), row["target"]


def _scaled(rate: float) -> str:
    for size, word in ((1e6, " million"), (1e3, " thousand")):
        if rate >= size:
            return f"{rate / size:.3g}{word}"
    return f"{rate:.3g}"


def _time(seconds: float) -> str:
    if seconds >= 1.0:
        return f"{seconds:.2f} s"
    return f"{1e3 * seconds:.0f} ms" if seconds >= 1e-2 else f"{1e6 * seconds:.1f} µs"
