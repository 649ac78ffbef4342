"""Nearby: the optima of solved tasks, and which of their basins is a new task's best.

Where a problem has many basins, the optima of tasks nearby lie in several of them, and nothing lies
between. The surrogate is descended from each of those optima; where that ends best, a plan begins.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from pkm_gym.agents.planner.slack import Local, least
from pkm_gym.agents.planner.surrogate import Surrogate
from pkm_gym.benchmark.interpolation import stretch, task_points
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import check_arrays
from pkm_gym.core.types import FloatArray

NEAREST = 24  # optima that are descended from
APART = 0.1  # of two basins, a share of the range: farther than a plan goes at first
REACH = 0.3  # how far such a descent leads at most, a share of the range
PRECISION = 1e-6  # of its end, in log merit
ARRAYS = ("points", "places")


@dataclass(frozen=True)
class Nearby:
    """The optima of solved tasks.

    Attributes:
        points: array (n, m), the tasks' points.
        places: array (n, d), their optima in the unit cube.
    """

    points: FloatArray
    places: FloatArray

    @classmethod
    def of_pool(cls, problem: DesignProblem, pool: Pool) -> Nearby:
        """Return the optima of a pool's solvable tasks."""
        kept = pool.only(pool.solvable)
        places = (kept.designs - problem.low) / (problem.high - problem.low)
        return cls(task_points(problem, kept.tasks), places)

    def of(self, points: FloatArray) -> FloatArray:
        """Return the optima (n, k, d) of the k tasks nearest to points (n, m).

        Near are tasks whose optima are: each coordinate counts as much as optima react to it.
        """
        count = min(NEAREST, len(self.points))
        found = self._tree.query(points * self._stretch, k=count)[1]
        return self.places[np.reshape(found, (len(points), count))]

    def tensors(self) -> dict[str, Any]:
        """Return all arrays by name, for a file."""
        return {f"nearby.{name}": getattr(self, name) for name in ARRAYS}

    @classmethod
    def of_tensors(cls, surrogate: Surrogate, tensors: Mapping[str, Any]) -> Nearby | None:
        """Return what ``tensors()`` returned, None where there is nothing of it.

        Raises:
            ValueError: in one sentence, for arrays that are missing or don't fit the problem.
        """
        if not any(name.startswith("nearby.") for name in tensors):
            return None
        d = len(surrogate.problem.low)
        sizes = {"points": len(surrogate.middle) - d, "places": d}
        check_arrays(tensors, {f"nearby.{name}": ("f", ("n", sizes[name])) for name in ARRAYS})
        return cls(*(tensors[f"nearby.{name}"].astype(float) for name in ARRAYS))

    @cached_property
    def _stretch(self) -> FloatArray:
        return stretch(self.points, self.places)

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self.points * self._stretch)


def new_basin(
    surrogate: Surrogate, nearby: Nearby, point: FloatArray, places: FloatArray, home: FloatArray
) -> FloatArray:
    """Return the place (d,) to which the best of the descents leads, away from places (n, d).

    Where none leads away from them, that is ``home`` (d,).
    """
    ends = [descend(surrogate, point, start) for start in nearby.of(point[None])[0]]
    new = [end for end in ends if (np.abs(places - end[0]).max(axis=1) > APART).all()]
    return min(new, key=lambda end: end[1], default=(home, 0.0))[0]


def descend(surrogate: Surrogate, point: FloatArray, start: FloatArray) -> tuple[FloatArray, float]:
    """Return the place (d,) where the surrogate's merit is least near a start (d,), and its price.

    Constraints are taken to be worse than the surrogate says by its typical error; what they are
    still broken by is priced.
    """
    errors = surrogate.errors_at(point)[1:, None]
    low, high = np.maximum(0.0, start - REACH), np.minimum(1.0, start + REACH)

    def expected(place: FloatArray) -> Local:
        values, slopes = (array[0] for array in surrogate.pieces(point, place[None]))
        worse = (values[1:] + errors).ravel()
        return Local(float(values[0, 0]), slopes[0, 0], worse, slopes[1:].reshape(-1, len(place)))

    return least(expected, start, low, high, slack=0.0, precision=PRECISION)
