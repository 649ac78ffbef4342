"""Standings as programs read them: all figures, all digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pkm_gym.benchmark.scoring import (
    WITHIN,
    Statistic,
    over_seeds,
    quantile,
    share_feasible,
    share_within,
)
from pkm_gym.benchmark.standings import AT, Entry

REGRET = "log merit behind the optimum: log(value / optimum), turned over for a maximised index"


def scored(entries: Sequence[Entry]) -> dict[str, Any]:
    """Return what regret means, and a row for each method, setting and number of tasks."""
    seconds = dict.fromkeys(("seconds_per_design", "delay"), "s") | {"cost": {"seconds": "s"}}
    return {"regret": REGRET, "units": seconds, "rows": [_row(entry) for entry in entries]}


def statistics(k: int) -> dict[str, Statistic]:
    """Return what is told of regrets after k evaluations, by name."""
    return {
        "median": quantile(k, 0.5),
        "p90": quantile(k, 0.9),
        **{f"within_{limit:g}": share_within(k, limit) for limit in WITHIN},
        "feasible": share_feasible(k),
    }


def stated(entry: Entry) -> dict[str, Any]:
    """Return what was run: method, track, tasks and setting."""
    setting = entry.setting
    return {
        "method": setting.method,
        "start": setting.start,
        "knowledge": setting.knowledge,
        "split": setting.split,
        "tasks": len(entry.rows),
        "seeds": entry.seeds,
        "pool": setting.pool,
        "noise": setting.noise,
        "delay": setting.delay,
    }


def _row(entry: Entry) -> dict[str, Any]:
    score, cost = entry.score, entry.cost
    after = {
        f"{k}": {name: over_seeds(told, entry.regret) for name, told in statistics(k).items()}
        for k in AT
        if entry.has(k)
    }
    return {
        **stated(entry),
        "score": {"value": score.value, "low": score.low, "high": score.high},
        "after": after,
        "seconds_per_design": entry.seconds,
        "cost": {
            "evaluations": cost.evaluations,
            "seconds": cost.seconds,
            "evaluations_per_task": entry.learned,
        },
        "unsolvable": entry.violation.shape[1],
        "outside": entry.outside,
        "version": entry.version,
        "command": entry.command,
    }
