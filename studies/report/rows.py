"""Rows of numbers beside the paper's: what tables, notes and last lines are made of."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from rich.console import Group
from rich.text import Text

from pkm_gym.core.cache import say_once
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import Optimum, Value, disagreement
from pkm_gym.core.rows import Dimension
from pkm_gym.core.task import Variable
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import converted, shown
from pkm_gym.studies.cli.terminal import FAINT, GAP, Sheet, console, table

VERIFIED, SOLVED, UNCERTAIN = "verified optimum", "solved optimum", "uncertain optimum"
UNVERIFIED = "recorded, not verified"
ORIGINS = {  # of the optima
    VERIFIED: "recorded",
    SOLVED: "solved now, by searches that agree",
    UNCERTAIN: "solved now, by searches that disagree",
    UNVERIFIED: "recorded, not verified",
}


@dataclass(frozen=True)
class Row:
    """One line of a table.

    Attributes:
        name: what was evaluated.
        value: of the first objective, None where there is none.
        design: variable -> value.
        evaluations: how many designs it took.
        regret: the share by which it is behind the optimum, see ``regret_of``; NaN if infeasible
            or unknown.
        feasible: "yes", "no", or how many runs found a feasible design.
        note: what is wrong with it.
        runs: of how many runs it is the one of median regret.
    """

    name: str
    value: float | None
    design: Mapping[str, float] = field(default_factory=dict)
    evaluations: int | None = None
    regret: float = math.nan
    feasible: str = ""
    note: str = ""
    runs: int = 1


def told_variables(problem: DesignProblem) -> tuple[Variable, ...]:
    """Return the variables that are searched or were fixed, not those that stay as usual."""
    told = {*problem.variable_names, *problem.space.unusual()}
    return tuple(v for v in problem.all_variables if v.name in told)


def dimensions_of(problem: DesignProblem, row: Row) -> dict[str, Dimension]:
    """Return the derived dimensions of a row's design, none where there is none or no machine."""
    return problem.derived(problem.design(row.design)) if row.design else {}


def told_dimensions(problem: DesignProblem, rows: Sequence[Row]) -> dict[str, list[str]]:
    """Return the lengths and angles that rows' ratios make, by title: the unit, and text each."""
    found = [dimensions_of(problem, row) for row in rows]
    names = {name: unit for sizes in found for name, (_, unit) in sizes.items() if unit}
    return {
        name: [converted(0.0, unit)[1], *(shown(*s[name])[0] if s else "" for s in found)]
        for name, unit in names.items()
    }


def caption(problem: DesignProblem, rows: Sequence[Row]) -> str:
    """Return what the column titles mean."""
    first = problem.objectives[0]
    units: dict[str, list[str]] = {first.unit: [first.name]}
    for v in told_variables(problem):
        units.setdefault(converted(0.0, v.unit)[1], []).append(v.name)
    for name, (unit, *_) in told_dimensions(problem, rows).items():
        units.setdefault(unit, []).append(name)
    parts = [f"{', '.join(names)} in {unit}" for unit, names in units.items() if unit]
    if any(row.evaluations is not None for row in rows):
        parts.append("designs: number evaluated")
    if (optimum := _reference(rows)) is not None:
        parts.append(f"regret: {regret_words(problem)}, of the {in_full(optimum)}")
    if (runs := max((row.runs for row in rows), default=1)) > 1:
        parts.append(f"of {runs} runs a row shows the one of median regret")
    return "; ".join(parts)


def columns(problem: DesignProblem, rows: Sequence[Row]) -> list[list[str]]:
    """Return a table's columns of text, each below its title: those that say something.

    The last are those of ``design_columns``.
    """
    texts = {
        "": [row.name for row in rows],
        "designs": ["" if row.evaluations is None else f"{row.evaluations:,}" for row in rows],
        problem.objectives[0].name: [
            "" if row.value is None else f"{row.value:.5g}" for row in rows
        ],
        "regret": [_percent(row.regret) if _reference(rows) else "" for row in rows],
        "feasible": [row.feasible for row in rows],
    }
    said = [[title, *cells] for title, cells in texts.items() if any(cells)]
    return said + design_columns(problem, rows)


