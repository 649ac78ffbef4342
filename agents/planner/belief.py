"""Belief: what a surrogate and the evaluations of a session say together, near a place.

Near a place each piece of the surrogate is a quadratic. Its coefficients are uncertain, each by
itself, by as much as the surrogate errs; every evaluation tells the value of the largest piece of
each output. What is believed then is Bayesian linear regression.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from pkm_gym.agents.planner.evidence import Evidence
from pkm_gym.agents.planner.surrogate import IntArray, Pieces, Surrogate
from pkm_gym.core.types import BoolArray, FloatArray

REACH = (0.02, 0.05)  # over which way an error of the value becomes one of slope, this of curvature
STEP = 1e-4  # of the differences of slopes
EXACT = 1e-8  # deviation of a value that is told
FAR = 0.1  # way over which the cubic terms become as large as the error


@dataclass(frozen=True)
class Belief:
    """Quadratics about a centre, with their uncertainty.

    Attributes:
        centre: array (d,), a place of the unit cube.
        mean: array (outputs, pieces, terms), coefficients of ``terms``.
        covariance: array (outputs, pieces, terms, terms).
        speakers: array (n, outputs), the piece that each evaluation told of; -1 where of none.
    """

    centre: FloatArray
    mean: FloatArray
    covariance: FloatArray
    speakers: IntArray

    @property
    def seen(self) -> BoolArray:
        """Array (outputs, pieces), whether an evaluation told of the piece."""
        pieces = np.arange(self.mean.shape[1])
        return np.asarray((self.speakers[:, :, None] == pieces).any(axis=0))


def believe(
    surrogate: Surrogate,
    point: FloatArray,
    places: FloatArray,
    told: FloatArray,
    centre: FloatArray,
    speakers: IntArray | None = None,
) -> Belief:
    """Return what is believed near a centre (d,), of a task's point (m,).

    Args:
        surrogate: what was trained before.
        point: of the task.
        places: array (n, d), what was evaluated.
        told: array (n, outputs), what the evaluations said; NaN where nothing.
        centre: about which the quadratics are.
        speakers: array (n, outputs), which piece told it; None: the likeliest one.
    """
    mean = expansion(surrogate, point, centre)
    f, k, t = mean.shape
    errors = surrogate.errors_at(point)
    deviation = np.outer(errors, _growth(len(centre)))  # (outputs, terms)
    covariance = np.broadcast_to((deviation**2)[:, None, :, None] * np.eye(t), (f, k, t, t)).copy()
    spoke = np.full(told.shape, -1) if speakers is None else speakers
    if not len(places):
        return Belief(centre, mean, covariance, spoke)
    values = surrogate.pieces(point, places).values
    offsets = places - centre
    cubic = (np.linalg.norm(offsets, axis=1) / FAR) ** 3
    for j in range(f):
        rows = np.flatnonzero(np.isfinite(told[:, j]))
        evidence = Evidence(
            terms(offsets[rows]), told[rows, j], values[rows, j], deviation[j] ** 2,
            (EXACT + errors[j] * cubic[rows]) ** 2,
        )  # fmt: skip
        if speakers is None:
            spoke[rows, j] = evidence.speakers()
        for piece in range(k if j else 1):
            shift, covariance[j, piece] = evidence.posterior(spoke[rows, j] == piece, piece)
            mean[j, piece] += shift
    return Belief(centre, mean, covariance, spoke)


def expansion(surrogate: Surrogate, point: FloatArray, centre: FloatArray) -> FloatArray:
    """Return the coefficients (outputs, pieces, terms) of the surrogate's pieces about a centre."""
    d = len(centre)
    around = np.r_[centre[None], centre + STEP * np.eye(d), centre - STEP * np.eye(d)]
    at: Pieces = surrogate.pieces(point, around)
    curvature = (at.slopes[1 : 1 + d] - at.slopes[1 + d :]) / (2.0 * STEP)  # (d, f, k, d)
    i, j = _pairs(d)
    both = 0.5 * (curvature[i, ..., j] + curvature[j, ..., i])  # (pairs, f, k)
    whole: FloatArray = np.concatenate(
        [at.values[0][..., None], at.slopes[0], np.moveaxis(both, 0, -1)], axis=-1
    )
    return whole


def terms(offsets: FloatArray) -> FloatArray:
    """Return 1, the coordinates and their products, squares halved: (..., terms)."""
    i, j = _pairs(offsets.shape[-1])
    products = offsets[..., i] * offsets[..., j] * np.where(i == j, 0.5, 1.0)
    return np.concatenate([np.ones((*offsets.shape[:-1], 1)), offsets, products], axis=-1)


def slopes_of_terms(offset: FloatArray) -> FloatArray:
    """Return the derivatives (d, terms) of the terms at an offset (d,)."""
    d = len(offset)
    i, j = _pairs(d)
    pairs = np.arange(len(i))
    products = np.zeros((d, len(i)))
    products[i, pairs] = offset[j]
    products[j, pairs] += np.where(i == j, 0.0, offset[i])
    return np.concatenate([np.zeros((d, 1)), np.eye(d), products], axis=1)


@cache
def _pairs(d: int) -> tuple[IntArray, IntArray]:
    return np.triu_indices(d)


def _growth(d: int) -> FloatArray:
    """Return how much larger than the value's error that of each term may be."""
    slope, curvature = 1.0 / REACH[0], 1.0 / (REACH[0] * REACH[1])
    return np.r_[1.0, np.full(d, slope), np.full(d * (d + 1) // 2, curvature)]
