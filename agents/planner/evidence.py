"""Evidence: what the evaluations of a session say of one output, and which piece each told of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import log_ndtr

from pkm_gym.agents.planner.surrogate import IntArray
from pkm_gym.core.types import BoolArray, FloatArray

CANDIDATE = 6.0  # deviations below the largest, within which a piece may have been the largest
PASSES = 4
ROUNDING = 1e-9  # relative, of variances: two evaluations of one design are no contradiction
CERTAIN = 3.0  # deviations below what was told, from which on that is no news
LEAST_ROOM = 1e3  # deviations; beyond it the logarithms lose their digits
HALF_LOG_2PI = 0.5 * np.log(2.0 * np.pi)


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
        cache: dict[tuple[int, bytes], float] = {}

        def likelihood(piece: int, speaker: IntArray) -> float:
            spoke = speaker == piece
            key = (piece, spoke.tobytes())
            if key not in cache:
                cache[key] = self._heard(spoke, piece)[2]
            return cache[key]

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
                lost = min(1.0, shift * (room + shift)) / deviation**2
                covariance = covariance - lost * np.outer(reached, reached)
        return mean, covariance, likelihood

    def _regression(
        self, spoke: BoolArray, piece: int
    ) -> tuple[FloatArray, FloatArray, float, float]:
        """Return mean (terms,), gain (terms, k), surprise and log determinant of k told values."""
        basis, residual = self.basis[spoke], self.told[spoke] - self.values[spoke, piece]
        reached = basis * self.variance
        covariance = reached @ basis.T
        covariance += np.diag(self.noise[spoke] + ROUNDING * np.diag(covariance))
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
