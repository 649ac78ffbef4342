"""What an environment says of a step beside the observation, for one session or for n.

The content is built once, for the k sessions concerned, as a nested dictionary whose leaves are
arrays (k,), NaN where a number is undefined, or words that hold for all of them. ``single`` turns
it into the info of one environment, ``merge`` into that of a vector environment; both leave
undefined numbers out.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from math import isnan
from typing import Any

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Index
from pkm_gym.core.task import TaskVariable, Variable
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.envs.session import Rows, Session

Info = dict[str, Any]


def reset_info(session: Session, rows: Rows) -> Info:
    """Return what a reset says: the task, and the start as the best design."""
    problem = session.problem
    return {
        "task": _columns(problem.task_type.names(), session.tasks[rows]),
        "best_design": _named(problem, session.best.designs[rows]),
        "units": _units(problem.task_variables, problem.all_variables),
    }


def step_info(session: Session, rows: Rows, evaluation: Evaluation) -> Info:
    """Return what a step says: the design that was evaluated, the best one and the answer."""
    problem, answer = session.problem, session.answer
    return {
        "design": _named(problem, evaluation.designs),
        "indices": dict(evaluation.indices),
        "constraints": _columns(problem.constraint_names, evaluation.constraints),
        "feasible": evaluation.feasible,
        "merit": evaluation.merit,
        "best_design": _named(problem, session.best.designs[rows]),
        "answer": {
            "design": _named(problem, answer.designs[rows]),
            "objective": answer.values[rows],
            "merit": np.exp(answer.log_merit[rows]),
            "feasible": answer.feasible[rows],
        },
        "units": _units(problem.all_variables, problem.index_table),
    }


def single(info: Info) -> Info:
    """Return the info of the only session as plain numbers."""
    plain: Info = {}
    for name, value in info.items():
        if isinstance(value, dict):
            plain[name] = single(value)
        elif isinstance(value, str):
            plain[name] = value
        elif not isnan(number := value.item()):
            plain[name] = number
    return plain


def merge(infos: Info, info: Info, rows: Rows, n: int) -> Info:
    """Write the info of some of n sessions into ``infos``, laid out as Gymnasium lays it out.

    Each name has an array (n,) and beside it, under the name with an underscore before it, a mask
    (n,) of the sessions that have a value.
    """
    for name, value in info.items():
        having = rows
        if isinstance(value, dict):
            infos[name] = merge(infos.get(name, {}), value, rows, n)
        elif isinstance(value, str):
            infos.setdefault(name, np.full(n, None, dtype=object))[rows] = value
        else:
            defined = ~np.isnan(value)
            having = rows[defined]
            if len(having) == 0:
                continue
            infos.setdefault(name, np.zeros(n, dtype=value.dtype))[having] = value[defined]
        infos.setdefault(f"_{name}", np.zeros(n, dtype=np.bool_))[having] = True
    return infos


def select(info: Info, kept: BoolArray) -> Info:
    """Return the info of the sessions that are kept, a mask (k,)."""
    selected: Info = {}
    for name, value in info.items():
        if isinstance(value, dict):
            selected[name] = select(value, kept)
        else:
            selected[name] = value if isinstance(value, str) else value[kept]
    return selected


def _columns(names: Iterable[str], table: FloatArray) -> Info:
    return dict(zip(names, table.T, strict=True))


def _named(problem: DesignProblem, designs: FloatArray) -> Info:
    return _columns((v.name for v in problem.all_variables), problem.complete(designs))


def _units(*named: Iterable[Variable | TaskVariable | Index]) -> Info:
    return {item.name: item.unit for item in chain.from_iterable(named)}
