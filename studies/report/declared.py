"""What is declared of problems, as programs read it: SI, full digits, every unit stated."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pkm_gym.core.limit import Limit
from pkm_gym.core.problem import DesignProblem
from pkm_gym.envs.registration import environment_ids
from pkm_gym.mechanisms import called


def overview(problem: DesignProblem) -> dict[str, Any]:
    """Return a row that says what a problem is."""
    return {
        "mechanism": called(problem),
        "title": problem.title,
        "environments": list(environment_ids(problem.declared)),
        "variables": [v.name for v in problem.all_variables],
        "task_fields": [v.name for v in problem.task_variables],
        "drawn": [v.name for v in problem.task_variables if v.drawn],
        "objectives": [objective.name for objective in problem.all_objectives],
    }


def in_full(problem: DesignProblem) -> dict[str, Any]:
    """Return all that is declared of a problem, a row each, with its unit beside it."""
    paper = problem.reference.citation if problem.reference else ""
    rows = [row for part in (_design, _task, _options, _judged) for row in part(problem)]
    return {**overview(problem), "paper": paper, "notes": list(problem.notes), "rows": rows}


def _row(part: str, name: str, doc: str, unit: str = "", **values: Any) -> dict[str, Any]:
    return {"part": part, "name": name, "unit": unit, **values, "doc": doc}


def _design(problem: DesignProblem) -> Iterator[dict[str, Any]]:
    printed = problem.printed_design()
    named, usual = problem.named(printed), {v.name: v for v in problem.all_variables}
    for name, v in usual.items():
        yield _row("variable", name, v.doc, v.unit, value=named[name], low=v.low, high=v.high)
    for name, (value, unit) in problem.derived(printed).items():
        yield _row("dimension", name, "derived", unit, value=value)


def _task(problem: DesignProblem) -> Iterator[dict[str, Any]]:
    fields, usual = {v.name: v for v in problem.task_variables}, problem.task_type()
    for name, v in fields.items():
        low, high = v.legal_low, v.legal_high
        family = {"low": v.low, "high": v.high} if v.drawn else {}
        own = {"value": v.default, "low": low, "high": high}
        yield _row("task", f"task.{name}", v.doc, v.unit, **own, family=family)
    for name, p in problem.declared.products.items():
        low, high = p.legal(fields)
        least, most = p.drawn(fields)
        family = {"low": least, "high": most} if least < most else {}
        own = {"value": p.value(usual), "low": low, "high": high}
        doc = f"{p.doc}, {p.words}, in place of {p.ratio}"
        yield _row("task", f"task.{name}", doc, p.unit, **own, family=family)


def _options(problem: DesignProblem) -> Iterator[dict[str, Any]]:
    for item in problem.options_type.table():
        yield _row("option", item.name, item.doc, item.unit, value=item.default)


def _judged(problem: DesignProblem) -> Iterator[dict[str, Any]]:
    for objective in problem.all_objectives:
        best = problem.reference.optima.get(objective.name)
        value = best.value if best else None
        unit, way = objective.unit, objective.direction
        yield _row("objective", objective.name, f"{way}; its verified optimum", unit, value=value)
    for index in problem.index_table:
        yield _row("index", index.name, index.doc, index.unit)
    own = {limit.name: limit.doc for limit in problem.declared.own_limits}
    for limit in problem.limits:
        if isinstance(limit, Limit):
            unit = problem.unit(limit.quantity)
            words = f"{limit.quantity} {limit.side_words} {limit.bound_shown(unit)}"
            yield _row("constraint", limit.name, words)
        else:
            yield _row("constraint", limit, own[limit])
