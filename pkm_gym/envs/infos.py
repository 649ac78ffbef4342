"""What an environment says beside the observation, for one session or for n.

The content is built once, for the k sessions concerned, as a nested dictionary whose leaves are
arrays (k,), or words that hold for all of them. ``single`` turns it into the info of one
environment, ``merge`` into that of a vector environment. Its keys and types never change, as
Minari needs them, and nothing is NaN, which equals nothing: what isn't known is infinite.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import chain
from typing import Any

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.rows import Index
from pkm_gym.core.task import TaskVariable, Variable
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.envs.session import Rows, Session

Info = dict[str, Any]


def session_info(session: Session, rows: Rows, evaluation: Evaluation | None) -> Info:
    """Return what is said after a step that evaluated designs, or after a reset, which did not."""
    problem, answer = session.problem, session.answer
    indices, constraints, defined = _measured(problem, len(rows), evaluation)
    return {
        "task": _columns(problem.task_type.names(), session.tasks[rows]),
        "design": _named(problem, session.last[rows]),
        "indices": indices,
        "defined": defined,
        "constraints": constraints,
        "feasible": np.zeros(len(rows), dtype=bool) if evaluation is None else evaluation.feasible,
        "merit": np.full(len(rows), np.inf) if evaluation is None else evaluation.merit,
        "best_design": _named(problem, session.best.designs[rows]),
        "answer": {
            "design": _named(problem, answer.designs[rows]),
            "objective": _known(answer.values[rows]),
            "merit": np.exp(answer.log_merit[rows]),
            "feasible": answer.feasible[rows],
        },
        "units": _units(problem.task_variables, problem.all_variables, problem.index_table),
    }


def single(info: Info) -> Info:
    """Return the info of the only session as plain numbers."""
    plain: Info = {}
    for name, value in info.items():
        if isinstance(value, dict):
            plain[name] = single(value)
        else:
            plain[name] = value if isinstance(value, str) else value.item()
    return plain


def merge(infos: Info, info: Info, rows: Rows, n: int) -> Info:
    """Write the info of some of n sessions into ``infos``, laid out as Gymnasium lays it out.

    Each name has an array (n,) and beside it, under the name with an underscore before it, a mask
    (n,) of the sessions that have a value.
    """
    for name, value in info.items():
        if isinstance(value, dict):
            infos[name] = merge(infos.get(name, {}), value, rows, n)
        else:
            kind = object if isinstance(value, str) else value.dtype
            blank = None if isinstance(value, str) else 0
            infos.setdefault(name, np.full(n, blank, dtype=kind))[rows] = value
        infos.setdefault(f"_{name}", np.zeros(n, dtype=np.bool_))[rows] = True
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


def _measured(
    problem: DesignProblem, k: int, evaluation: Evaluation | None
) -> tuple[Info, Info, Info]:
    """Return indices, constraints and which indices are defined, of k sessions."""
    if evaluation is None:
        unknown, no = np.full(k, np.inf), np.zeros(k, dtype=np.bool_)
        names = problem.index_names
        constraints = dict.fromkeys(problem.constraint_names, unknown)
        return dict.fromkeys(names, unknown), constraints, dict.fromkeys(names, no)
    indices = {name: _known(values) for name, values in evaluation.indices.items()}
    defined = {name: ~np.isnan(values) for name, values in evaluation.indices.items()}
    return indices, _columns(problem.constraint_names, evaluation.constraints), defined


def _known(values: FloatArray) -> FloatArray:
    return np.where(np.isnan(values), np.inf, values)


def _columns(names: Iterable[str], table: FloatArray) -> Info:
    return dict(zip(names, table.T, strict=True))


def _named(problem: DesignProblem, designs: FloatArray) -> Info:
    return _columns((v.name for v in problem.all_variables), problem.complete(designs))


def _units(*named: Iterable[Variable | TaskVariable | Index]) -> Info:
    return {item.name: item.unit for item in chain.from_iterable(named)}
