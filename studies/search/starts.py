"""Designs that a search starts from."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from optuna import Study

from pkm_gym.core.names import imported
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.grid.designs import grid_designs
from pkm_gym.studies.storage.storages import open_storage
from pkm_gym.studies.storage.studies import designs_of, load_study

WARM_STARTS = 10  # how many designs of a grid or a study a warm start takes over
PROPOSALS = "pkm_gym.agents.designers.sampler:proposals"  # of a trained designer: a higher room


def warm_designs(problem: DesignProblem, source: str, where: str) -> FloatArray:
    """Return the designs (n, d), within the bounds, that a search starts from.

    Args:
        problem: what is searched.
        source: "paper", "grid", "designer:N" or the name of a study.
        where: the storage of that study.

    Raises:
        ValueError: in one sentence, if there are none.
    """
    if source == "paper":
        if not problem.reference:
            raise ValueError(f"{problem.name} has no paper to start from: it prints no design")
        designs = problem.printed_design()[None]
    elif source == "grid":
        designs = grid_designs(problem)
    elif match := re.fullmatch(r"designer:(\d+)", source):
        return np.asarray(imported(PROPOSALS)(problem, int(match[1])))
    else:
        designs = designs_of(load_study(open_storage(where, create=False), source), problem)
    inside = designs[((designs >= problem.low) & (designs <= problem.high)).all(axis=1)]
    if len(inside) == 0:
        raise ValueError(f"no design of {source!r} lies within the search bounds")
    return inside[problem.evaluate(inside).ranking()[:WARM_STARTS]]


def enqueue(study: Study, problem: DesignProblem, starts: Sequence[FloatArray]) -> None:
    """Have a study try these designs (n, d) first, those that it doesn't have yet."""
    for design in [design for designs in starts for design in designs]:
        params = dict(zip(problem.variable_names, map(float, design), strict=True))
        study.enqueue_trial(params, skip_if_exists=True)
