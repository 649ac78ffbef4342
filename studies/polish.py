"""``pkm-gym polish``: from a known design to the optimum near it, beside the verified one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Annotated

import numpy as np
import typer
from optuna import load_study

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import polish as polish_designs
from pkm_gym.core.solve import solve_tasks
from pkm_gym.core.task import Task
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.arguments import (
    DesignOption,
    FixOption,
    Name,
    ObjectiveOption,
    RangeOption,
    design_from,
    problem_from,
)
from pkm_gym.studies.report import (
    Row,
    optimum_row,
    paper_rows,
    recorded_optimum,
    rich_table,
    row_of,
)
from pkm_gym.studies.search import StorageOption
from pkm_gym.studies.starts import warm_designs
from pkm_gym.studies.storage import (
    count_finished,
    default_storage,
    designs_of,
    exists,
    open_storage,
    quiet,
    stands_for,
    study_names,
)
from pkm_gym.studies.terminal import BAD, FAINT, console

SOLVED, UNCERTAIN = "solved optimum", "uncertain optimum"
ORIGINS = {
    SOLVED: "solved now, by two seeds that agree",
    UNCERTAIN: "solved now, by seeds that disagree",
}
AGREES = 1e-6  # share of the objective within which two optima are the same; 8 digits are recorded


def polish(problem: DesignProblem, designs: FloatArray) -> Evaluation:
    """Polish each design (n, d) and return the evaluation of the best that comes out, one design.

    The start counts too: the answer is never worse than the best of ``designs``.
    """
    polished = polish_designs(problem, designs, problem.pack(None)[None])
    best = problem.evaluate(polished).best()
    return problem.evaluate(polished[best : best + 1])


def verified_optimum(problem: DesignProblem) -> Row | None:
    """Return the verified optimum of the problem and its task, or None where nothing is feasible.

    It is the reference's, where that holds one; otherwise it is solved now, and called uncertain
    unless two searches from different seeds agree to 1e-10 in log merit.
    """
    recorded = recorded_optimum(problem)
    if recorded is not None:
        return optimum_row(recorded)
    solved = solve_tasks(problem, problem.pack(None)[None])
    if not solved.solvable[0]:
        return None
    name = SOLVED if solved.certified[0] else UNCERTAIN
    design = problem.named(solved.designs[0])
    return Row(name, float(solved.optima[0]), design, regret=0.0, feasible="yes")


def best_known(problem: DesignProblem, where: str) -> tuple[str, FloatArray]:
    """Return where the best design of a storage's studies of just this problem is from, and it.

    Without such a study it is the printed design. The design is an array (1, d).
    """
    known: dict[str, FloatArray] = {}
    if not exists(where):
        return "the printed design", problem.printed_design()[None]
    storage = open_storage(where, create=False)
    for name in study_names(storage):
        study = load_study(study_name=name, storage=storage)
        if stands_for(study, problem) and count_finished(study):
            designs = designs_of(study, problem)
            known[name] = designs[problem.evaluate(designs).best()]
    if not known:
        return "the printed design", problem.printed_design()[None]
    best = problem.evaluate(np.array(list(known.values()))).best()
    return f"the best of the study {list(known)[best]}", list(known.values())[best][None]


def command(
    name: Name,
    source: Annotated[
        str | None,
        typer.Option(
            "--from",
            metavar="paper|grid|STUDY",
            help="Where the start is from; the best study of this problem, or the printed design, "
            "if neither this nor a design is given.",
            show_default=False,
        ),
    ] = None,
    set_: DesignOption = None,
    fix: FixOption = None,
    range_: RangeOption = None,
    objective: ObjectiveOption = None,
    storage: StorageOption = None,
) -> None:
    """Polish a design: search its neighbourhood for the optimum and compare with the verified one.

    Example: pkm-gym polish diamond --set lam_e=0.6 lam_l=2.5 gap=0.4
    """
    problem = problem_from(name, set_, fix, range_, objective, takes_design=True)
    if _gives_design(problem, set_):
        if source is not None:
            raise ValueError(f"--from {source} and a design in --set are two starts: leave one out")
        given = design_from(problem, set_)
        problem, source = _with_task(problem, given.task), "the design in --set"
        start = given.design[None]
    else:
        source, start = _start(problem, source, storage or default_storage(name))
    optimum = verified_optimum(problem)
    before = problem.evaluate(start)
    after = polish(problem, start)
    screen = console()
    rows = [*paper_rows(problem, optimum)]
    rows.append(row_of("start", before, before.best(), optimum))
    polished = row_of("polished", after, 0, optimum)
    rows += [polished, optimum] if optimum else [polished]
    screen.print(f"start: {source}")
    screen.print(rich_table(problem, rows))
    screen.print(f"polished: {judged(polished, optimum)}")
    if not after.feasible[0]:
        screen.print(after.explain(0), style=BAD)
    values = " ".join(f"{key}={x:.9g}" for key, x in problem.named(after.designs[0]).items())
    screen.print(f"pkm-gym evaluate {name} --set {values}", style=FAINT, soft_wrap=True)


def judged(polished: Row, optimum: Row | None) -> str:
    """Return a sentence on how a polished design compares with the verified optimum."""
    if optimum is None:
        return "no feasible design of this task is known"
    if polished.feasible != "yes":
        return "no feasible design lies near the start"
    origin = ORIGINS.get(optimum.name, "recorded")
    if abs(polished.regret) <= AGREES:
        return f"agrees with the verified optimum ({origin})"
    behind = f"{100 * polished.regret:.3g} % behind it"
    return f"another optimum than the verified one ({origin}), {behind}"


def _start(problem: DesignProblem, source: str | None, where: str) -> tuple[str, FloatArray]:
    with quiet():
        if source is None:
            return best_known(problem, where)
        return f"the best of {source}", warm_designs(problem, source, where)


def _gives_design(problem: DesignProblem, set_: Iterable[str] | None) -> bool:
    names = {variable.name for variable in problem.all_variables} | set(problem.declared.dimensions)
    return any(text.partition("=")[0].strip() in names for text in set_ or ())


def _with_task(problem: DesignProblem, task: Task) -> DesignProblem:
    return type(problem)(
        task=task,
        objective=[objective.name for objective in problem.objectives],
        fixed=problem.fixed,
        bounds={v.name: (v.low, v.high) for v in problem.variables},
        **asdict(problem.options),
    )