def design_columns(problem: DesignProblem, rows: Sequence[Row]) -> list[list[str]]:
    """Return the columns of the variables, and of the dimensions that they make."""
    variables = [
        [v.name, *(_number(row.design[v.name], v.unit) if row.design else "" for row in rows)]
        for v in told_variables(problem)
    ]
    sizes = told_dimensions(problem, rows).items()
    return variables + [[name, *cells] for name, (_, *cells) in sizes]


def _reference(rows: Iterable[Row]) -> Row | None:
    """Return the row that the regrets of the others are measured from, if there is one."""
    return next((row for row in rows if row.name in ORIGINS), None)


def _percent(regret: float) -> str:
    return f"{round(100.0 * regret, 3) + 0.0:.3f} %" if math.isfinite(regret) else ""


def _number(value: float, unit: str) -> str:
    return shown(value, unit)[0] if unit else f"{value:.4f}"


def markdown(problem: DesignProblem, rows: Sequence[Row]) -> str:
    """Return rows as a Markdown table."""
    titles, *lines = zip(*columns(problem, rows), strict=True)
    rule = ["---"] + ["---:"] * (len(titles) - 1)
    written = "\n".join("| " + " | ".join(line) + " |" for line in (titles, rule, *lines))
    return f"{written}\n\n{caption(problem, rows)}"


def rich_table(problem: DesignProblem, rows: Sequence[Row]) -> Group:
    """Return rows as a table for the terminal; the designs below the values if it's too narrow."""
    whole = columns(problem, rows)
    values = len(whole) - len(design_columns(problem, rows))
    return Group(*sheets(whole, values), Text(caption(problem, rows), style=FAINT))


def sheets(whole: Sequence[Sequence[str]], values: int) -> list[Sheet]:
    """Return columns as a table; those behind the first ``values`` below them if it's too narrow.

    The first column, which names the rows, stands in both.
    """
    parts = [whole]
    if sum(max(map(len, column)) + GAP for column in whole) - GAP > console().width:
        parts = [whole[:values], [whole[0], *whole[values:]]]
    return [_sheet(part) for part in parts]


def _sheet(columns: Sequence[Sequence[str]]) -> Sheet:
    titles, *rows = zip(*columns, strict=True)
    sheet = table(*titles, numbers=titles[1:])
    for row in rows:
        sheet.add_row(*row)
    return sheet


def row_of(name: str, evaluation: Evaluation, i: int, optimum: Row | None, **fields: Any) -> Row:
    """Return the row of design i of an evaluation."""
    problem = evaluation.problem
    feasible = bool(evaluation.feasible[i])
    value = float(evaluation.objectives[i, 0])
    design = problem.named(evaluation.designs[i])
    regret = math.nan
    if optimum is not None and optimum.value is not None and feasible:
        regret = regret_of(problem, evaluation.designs[i], optimum)
    return Row(
        name,
        value if math.isfinite(value) else None,
        design,
        regret=regret,
        feasible="yes" if feasible else "no",
        **fields,
    )


def regret_of(problem: DesignProblem, design: FloatArray, optimum: Row) -> float:
    """Return the regret of a feasible design (d,): the share that it costs more, or loses.

    value / optimum - 1 of an index that is minimised, 1 - value / optimum of one that is maximised.
    """
    both = problem.evaluate(np.stack([design, problem.design(optimum.design)]))
    sign, behind = problem.objectives[0].sign, both.log_merit[0] - both.log_merit[1]
    return float(sign * np.expm1(sign * behind))


def regret_words(problem: DesignProblem) -> str:
    """Return what a regret is, as a formula."""
    return "value / optimum - 1" if problem.objectives[0].sign > 0.0 else "1 - value / optimum"


def asks_the_papers_task(problem: DesignProblem) -> bool:
    """Whether the printed design answers the problem: the paper's task, nothing else fixed."""
    if not problem.reference:
        return False
    design = printed_design(problem)
    kept = all(math.isclose(design[name], value) for name, value in problem.fixed.items())
    return kept and problem.task == problem.task_type()


