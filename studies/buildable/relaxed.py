"""The optimum where some dimensions are held: from where a lattice is searched."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from pkm_gym.core.merit import CAP
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.buildable.dimensions import Dimensions

STEP = 1e-6  # of a coordinate's size, of finite differences
SMALLEST = 1e-3  # m or rad, of a coordinate's size
ITERATIONS = 60
CONVERGED = 1e-9
NEWTON = 3  # steps


class _Relaxation:
    """Log objective, settled task fields and limits over the coordinates that are moved."""

    def __init__(self, dimensions: Dimensions, start: FloatArray, moved: list[int]) -> None:
        self._dimensions, self._start, self._moved = dimensions, start, moved
        self._size = np.maximum(np.abs(start[moved]), SMALLEST)
        fields = dimensions.problem.task_type.names()
        self._columns = np.array([fields.index(n) for n in dimensions.settled], dtype=np.intp)
        self._asked = np.array([*dimensions.settled.values()])
        self.begin = start[moved] / self._size
        self._keep_moving()
        self.split = 1 + len(self._columns)
        self.at = lru_cache(maxsize=4)(self._at)

    def _keep_moving(self) -> None:
        """Leave out the settled fields that nothing which is moved changes."""
        slopes = self._at(self.begin.tobytes())[1][1 : 1 + len(self._columns)]
        moving = (np.abs(slopes) > 0.0).any(axis=1)
        self._columns, self._asked = self._columns[moving], self._asked[moving]

    def points(self, scaled: FloatArray) -> FloatArray:
        """Return the points (n, k) of what is moved (n, moved), in shares of its size."""
        full = np.repeat(self._start[None], len(scaled), axis=0)
        full[:, self._moved] = scaled * self._size
        return self._dimensions.followed(full)

    def _values(self, scaled: FloatArray) -> FloatArray:
        problem = self._dimensions.problem
        evaluation = self._dimensions.evaluate(self.points(scaled))
        first, span = problem.objectives[0], problem.high - problem.low
        with np.errstate(invalid="ignore", divide="ignore"):
            log = first.sign * np.log(first.offset + evaluation.objectives[:, 0])
        settled = evaluation.tasks[:, self._columns] - self._asked
        low, high = self._dimensions.box()
        outside = np.maximum(low - evaluation.designs, evaluation.designs - high) / span
        return np.column_stack(
            [
                np.where(np.isfinite(log), log, CAP),
                settled,
                evaluation.constraints,
                np.nan_to_num(outside, nan=1.0),
            ]
        )

    def exact(self, x: FloatArray) -> FloatArray:
        """Return the place (moved,) next to one at which the settled task fields are exact."""
        settled = slice(1, self.split)
        for _ in range(NEWTON if self.split > 1 else 0):
            values, slopes = self.at(x.tobytes())
            if not np.isfinite(values).all() or not np.isfinite(slopes[settled]).all():
                return x
            x = x - np.linalg.lstsq(slopes[settled], values[settled], rcond=1e-9)[0]
        return x

    def _at(self, place: bytes) -> tuple[FloatArray, FloatArray]:
        """Return the values (p,) and slopes (p, moved) at a place."""
        x = np.frombuffer(place)
        rows = self._values(np.concatenate([x[None], x + STEP * np.eye(len(x))]))
        # in one piece: SLSQP misreads a view with strides
        return rows[0], np.ascontiguousarray(((rows[1:] - rows[0]) / STEP).T)


def relaxed(
    dimensions: Dimensions, begin: FloatArray, held: Mapping[int, float], room: float = 0.0
) -> FloatArray:
    """Return about where (k,) the objective is best with some coordinates held.

    SciPy's SLSQP over the others, for the task that is asked for. Limits have kinks, so it is a
    place to start from, no optimum; where SLSQP fails, it is the start with the held values in it.

    Args:
        dimensions: the coordinates.
        begin: array (k,), a start.
        held: coordinate -> value.
        room: that is kept to every limit, scaled as the constraints are.
    """
    from scipy.optimize import minimize

    start = begin.copy()
    start[list(held)] = list(held.values())
    moved = [
        k for k, n in enumerate(dimensions.names) if n in dimensions.searched and k not in held
    ]
    if not moved:
        return dimensions.followed(start[None])[0]
    problem = _Relaxation(dimensions, start, moved)
    settled, limits = slice(1, problem.split), slice(problem.split, None)
    result = minimize(  # type: ignore[call-overload]  # its stubs know no dictionary of functions
        lambda x: problem.at(x.tobytes())[0][0],
        problem.begin,
        jac=lambda x: problem.at(x.tobytes())[1][0],
        method="SLSQP",
        constraints=[
            {
                "type": "eq",
                "fun": lambda x: problem.at(x.tobytes())[0][settled],
                "jac": lambda x: problem.at(x.tobytes())[1][settled],
            },
            {
                "type": "ineq",
                "fun": lambda x: -room - problem.at(x.tobytes())[0][limits],
                "jac": lambda x: -problem.at(x.tobytes())[1][limits],
            },
        ][0 if problem.split > 1 else 1 :],
        options={"maxiter": ITERATIONS, "ftol": CONVERGED},
    )
    end = problem.points(problem.exact(np.array(result.x))[None])
    usable = np.isfinite(end).all() and np.isfinite(dimensions.designs(end)[0]).all()
    return np.asarray(end[0] if usable else dimensions.followed(start[None])[0])
