"""Descent from many starts: the search of a task's optimum where gradients lead to it.

A problem's ``pieces`` are its limits taken apart, so that each of them is smooth: a maximum over
points of a workspace has kinks, the limit at each point has none. SciPy's SLSQP gets those that
matter near the iterate, and those that its answer breaks until it breaks none (an exchange method).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from pkm_gym.core.evolution import INSIDE, Search, gather
from pkm_gym.core.merit import TOLERANCE
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray

STEP = 1e-7  # of the unit box, of finite differences
DRAWN = 32  # designs that are drawn for each start
WORKING = 24  # pieces that a descent begins with, at least; as many join in an exchange
EXCHANGES = 12
ITERATIONS = 120
CONVERGED = 1e-13  # where searches must agree
ENOUGH = 1e-10  # where there is one, but in its polish
GATHERED = 0.15  # a share of the range: how far a descent from a gathered start may go
ROOM = 1e-10  # that is kept to every limit, for rounding

Values = Callable[[FloatArray], FloatArray]


def descend(
    problem: DesignProblem,
    tasks: FloatArray,
    generator: np.random.Generator,
    *,
    near: FloatArray | None = None,
    radius: float = 1.0,
    effort: int = 0,
) -> Search:
    """Descend from as many starts a task as the problem declares, twice as many each ``effort``.

    Drawn, or gathered by an evolution on the cheaper problem that its ``coarse`` options make.
    From the designs ``near`` (n, d), one a task, if they are given; ``radius`` (a share of the
    range) is then how far a descent may go.
    """
    n, d = len(tasks), len(problem.variables)
    found = Search(np.empty((n, d)), np.empty(n), np.empty(n, dtype=bool))
    coarse = problem.declared.coarse if near is None else {}
    cheap = problem.with_task(None, **coarse) if coarse else None
    count = 2**effort * problem.declared.starts
    enough = ENOUGH if problem.declared.searches == 1 and near is None else CONVERGED
    for k, (task, own) in enumerate(zip(tasks, generator.spawn(n), strict=True)):
        if near is not None:
            starts = near[k : k + 1]
        elif cheap is not None:
            starts, evaluations = gather(cheap, task, own, count, effort=effort)
            found.evaluations += evaluations
        else:
            starts = _starts(problem, task, own, count, found)
        reach = (GATHERED if cheap else radius) * (problem.high - problem.low)
        ends = np.stack(
            [
                _descent(
                    problem, task, start, np.maximum(problem.low, start - reach),
                    np.minimum(problem.high, start + reach), found, enough,
                )
                for start in starts
            ]
        )  # fmt: skip
        _keep(problem, task, np.concatenate([ends, starts]), found, k)
    return found


def _starts(
    problem: DesignProblem,
    task: FloatArray,
    generator: np.random.Generator,
    count: int,
    found: Search,
) -> FloatArray:
    """Draw designs (count, d) whose indices are defined, or else of the lowest merit."""
    span = problem.high - problem.low
    drawn = problem.low + span * generator.random((DRAWN * count, len(span)))
    evaluation = problem.evaluate(drawn, np.repeat(task[None], len(drawn), axis=0))
    found.evaluations += len(drawn)
    undefined = evaluation.unreached > 0.0
    enough = int((~undefined).sum()) >= count
    order = np.argsort(undefined, kind="stable") if enough else np.argsort(evaluation.log_merit)
    return np.asarray(drawn[order[:count]])


def _keep(
    problem: DesignProblem, task: FloatArray, designs: FloatArray, found: Search, k: int
) -> None:
    """Keep the best of a task's designs (n, d): strictly feasible, else of the lowest merit."""
    evaluation = problem.evaluate(designs, np.repeat(task[None], len(designs), axis=0))
    found.evaluations += len(designs)
    inside = np.asarray((evaluation.constraints <= INSIDE).all(axis=1))
    at = int(np.lexsort((evaluation.log_merit, ~inside))[0])
    found.designs[k], found.log_merit[k] = designs[at], evaluation.log_merit[at]
    found.solvable[k] = inside[at]


def _descent(
    problem: DesignProblem,
    task: FloatArray,
    start: FloatArray,
    low: FloatArray,
    high: FloatArray,
    found: Search,
    enough: float,
) -> FloatArray:
    """Return where a descent from a start (d,) within low and high (d,) ends."""
    span = high - low

    def values(unit: FloatArray) -> FloatArray:
        found.evaluations += len(unit)
        designs = np.clip(low + span * unit, problem.low, problem.high)
        return problem.pieces(designs, task[None])

    x = np.clip((start - low) / span, 0.0, 1.0)
    limits = values(x[None])[0, 1:]
    working = np.zeros(len(limits), dtype=bool)
    working[_largest(limits)] = True
    for _ in range(EXCHANGES):
        x = _slsqp(_Memory(values), x, working, enough)
        limits = values(x[None])[0, 1:]
        broken = (limits > TOLERANCE - 0.5 * ROOM) & ~working
        if not broken.any():
            break
        working[_largest(np.where(working, -np.inf, limits))] = True
    return np.asarray(np.clip(low + span * x, problem.low, problem.high))


def _largest(limits: FloatArray) -> npt.NDArray[np.intp]:
    return np.argsort(-limits)[:WORKING]


class _Memory:
    """Values of the pieces at the point that was asked for last, and gradients if it was asked."""

    def __init__(self, values: Values) -> None:
        self._values = values
        self._x: FloatArray | None = None
        self.values = self._gradients = np.empty(0)

    def at(self, x: FloatArray) -> _Memory:
        """Take the values (p,) at a point (d,) of the unit box."""
        if self._x is None or not np.array_equal(x, self._x):
            self._x, self.values, self._gradients = x.copy(), self._values(x[None])[0], np.empty(0)
        return self

    @property
    def gradients(self) -> FloatArray:
        """The gradients (p, d) there: a step that a line search refuses needs none."""
        if not self._gradients.size and self._x is not None:
            step = np.where(self._x > 0.5, -STEP, STEP)
            rows = self._values(self._x + np.diag(step))
            # in one piece: SLSQP misreads a view with strides
            self._gradients = np.ascontiguousarray(((rows - self.values) / step[:, None]).T)
        return self._gradients


def _slsqp(memory: _Memory, x: FloatArray, working: BoolArray, enough: float) -> FloatArray:
    """Return the point (d,) of the unit box that SLSQP finds with some of the limits."""
    from scipy.optimize import minimize

    limits: dict[str, Any] = {
        "type": "ineq",
        "fun": lambda x: TOLERANCE - ROOM - memory.at(x).values[1:][working],
        "jac": lambda x: -memory.at(x).gradients[1:][working],
    }
    result = minimize(  # type: ignore[call-overload]  # its stubs know no dictionary of functions
        lambda x: memory.at(x).values[0],
        x,
        jac=lambda x: memory.at(x).gradients[0],
        method="SLSQP",
        bounds=[(0.0, 1.0)] * len(x),
        constraints=[limits],
        options={"maxiter": ITERATIONS, "ftol": enough},
    )
    end = result.x
    return np.clip(end, 0.0, 1.0) if np.isfinite(end).all() else x