def printed_design(problem: DesignProblem) -> dict[str, float]:
    """Return the printed design, what isn't printed at its default: variable -> value."""
    defaults = problem.space.defaults().tolist()
    return {v.name: value for v, value in zip(problem.all_variables, defaults, strict=True)}


def printed_value(problem: DesignProblem) -> Value | None:
    """Return what the paper prints for the first objective, if it prints any."""
    value = problem.reference.values.get(problem.objectives[0].name)
    return value if value is not None and value.printed is not None else None


def recorded_optimum(problem: DesignProblem) -> Optimum | None:
    """Return the verified optimum that the reference holds for just this problem and task."""
    if problem.task != problem.task_type():
        return None
    names = [objective.name for objective in problem.objectives]
    for optimum in problem.reference.optima.values():
        same = type(problem)(objective=names, fixed=optimum.fixed)
        if optimum.objective == names[0] and same.hash() == problem.hash():
            return optimum
    return None


def optimum_row(problem: DesignProblem, optimum: Optimum) -> Row:
    """Return the row of a recorded optimum, and say so where the model doesn't give it."""
    if note := disagreement(problem, optimum):
        say_once(note)
        return row_of(
            UNVERIFIED, problem.evaluate(problem.design(optimum.design)[None]), 0, None, note=note
        )
    return Row(VERIFIED, optimum.value, optimum.design, regret=0.0, feasible="yes")


def in_full(optimum: Row) -> str:
    """Return what an optimum is called, and where it is from."""
    return f"{optimum.name} ({ORIGINS[optimum.name]})"


def paper_rows(problem: DesignProblem, optimum: Row | None) -> list[Row]:
    """Return the printed optimum, as printed and with our model, where it answers this problem."""
    if not asks_the_papers_task(problem):
        return []
    evaluation = problem.evaluate(problem.printed_design()[None])
    printed = printed_value(problem)
    design = printed_design(problem)
    if printed is None:
        row = Row("paper: none printed", None, design)
    else:
        row = Row("paper, printed", printed.printed, design)
    return [row, row_of("paper, our model", evaluation, 0, optimum, evaluations=1)]


def known_rows(problem: DesignProblem) -> list[Row]:
    """Return the rows of the paper's design, with our model, and of the recorded optimum."""
    known = recorded_optimum(problem)
    optimum = optimum_row(problem, known) if known else None
    return [*paper_rows(problem, optimum)[1:], *([optimum] if optimum else [])]


def single_optima(problem: DesignProblem) -> list[Row]:
    """Return the recorded optimum of each of several objectives alone, where there is one."""
    rows = []
    for objective in problem.objectives:
        alone = problem.with_objectives(objective.name)
        if known := recorded_optimum(alone):
            rows.append(replace(optimum_row(alone, known), name=f"optimum of {objective.name}"))
    return rows


def rows_beside_paper(best: Evaluation, name: str, optimum: Row | None) -> list[Row]:
    """Return the rows of the paper, of one evaluated design and of the optimum, if it is known."""
    rows = [*paper_rows(best.problem, optimum), row_of(name, best, 0, optimum)]
    return [*rows, optimum] if optimum else rows


def judged_value(problem: DesignProblem) -> Value | None:
    """Return the printed value whose verdict holds here: our number is the one that was judged.

    With another inertia, say, it is another number.
    """
    value = printed_value(problem)
    if value is None or not asks_the_papers_task(problem):
        return None
    ours = float(problem.evaluate(problem.printed_design()[None]).objectives[0, 0])
    return value if is_judged(problem, value, ours) else None


def is_judged(problem: DesignProblem, value: Value, ours: float) -> bool:
    """Whether our number is the one of a printed value's verdict; say so where it should be."""
    judged = math.isclose(ours, value.ours, rel_tol=value.tolerance)
    if not judged and not problem.options.changed():
        path = problem.reference.path
        say_once(
            f"{path} says that ours of {value.name} is {value.ours!r}, the model gives {ours:.9g}"
        )
    return judged


def verdict(problem: DesignProblem) -> str:
    """Return a sentence on the printed value of the first objective, or nothing."""
    value = judged_value(problem)
    if value is None:
        return ""
    sentence = f"The printed {value.symbol} = {value.printed:g} is {value.verdict}"
    return f"{sentence}. {value.note}".strip()
