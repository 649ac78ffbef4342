"""The shipped designers as methods of the benchmark."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pkm_gym.agents.designers.designer import Designer
from pkm_gym.agents.designers.library import ZOO, designer_for, trained_for
from pkm_gym.benchmark.methods import Search, method
from pkm_gym.benchmark.record import Cost
from pkm_gym.benchmark.session import Session
from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import View
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.mechanisms import family_problem

ONLY = np.arange(1)


def training_cost(name: str) -> Cost:
    """Return what it cost to train the shipped designer of a problem; its time isn't recorded."""
    return Cost(trained_for(family_problem(name))[1].steps, np.nan)


def files(_name: str) -> list[Path]:
    """Return the files of the shipped designers, and those of what plans with them."""
    return [*sorted(ZOO.glob("*.*")), *sorted(ZOO.with_name("planner").glob("*.py"))]


@method(knowledge="transfer", training=training_cost, files=files)
def designer(view: View, _training: Training) -> Search:
    """Ask the shipped designer of the problem, until its own budget is spent."""
    return session_search(designer_for(family_problem(view.problem)))


def session_search(trained: Designer) -> Search:
    """Return the search that evaluates what a designer proposes."""

    def search(session: Session) -> None:
        memory = trained.open(session.task[None])
        while memory.left[0]:
            told = session.evaluate(trained.propose(memory))
            known = told.designs, session.task, told.values, told.constraints, told.log_merit
            memory.record(ONLY, Evaluation.remembered(trained.problem, *known))

    return search
