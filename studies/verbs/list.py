"""``pkm-gym list``: the design problems, or one of them in full."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.units import converted, shown, span
from pkm_gym.envs.registration import environment_ids
from pkm_gym.mechanisms import declaration, make_problem, problem_type, register
from pkm_gym.studies.cli.arguments import known_problems
from pkm_gym.studies.cli.options import (
    CsvOption,
    PlainJsonOption,
)
from pkm_gym.studies.cli.output import Output
from pkm_gym.studies.cli.terminal import FAINT, HEAD, section, table
from pkm_gym.studies.report.declared import in_full, overview


def command(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Show this one in full.")
    ] = None,
    as_json: PlainJsonOption = False,
    csv: CsvOption = None,
) -> None:
    """Show the registered design problems, or one in full."""
    out = Output(as_json, csv)
    if name is None:
        problems = [make_problem(known) for known in known_problems()]
        _show_all(out.screen, problems)
        out.give({"rows": [overview(problem) for problem in problems]})
    else:
        register(problem_type(name))
        problem = make_problem(name, **declaration(name).reporting)
        _show_one(out.screen, problem)
        out.give(in_full(problem))


def _show_all(screen: Console, problems: Sequence[DesignProblem]) -> None:
    rows = table("mechanism", "problem", "variables", "objectives")
    for problem in problems:
        drawn = sum(variable.drawn for variable in problem.task_variables)
        count = f"{len(problem.task_variables)} task fields, {drawn} drawn by the Family"
        rows.add_row(
            Text(problem.name, style=HEAD),
            "\n".join([problem.title, count, *environment_ids(problem.declared)]),
            "\n".join(
                f"{v.name} {span(v.low, v.high, v.unit)} {converted(0.0, v.unit)[1]}".rstrip()
                for v in problem.all_variables
            ),
            "\n".join(objective.name for objective in problem.all_objectives),
        )
    screen.print(rows)
    screen.print("pkm-gym list NAME shows one in full", style=FAINT)


def _show_one(screen: Console, problem: DesignProblem) -> None:
    screen.print(Text.assemble((problem.name, HEAD), f": {problem.title}"))
    if problem.reference:
        screen.print(problem.reference.citation, style=FAINT)
    screen.print(f"environments: {', '.join(environment_ids(problem.declared)) or 'none'}")
    if problem.declared.family_words:
        screen.print(f"designs of its Family: {problem.declared.family_words}")
    if not problem.declared.splits:
        screen.print("splits for the benchmark: none")
    for note in problem.notes:
        screen.print(note)
    for title, rows in (
        (f"Variables and the {_origin(problem)} design", _variables(problem)),
        ("Task (--set task.FIELD=VALUE), and from where a Family draws it", _task(problem)),
        ("Options (--set OPTION=VALUE)", _options(problem)),
        (_objectives_title(problem), _objectives(problem)),
        ("Indices", _indices(problem)),
        ("Constraints", _constraints(problem)),
    ):
        if rows.row_count:
            screen.print(section(title))
            screen.print(rows)


def _variables(problem: DesignProblem) -> Any:
    origin = _origin(problem)
    rows = table("variable", "range", origin, "unit", "what it is", numbers=[origin])
    named = problem.named(problem.printed_design())
    for v in problem.all_variables:
        rows.add_row(v.name, span(v.low, v.high, v.unit), *shown(named[v.name], v.unit), v.doc)
    for name, (value, unit) in problem.derived(problem.printed_design()).items():
        rows.add_row(name, "", *shown(value, unit), "derived", style=FAINT)
    return rows


def _task(problem: DesignProblem) -> Any:
    rows = table("field", "default", "unit", "Family", "allowed", "what it is", numbers=["default"])
    for v in problem.task_variables:
        drawn = span(v.low, v.high, v.unit) if v.drawn else ""
        allowed = span(v.legal_low, v.legal_high, v.unit)
        rows.add_row(v.name, *shown(v.default, v.unit), drawn, allowed, v.doc)
    fields, usual = {v.name: v for v in problem.task_variables}, problem.task_type()
    for name, p in problem.declared.products.items():
        low, high = p.drawn(fields)
        drawn = span(low, high, p.unit) if low < high else ""
        allowed = span(*p.legal(fields), p.unit)
        doc = f"{p.doc}, in place of {p.ratio}"
        rows.add_row(name, *shown(p.value(usual), p.unit), drawn, allowed, doc, style=FAINT)
    return rows


def _options(problem: DesignProblem) -> Any:
    rows = table("option", "default", "allowed", "what it is")
    for item in problem.options_type.table():
        rows.add_row(item.name, _written(item.default), item.allowed, item.doc)
    return rows


def _objectives_title(problem: DesignProblem) -> str:
    known = ", verified optima of the default task" if problem.reference.optima else ""
    return f"Objectives (--objective NAME){known}"


def _objectives(problem: DesignProblem) -> Any:
    rows = table("objective", "direction", "optimum", "unit", numbers=["optimum"])
    for objective in problem.all_objectives:
        best = problem.reference.optima.get(objective.name)
        number, unit = shown(best.value if best else float("nan"), objective.unit)
        rows.add_row(objective.name, objective.direction, number if best else "", unit)
    return rows


def _indices(problem: DesignProblem) -> Any:
    rows = table("index", "unit", "what it is")
    for index in problem.index_table:
        rows.add_row(index.name, shown(0.0, index.unit)[1], index.doc)
    return rows


def _constraints(problem: DesignProblem) -> Any:
    rows = table("constraint", "what it says", "violation")
    own = {limit.name: limit.doc for limit in problem.declared.own_limits}
    for limit in problem.limits:
        if isinstance(limit, str):
            rows.add_row(limit, own[limit], "the mechanism's own")
            continue
        unit = problem.unit(limit.quantity)
        words = f"{limit.quantity} {limit.side_words} {limit.bound_shown(unit)}"
        share = "share of the bound" if limit.relative(unit) else "absolute"
        rows.add_row(limit.name, words, share)
    return rows


def _origin(problem: DesignProblem) -> str:
    """Say where the design comes from that stands beside the ranges."""
    return "printed" if problem.reference else "default"


def _written(value: Any) -> str:
    """Return an option's value as it is typed on the command line."""
    if isinstance(value, tuple):
        return "x".join(map(str, value))
    return str(value).lower() if value is None or isinstance(value, bool) else str(value)
