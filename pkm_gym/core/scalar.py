"""Several objectives as one number: the front that they leave, and three ways to weigh them.

A *loss* is an objective times its sign, so that less is better. Each way is a plain callable:
losses (n, k) in, one number (n,) out, smaller is better.

    weighted     sum of w_i e_i,               e_i = (loss_i - aim_i) / width_i
    tolerance    sqrt(sum of (mu_i e_i)^2),    e_i = loss_i - aim_i,  mu_i = 1 / tolerance_i
    pca          minus F, the composite of ``pkm_gym.core.composite``

``tolerance`` is lambda of Wang, Jin and Li (2019), eqs (22)-(25), where the aims are 0 and a
tolerance is half of what an index varies by. Here the aim is the best loss on the front if none is
given, so that an index that is maximised can take part.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from pkm_gym.core.composite import Composite, Direction, composite
from pkm_gym.core.types import BoolArray, FloatArray


class Scalarisation(Protocol):
    """A way to weigh objectives: losses (n, k) to numbers (n,), smaller is better."""

    @property
    def name(self) -> str:
        """What it is called."""

    def __call__(self, losses: FloatArray) -> FloatArray:
        """Return a number for each row of losses."""


@dataclass(frozen=True, eq=False)
class Weighted:
    """A weighted sum of losses, each measured from its aim in its width; arrays (k,)."""

    weights: FloatArray
    aims: FloatArray
    widths: FloatArray
    name: str = "weighted"

    def __call__(self, losses: FloatArray) -> FloatArray:
        """Return the sums (n,) of losses (n, k)."""
        return np.asarray(((losses - self.aims) / self.widths) @ self.weights)


@dataclass(frozen=True, eq=False)
class Tolerance:
    """The length of the vector of losses, each measured from its aim in its tolerance."""

    tolerances: FloatArray
    aims: FloatArray
    name: str = "tolerance"

    def __call__(self, losses: FloatArray) -> FloatArray:
        """Return the lengths (n,) of losses (n, k)."""
        return np.asarray(np.linalg.norm((losses - self.aims) / self.tolerances, axis=-1))


@dataclass(frozen=True, eq=False)
class Pca:
    """The composite of a population, turned over; ``signs`` (k,) turn losses into values again."""

    of: Composite
    signs: FloatArray
    name: str = "pca"

    def __call__(self, losses: FloatArray) -> FloatArray:
        """Return -F (n,) of losses (n, k)."""
        return -self.of.scores(losses * self.signs)


def weighted(front: FloatArray, weights: npt.ArrayLike) -> Weighted:
    """Return the weighted sum whose aims and widths are those of a front's losses (n, k).

    Raises:
        ValueError: for weights that aren't k numbers >= 0, one of them > 0.
    """
    given = _numbers("weights", weights, front)
    if (given < 0.0).any() or not (given > 0.0).any():
        raise ValueError(f"the weights are {given.tolist()}: none may be negative, nor all be 0")
    return Weighted(given, front.min(axis=0), _widths(front))


def tolerance(
    front: FloatArray,
    tolerances: npt.ArrayLike | None = None,
    aims: npt.ArrayLike | None = None,
) -> Tolerance:
    """Return the length whose tolerances are half of what a front's losses (n, k) vary by.

    Args:
        front: losses (n, k).
        tolerances: other ones (k,), > 0, in the objectives' units.
        aims: losses (k,) to measure from; the best of the front if not given.

    Raises:
        ValueError: for another number of them, or a tolerance that isn't > 0.
    """
    half = 0.5 * _widths(front) if tolerances is None else _numbers("tolerances", tolerances, front)
    if (half <= 0.0).any():
        raise ValueError(f"the tolerances are {half.tolist()}: each must be > 0")
    return Tolerance(half, front.min(axis=0) if aims is None else _numbers("aims", aims, front))


def pca(losses: FloatArray, names: tuple[str, ...], signs: FloatArray, population: str) -> Pca:
    """Return the composite of a population's losses (n, k); see ``composite`` for what it refuses.

    Args:
        losses: of each member, such as the feasible designs of a study.
        names: of the objectives.
        signs: array (k,), +1 where an objective is minimised and -1 where it is maximised.
        population: what the rows are, in words.
    """
    ways: list[Direction] = ["minimise" if sign > 0.0 else "maximise" for sign in signs]
    return Pca(composite(losses * signs, names, directions=ways, population=population), signs)


def non_dominated(losses: FloatArray) -> BoolArray:
    """Return which of n rows of losses (n, k) no other row beats: none better, one less.

    Rows that are equal are kept together.

    Raises:
        ValueError: for a loss that isn't finite.
    """
    if not np.isfinite(losses).all():
        raise ValueError("a front is of finite numbers: leave out designs with an undefined index")
    kept: list[int] = []
    for i in np.lexsort(losses.T[::-1]):  # whatever beats a row stands before it
        front, row = losses[kept], losses[i]
        if not ((front <= row).all(axis=1) & (front < row).any(axis=1)).any():
            kept.append(int(i))
    mask = np.zeros(len(losses), dtype=np.bool_)
    mask[kept] = True
    return mask


def spread(losses: FloatArray, count: int) -> list[int]:
    """Return ``count`` rows of a front's losses (n, k) that lie far from each other, in order.

    The best of each loss come first into it, then always the one farthest from all chosen.
    """
    places = (losses - losses.min(axis=0)) / _widths(losses)
    chosen = list(dict.fromkeys(losses.argmin(axis=0).tolist()))[:count]
    while len(chosen) < min(count, len(losses)):
        apart = np.linalg.norm(places[:, None] - places[chosen], axis=2).min(axis=1)
        chosen.append(int(apart.argmax()))
    return sorted(chosen)


def _widths(front: FloatArray) -> FloatArray:
    """Return what losses vary by, 1 where they don't."""
    widths = np.ptp(front, axis=0)
    return np.where(widths > 0.0, widths, 1.0)


def _numbers(what: str, given: npt.ArrayLike, front: FloatArray) -> FloatArray:
    array = np.asarray(given, dtype=np.float64)
    if array.shape != front.shape[1:] or not np.isfinite(array).all():
        raise ValueError(f"{what} are {array.tolist()}: give {front.shape[1]} finite numbers")
    return array
