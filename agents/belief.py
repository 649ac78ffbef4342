"""Belief: what a surrogate and the evaluations of a session say together, near a place.

Near a place each piece of the surrogate is a quadratic. Its coefficients are uncertain, each by
itself, by as much as the surrogate errs; every evaluation tells the value of the largest piece of
each output. What is believed then is Bayesian linear regression.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from scipy.special import log_ndtr

from pkm_gym.agents.surrogate import IntArray, Pieces, Surrogate
from pkm_gym.core.types import BoolArray, FloatArray

REACH = (0.02, 0.05)  # over which way an error of the value becomes one of slope, this of curvature
STEP = 1e-4  # of the differences of slopes
EXACT = 1e-8  # deviation of a value that is told
FAR = 0.1  # way over which the cubic terms become as large as the error
CANDIDATE = 6.0  # deviations below the largest, within which a piece may have been the largest
PASSES = 4
CERTAIN = 3.0  # deviations below what was told, from which on that is no news
LEAST_ROOM = 1e4  # deviations; beyond it the logarithms lose their digits
HALF_LOG_2PI = 0.5 * np.log(2.0 * np.pi)


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
        surrogate: what was learned before.
        point: of the task.
        places: array (n, d), what was evaluated.
        told: array (n, outputs), what the evaluations said; NaN where nothing.
        centre: about which the quadratics are.
        speakers: array (n, outputs), which piece told it; None: the likeliest one.
    """
    mean = expansion(surrogate, point, centre)
    f, k, t = mean.shape
    deviation = np.outer(surrogate.errors, _growth(len(centre)))  # (outputs, terms)
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
            (EXACT + surrogate.errors[j] * cubic[rows]) ** 2,
        )  # fmt: skip
        if speakers is None:
            spoke[rows, j] = evidence.speakers()
        for piece in range(k if j else 1):
            shift, covariance[j, piece] = evidence.posterior(spoke[rows, j] == piece, piece)
            mean[j, piece] += shift
    return Belief(centre, mean, covariance, spoke)


@dataclass(frozen=True)
class Evidence:
    """What n evaluations told of one output.

    Attributes:
        basis: array (n, terms).
        told: array (n,).
        values: array (n, pieces), as the surrogate has them.
        variance: array (terms,), of the coefficients of what the surrogate errs by.
        noise: array (n,), variance of what is told, by what the quadratic can't say.
    """

    basis: FloatArray
    told: FloatArray
    values: FloatArray
    variance: FloatArray
    noise: FloatArray

    def posterior(self, spoke: BoolArray, piece: int) -> tuple[FloatArray, FloatArray]:
        """Return mean (terms,) and covariance of what the surrogate errs by at a piece.

        If what the piece told contradicts the surrogate more than its error allows, the error is
        larger.
        """
        surprise = self._regression(spoke, piece)[2] / max(1, int(spoke.sum()))
        own = replace(self, variance=self.variance * max(1.0, surprise))
        mean, covariance, _ = own._heard(spoke, piece)
        return mean, covariance

    def speakers(self) -> IntArray:
        """Return for each evaluation (n,) the piece that it most likely told of.

        Beginning with the surrogate's largest, or with one piece for all that are in doubt,
        evaluations change their piece one by one as long as that makes all that was told likelier.
        """
        largest = self.values.argmax(axis=1)
        doubtful = self._doubtful(largest)
        known: dict[tuple[int, bytes], float] = {}

        def likelihood(piece: int, speaker: IntArray) -> float:
            spoke = speaker == piece
            key = (piece, spoke.tobytes())
            if key not in known:
                known[key] = self._heard(spoke, piece)[2]
            return known[key]

        pieces = sorted({piece for _, piece in doubtful})
        begun = [largest]
        for piece in pieces:
            begun.append(largest.copy())
            begun[-1][[row for row, other in doubtful if other == piece]] = piece
        ended = [_climbed(speaker, doubtful, likelihood) for speaker in begun]
        return max(ended, key=lambda speaker: sum(likelihood(one, speaker) for one in pieces))

    def _doubtful(self, speaker: IntArray) -> list[tuple[int, int]]:
        """Return which pieces may have spoken (row, piece), where there are several."""
        deviation = np.sqrt(2.0 * (self.basis**2 @ self.variance + self.noise))
        largest = self.values[np.arange(len(speaker)), speaker]
        may = self.values > (largest - CANDIDATE * deviation)[:, None]
        return [(row, piece) for row, piece in np.argwhere(may).tolist() if may[row].sum() > 1]

    def _heard(self, spoke: BoolArray, piece: int) -> tuple[FloatArray, FloatArray, float]:
        """Return mean, covariance and log likelihood, but for a constant, of a piece.

        Where another piece spoke, this one was smaller: that cuts off a tail of what is believed,
        and what is left is taken as normal again, one evaluation after the other.
        """
        mean, gain, surprise, size = self._regression(spoke, piece)
        covariance = np.diag(self.variance) - gain @ (self.basis[spoke] * self.variance)
        likelihood = -0.5 * (surprise + size)
        for row in np.flatnonzero(~spoke).tolist():
            basis = self.basis[row]
            reached = covariance @ basis
            deviation = np.sqrt(max(basis @ reached, 0.0) + self.noise[row])
            room = (self.told[row] - self.values[row, piece] - basis @ mean) / deviation
            if room < CERTAIN:
                room = max(room, -LEAST_ROOM)
                below = float(log_ndtr(room))
                likelihood += below
                shift = np.exp(-0.5 * room**2 - HALF_LOG_2PI - below)
                mean = mean - reached * shift / deviation
                lost = shift * (room + shift) / deviation**2
                covariance = covariance - lost * np.outer(reached, reached)
        return mean, covariance, likelihood

    def _regression(
        self, spoke: BoolArray, piece: int
    ) -> tuple[FloatArray, FloatArray, float, float]:
        """Return mean (terms,), gain (terms, k), surprise and log determinant of k told values."""
        basis, residual = self.basis[spoke], self.told[spoke] - self.values[spoke, piece]
        reached = basis * self.variance
        covariance = reached @ basis.T + np.diag(self.noise[spoke])
        solved = np.linalg.solve(covariance, np.c_[residual, reached])
        surprise = float(residual @ solved[:, 0])
        size = float(np.linalg.slogdet(covariance)[1])
        gain: FloatArray = np.asarray(solved[:, 1:].T, dtype=float)
        return gain @ residual, gain, surprise, size


def _climbed(
    speaker: IntArray,
    doubtful: list[tuple[int, int]],
    likelihood: Callable[[int, IntArray], float],
) -> IntArray:
    """Return the speakers after single evaluations have changed theirs to likelier ones."""
    for _ in range(PASSES):
        before = speaker
        for row, piece in doubtful:
            old = int(speaker[row])
            if piece != old:
                moved = speaker.copy()
                moved[row] = piece
                both = (piece, old)
                gained = sum(likelihood(one, moved) - likelihood(one, speaker) for one in both)
                speaker = moved if gained > 0.0 else speaker
        if speaker is before:
            break
    return speaker


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
