"""Planner: proposes the design that is optimal by what is believed, and tries what is doubtful."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pkm_gym.agents.designers.memory import Memory
from pkm_gym.agents.planner.belief import Belief, believe, slopes_of_terms, terms
from pkm_gym.agents.planner.nearby import Nearby, new_basin
from pkm_gym.agents.planner.slack import Local, least
from pkm_gym.agents.planner.surrogate import Surrogate
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

# By how many deviations constraints are taken to be worse than expected, at each evaluation of a
# session, the last one for all later ones. Below zero they are taken to be better, and so is the
# merit: such an evaluation shows whether that is so.
CAUTION = (2.0, 1.0, -1.0, 1.0, -1.0, 1.0, 0.5, -1.0, 0.5, 0.5, 1.0)
CAUTION_UNSEEN = (2.0, 1.0, -2.0, -3.0, -4.0)  # about a piece that no evaluation has told of

TRUST = 0.05  # how far from the answer so far is searched, a share of the range
DISTRUST = 0.5  # by which that shrinks with each evaluation that brought no better answer
LOST = 0.02  # by which all break a constraint where another basin is tried
AFAR = 4.0  # shares of the range that are searched for each unit by which all break a constraint
FARTHEST = 0.5
CENTRES = 2  # times that the quadratics are moved to the design that they propose
IN_REACH = 6.0  # deviations below its limit, within which a piece may matter
INSIDE = 1e-12
PRECISION = 1e-13
ASIDE = (1e-3, 1e-2)  # starts of an optimistic search: at the centre its function has a cusp


@dataclass(frozen=True)
class Planner:
    """A policy that plans with a surrogate, corrected by the session's evaluations.

    Attributes:
        surrogate: of the problem.
        nearby: optima in whose basins a session may begin; None: it begins at its start.
    """

    surrogate: Surrogate
    nearby: Nearby | None = None

    def propose(self, memory: Memory) -> FloatArray:
        """Return the designs (n, d) to evaluate next, one for each session."""
        problem = self.surrogate.problem
        span = problem.high - problem.low
        places = [self._place(memory, row) for row in range(len(memory.tasks))]
        return np.clip(problem.low + span * np.array(places), problem.low, problem.high)

    def tensors(self) -> dict[str, Any]:
        """Return all arrays by name, for a file."""
        return self.surrogate.tensors() | (self.nearby.tensors() if self.nearby else {})

    def settings(self) -> dict[str, Any]:
        """Return what else a file has to hold."""
        return {"kind": "planner"}

    @classmethod
    def of_tensors(cls, problem: DesignProblem, tensors: Mapping[str, Any]) -> Planner:
        """Return the planner of what ``tensors()`` returned."""
        surrogate = Surrogate.of_tensors(problem, tensors)
        return cls(surrogate, Nearby.of_tensors(surrogate, tensors))

    def _place(self, memory: Memory, row: int) -> FloatArray:
        """Return the place (d,) in the unit cube that one session tries next."""
        problem, count = self.surrogate.problem, int(memory.evaluations[row])
        low, span = problem.low, problem.high - problem.low
        point = self.surrogate.point(memory.tasks[row])
        places = (memory.designs[row, :count] - low) / span
        told = self.surrogate.told(memory.log_merit[row, :count], memory.constraints[row, :count])
        home, began = (memory.answer.designs[row] - low) / span, count
        if self.nearby and _broken(told) > LOST:
            home, began = new_basin(self.surrogate, self.nearby, point, places, home), 0
        outputs = told if began else self.surrogate.pieces(point, home[None]).values.max(axis=2)
        failed = began - int(memory.improved[row]) if began else 0
        trust = max(TRUST * DISTRUST**failed, min(FARTHEST, AFAR * _broken(outputs)))
        bounds = np.maximum(0.0, home - trust), np.minimum(1.0, home + trust)
        centre, speakers = home, None
        for _ in range(CENTRES):
            belief = believe(self.surrogate, point, places, told, centre, speakers)
            speakers = belief.speakers
            centre = plan(belief, *bounds, _at(CAUTION, began), _at(CAUTION_UNSEEN, began))
        return centre


def plan(
    belief: Belief, low: FloatArray, high: FloatArray, caution: float, caution_unseen: float
) -> FloatArray:
    """Return the place (d,) within bounds (d,) that is optimal by a belief.

    A constraint that can't be kept is broken as little as possible.

    Args:
        belief: of the merit and the constraints.
        low: of the part of the unit cube that is searched.
        high: of it.
        caution: by how many deviations a constraint is taken to be worse than expected.
        caution_unseen: the same for pieces that no evaluation has told of.
    """
    centre, d = belief.centre, len(belief.centre)
    low, high = low - centre, high - centre
    mean, covariance, cautions = _constraints(belief, high - low, caution, caution_unseen)
    merit, doubt = belief.mean[0, 0], belief.covariance[0, 0]
    hope = max(0.0, -caution)

    def expected(way: FloatArray) -> Local:
        basis, slopes = terms(way), slopes_of_terms(way)
        doubted, reached = doubt @ basis, covariance @ basis
        deviation = np.sqrt(max(basis @ doubted, INSIDE**2))
        deviations = np.sqrt(np.maximum(reached @ basis, INSIDE**2))
        return Local(
            float(merit @ basis - hope * deviation),
            slopes @ (merit - hope * doubted / deviation),
            mean @ basis + cautions * deviations + INSIDE,
            (mean + (cautions / deviations)[:, None] * reached) @ slopes.T,
        )

    ends = [
        least(expected, np.clip(start, low, high), low, high, slack=ASIDE[0], precision=PRECISION)
        for start in _starts(d, hope)
    ]
    place: FloatArray = centre + min(ends, key=lambda end: end[1])[0]
    return place


def _constraints(
    belief: Belief, width: FloatArray, caution: float, caution_unseen: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return mean (q, terms), covariance and caution of the pieces that may matter."""
    size = belief.mean.shape[-1]
    mean = belief.mean[1:].reshape(-1, size)
    covariance = belief.covariance[1:].reshape(-1, size, size)
    highest = mean[:, 0] + np.abs(mean[:, 1:]) @ np.abs(terms(width))[1:]
    matters = highest > -IN_REACH * np.sqrt(np.maximum(covariance[:, 0, 0], 0.0))
    cautions = np.where(belief.seen[1:].ravel(), caution, caution_unseen)
    return mean[matters], covariance[matters], cautions[matters]


def _starts(d: int, hope: float) -> list[FloatArray]:
    if not hope:
        return [np.zeros(d)]
    generator = np.random.default_rng(0)
    return [generator.uniform(-way, way, d) for way in ASIDE]


def _broken(outputs: FloatArray) -> float:
    """Return by how much all designs with such outputs (n, outputs) break a constraint at least."""
    worst = np.nan_to_num(outputs[:, 1:], nan=np.inf).max(axis=1, initial=0.0)
    return float(worst.min(initial=np.inf))


def _at(schedule: tuple[float, ...], count: int) -> float:
    return schedule[min(count, len(schedule) - 1)]
