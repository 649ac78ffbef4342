"""From a known design to the optimum near it, and the verified one."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from optuna import load_study
from rich.console import Console

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import SAME
from pkm_gym.core.solve import polish as polish_designs
from pkm_gym.core.solve import solve_tasks
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.report.rows import (
    SOLVED,
    UNCERTAIN,
    Row,
    in_full,
    optimum_row,
    recorded_optimum,
)
from pkm_gym.studies.storage.storages import exists, open_storage, study_names
from pkm_gym.studies.storage.studies import count_finished, designs_of, stands_for


def polish(problem: DesignProblem, designs: FloatArray) -> Evaluation:
    """Polish each design (n, d) and return the evaluation of the best that comes out, one design.

    The start counts too: the answer is never worse than the best of ``designs``.
    """
    polished = polish_designs(problem, designs, problem.pack(None)[None])
    best = problem.evaluate(polished).best()
    return problem.evaluate(polished[best : best + 1])


@lru_cache(maxsize=4)
def verified_optimum(problem: DesignProblem) -> Row | None:
    """Return the verified optimum of the problem and its task, or None where nothing is feasible.

    It is the reference's, where that holds one; otherwise it is solved now, and called uncertain
    unless two searches from different seeds agree to 1e-10 in log merit.
    """
    recorded = recorded_optimum(problem)
    if recorded is not None:
        return optimum_row(problem, recorded)
    solved = solve_tasks(problem, problem.pack(None)[None])
    if not solved.solvable[0]:
        return None
    name = SOLVED if solved.certified[0] else UNCERTAIN
    design = problem.named(solved.designs[0])
    return Row(name, float(solved.optima[0]), design, regret=0.0, feasible="yes")


def told_optimum(screen: Console, problem: DesignProblem) -> Row | None:
    """Return the verified optimum; the screen tells while it is solved."""
    with screen.status(f"solving the task of {problem.name} for its optimum"):
        return verified_optimum(problem)


def best_known(problem: DesignProblem, where: str) -> tuple[str, FloatArray]:
    """Return where the best design of a storage's studies of just this problem is from, and it.

    Without such a study it is the printed design, or the default one where there is no paper. The
    design is an array (1, d).
    """
    origin = "the printed design" if problem.reference else "the default design"
    best: dict[str, FloatArray] = {}
    if not exists(where):
        return origin, problem.printed_design()[None]
    storage = open_storage(where, create=False)
    for name in study_names(storage):
        study = load_study(study_name=name, storage=storage)
        if stands_for(study, problem) and count_finished(study):
            designs = designs_of(study, problem)
            best[name] = designs[problem.evaluate(designs).best()]
    if not best:
        return origin, problem.printed_design()[None]
    names, designs = list(best), np.array(list(best.values()))
    i = problem.evaluate(designs).best()
    return f"the best of the study {names[i]}", designs[i : i + 1]


def judged(polished: Row, optimum: Row | None) -> str:
    """Return a sentence on how a polished design compares with the verified optimum."""
    if optimum is None:
        return "no feasible design of this task is known"
    if optimum.note:
        return f"not compared with the recorded optimum: {optimum.note}"
    if polished.feasible != "yes":
        return "no feasible design lies near the start"
    if abs(polished.regret) <= SAME:
        return f"agrees with the {in_full(optimum)}"
    return f"{100 * polished.regret:.3g} % behind the {in_full(optimum)}"
