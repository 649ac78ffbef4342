"""What the dashboard says of a study: a note, and graphs of its feasible designs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from optuna import Study
from optuna_dashboard import get_note, save_note, save_plotly_graph_object  # type: ignore[attr-defined]  # has no __all__

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.units import show
from pkm_gym.mechanisms import called
from pkm_gym.studies.report.rows import (
    markdown,
    optimum_row,
    recorded_optimum,
    rows_beside_paper,
    verdict,
)
from pkm_gym.studies.storage.studies import designs_of, finished

OWN = "note"  # the user attribute that holds our note as it was written last

READING = {
    "objectives": "An infeasible trial has a value that no feasible design reaches, so the graph "
    "of feasible designs, below the others, is the one to read.",
    "merit": "The values are merits: about 1 at the task's optimum, smaller is better, infeasible "
    "designs penalised. The graph of feasible designs, below the others, shows the objective.",
}


def write_note(study: Study, best: Evaluation, name: str, pictures: list[str]) -> None:
    """Save the study's note: the problem, the paper's optimum, the best design and its pictures.

    What the user has written around it stays; if it is within, all of it stays, above the new note.

    Args:
        study: whose note it is.
        best: the evaluation of one design.
        name: what to call that design.
        pictures: addresses of its artifacts.
    """
    problem = best.problem
    known = recorded_optimum(problem)
    rows = rows_beside_paper(best, name, optimum_row(problem, known) if known else None)
    parts = [f"# {problem.name}: {problem.title}", *_sentences(problem), markdown(problem, rows)]
    parts += [text for text in (verdict(problem), best.explain(0)) if text]
    parts += [f"![{name}]({address})" for address in pictures]
    parts.append(READING[study.user_attrs["values"]])
    text, there = "\n\n".join(parts), get_note(study)
    former = study.user_attrs.get(OWN) or (there if there.startswith(parts[0]) else "")
    if former and former in there:
        whole = there.replace(former, text)
    else:
        whole = "\n\n---\n\n".join(filter(None, [there, text]))
    save_note(study, whole)
    study.set_user_attr(OWN, text)


def _sentences(problem: DesignProblem) -> Iterator[str]:
    """Say in words what is searched."""
    docs = {index.name: index.doc for index in problem.index_table}
    for objective in problem.objectives:
        unit = f" ({objective.unit})" if objective.unit else ""
        what = f"**{objective.name}**{unit}, the {docs[objective.name]}"
        yield f"{objective.direction.capitalize()} {what}."
    if len(problem.objectives) > 1:
        yield (
            f"The best design below is the best feasible one by {problem.objectives[0].name}; "
            f"`pkm-gym pareto {called(problem)}` shows the front."
        )
    space = [
        f"{v.name} {show(v.low, v.unit)} to {show(v.high, v.unit)} ({v.doc})"
        for v in problem.variables
    ]
    units = {v.name: v.unit for v in problem.all_variables}
    space += [f"{name} = {show(value, units[name])}" for name, value in problem.fixed.items()]
    yield f"Over {', '.join(space)}."
    default = problem.task_type()
    changed = [
        f"{v.name} = {show(getattr(problem.task, v.name), v.unit)}"
        for v in problem.task_variables
        if getattr(problem.task, v.name) != getattr(default, v.name)
    ]
    whose = "paper's" if problem.reference else "default"
    yield f"The {whose} task{', with ' + ', '.join(changed) if changed else ''}."


def write_graphs(study: Study, problem: DesignProblem) -> None:
    """Save graphs of the feasible trials only: their history, and two objectives if there are.

    The dashboard's own graphs also show the infeasible trials, whose values are far off.
    """
    from plotly.graph_objects import Scatter

    trials = finished(study)
    evaluation = problem.evaluate(designs_of(study, problem))
    number = np.array([trial.number for trial in trials])[evaluation.feasible]
    values = evaluation.objectives[evaluation.feasible].T
    sign = problem.objectives[0].sign
    best = sign * np.minimum.accumulate(sign * values[0])
    designs = {"mode": "markers", "name": "feasible designs", "opacity": 0.5}
    line = {"mode": "lines", "name": "best", "line": {"shape": "hv"}}
    axes = [f"{o.name} [{o.unit}]" if o.unit else o.name for o in problem.objectives]
    title = f"feasible designs: {len(number)} of {len(trials)} trials"
    history = [
        Scatter(x=number, y=values[0], **designs),
        Scatter(x=number, y=best, **line),
    ]
    _save_graph(study, "feasible_designs", history, title, "trial", axes[0])
    if len(axes) > 1:
        both = [Scatter(x=values[0], y=values[1], **designs)]
        _save_graph(study, "objectives", both, title, *axes[:2])


def _save_graph(study: Study, name: str, traces: list[Any], title: str, x: str, y: str) -> None:
    from plotly.graph_objects import Figure

    figure = Figure(traces)
    figure.update_layout(template=None, title=title, xaxis_title=x, yaxis_title=y)
    save_plotly_graph_object(study, figure, graph_object_id=name)
