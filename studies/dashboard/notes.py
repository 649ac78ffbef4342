"""What the dashboard says of a study in its note."""

from __future__ import annotations

from collections.abc import Iterator

from optuna import Study
from optuna_dashboard import get_note, save_note  # type: ignore[attr-defined]  # has no __all__

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.units import show
from pkm_gym.mechanisms import called
from pkm_gym.studies.report.design import changed_task
from pkm_gym.studies.report.rows import (
    markdown,
    optimum_row,
    recorded_optimum,
    rows_beside_paper,
    verdict,
)

OWN = "note"  # the user attribute that holds our note as it was written last

READING = {
    "objectives": "An infeasible trial has a value that no feasible design reaches, the worse the "
    "more it breaks. The graphs below the dashboard's own show the feasible designs only.",
    "penalised": "An infeasible trial's value is its objective with a penalty on what it breaks, "
    "for a sampler that knows no constraints. The graphs below the dashboard's own show the "
    "feasible designs only.",
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
    changed = [f"{name} = {show(*x)}" for name, x in changed_task(problem, problem.task).items()]
    whose = "paper's" if problem.reference else "default"
    yield f"The {whose} task{', with ' + ', '.join(changed) if changed else ''}."
