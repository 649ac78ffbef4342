"""One number of several indices, by principal component analysis (PCA).

The 5-PSS/UPU's paper makes its comprehensive index F in this way (docs/mechanisms/pss5_upu.md), of
m rows of k indices K:

    Z = (K - mean) / std                       z-scores, std with m - 1
    R = Z^T Z / (m - 1)                        correlation matrix
    R v_i = lambda_i v_i                       unit vectors, lambda_1 >= lambda_2 >= ...
    (lambda_1 + ... + lambda_p) / k >= 85 %    p components are kept, as few as will do
    weights = lambda_1 v_1 + ... + lambda_p v_p
    F = Z weights

Weights say what varies together in a population, not what is good: another population has others,
and an index that should be large may get a negative one. Nor does an eigenvector have a sign; here
its entries add up to >= 0, each counted with -1 where the index should be small. A composite holds
a sentence for each of these that bites.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np
import numpy.typing as npt

from pkm_gym.core.names import check_known
from pkm_gym.core.types import FloatArray

Direction = Literal["maximise", "minimise"]
SIGNS: dict[Direction, float] = {"maximise": 1.0, "minimise": -1.0}

SHARE = 0.85  # of the variance, that the kept components have together
CLEAR = 0.1  # sum of a component's entries, below which its sign is a coin toss
ROUNDING = 1e-9  # of correlations, eigenvalues and weights
NAMED = 5  # rows that a refusal names


@dataclass(frozen=True, eq=False)
class Composite:
    """A weighted sum of indices whose weights come from how they correlate.

    ``composite`` makes it from values, ``from_correlation`` from a correlation matrix; other
    weights, or the moments of a printed population, come in with ``dataclasses.replace``.

    Attributes:
        names: of the k indices.
        directions: which of them should be large, "maximise", and which small, "minimise".
        population: what the weights are of, in words, with the number of rows where it is known.
        mean: array (k,), of the population; None where only the correlation is known.
        std: array (k,), of the population, with m - 1; None where only the correlation is known.
        correlation: array (k, k).
        eigenvalues: array (k,), of the correlation, the largest first.
        vectors: array (k, k), a row for each principal component, a unit vector.
        kept: how many of them, the first ones, make the weights.
        weights: array (k,), of z-scores.
        warnings: a sentence for each thing that makes the weights doubtful.
    """

    names: tuple[str, ...]
    directions: tuple[Direction, ...]
    population: str
    mean: FloatArray | None
    std: FloatArray | None
    correlation: FloatArray
    eigenvalues: FloatArray
    vectors: FloatArray
    kept: int
    weights: FloatArray
    warnings: tuple[str, ...]

    @classmethod
    def from_correlation(
        cls,
        correlation: npt.ArrayLike,
        names: Sequence[str],
        *,
        directions: Sequence[Direction],
        population: str,
        share: float = SHARE,
    ) -> Self:
        """Make a composite without mean and std from a correlation matrix, such as a printed one.

        Args:
            correlation: array (k, k).
            names: of the k indices.
            directions: "maximise" or "minimise" for each of them.
            population: what correlates like this, in words.
            share: of the variance, > 0 and <= 1, that the kept components have at least.

        Raises:
            ValueError: for what is no correlation matrix, and for other arguments of a wrong shape,
                type or range.
        """
        signs = _signs(directions, names)
        if not (isinstance(population, str) and population.strip()):
            raise ValueError(f"population is {population!r}: say in words what the rows are")
        if not 0.0 < share <= 1.0:
            raise ValueError(f"share is {share!r}: it must be > 0 and <= 1")
        R = _correlation(correlation, len(names))
        eigenvalues, columns = np.linalg.eigh(R)
        eigenvalues, vectors = np.maximum(eigenvalues[::-1], 0.0), columns.T[::-1]
        vectors = np.where(vectors @ signs < 0.0, -1.0, 1.0)[:, None] * vectors
        cumulated = np.cumsum(eigenvalues) / eigenvalues.sum()
        kept = int(np.searchsorted(cumulated[:-1], share)) + 1
        weights = eigenvalues[:kept] @ vectors[:kept]
        return cls(
            names=tuple(names),
            directions=tuple(directions),
            population=population,
            mean=None,
            std=None,
            correlation=R,
            eigenvalues=eigenvalues,
            vectors=vectors,
            kept=kept,
            weights=weights,
            warnings=(
                *_arbitrary(eigenvalues, vectors @ signs, kept),
                *_against(names, weights, signs),
            ),
        )

    @property
    def shares(self) -> FloatArray:
        """Array (k,): the share of the variance that each component has."""
        return self.eigenvalues / self.eigenvalues.sum()

    def z_scores(self, values: npt.ArrayLike) -> FloatArray:
        """Return values (..., k) as z-scores (..., k) of the population.

        Raises:
            ValueError: for a wrong shape or type, or without the population's mean and std.
        """
        if self.mean is None or self.std is None:
            raise ValueError(
                "z-scores need the population's mean and std: this composite of "
                f"{self.population} is made of a correlation matrix alone"
            )
        return (_table(values, self.names) - self.mean) / self.std

    def scores(self, values: npt.ArrayLike) -> FloatArray:
        """Return the composite (...) of values (..., k) by their z-scores, NaN where one is NaN.

        Raises:
            ValueError: for a wrong shape or type, or without the population's mean and std.
        """
        return self.z_scores(values) @ self.weights

    def raw(self, values: npt.ArrayLike) -> FloatArray:
        """Return the composite (...) of values (..., k) as they are, NaN where one is NaN.

        That is F in the paper's Table 5, though its equations have z-scores. It may rank
        differently from ``scores``.

        Raises:
            ValueError: for a wrong shape or type.
        """
        return _table(values, self.names) @ self.weights


def composite(
    values: npt.ArrayLike,
    names: Sequence[str],
    *,
    directions: Sequence[Direction],
    population: str,
    share: float = SHARE,
) -> Composite:
    """Make a composite of indices from their values in a population, such as the designs of a grid.

    Args:
        values: array (m, k), a row for each of m >= 2 members, a column for each index.
        names: of the k indices.
        directions: "maximise" or "minimise" for each of them.
        population: what the rows are, in words; their number is added.
        share: of the variance, > 0 and <= 1, that the kept components have at least.

    Raises:
        ValueError: for a value that is not finite (named by index and row), an index that does not
            vary, and for arguments of a wrong shape, type or range.
    """
    rows = _table(values, names)
    if rows.ndim != 2 or len(rows) < 2:
        raise ValueError(f"values have the shape {rows.shape}: a correlation takes 2 rows or more")
    _check_population(rows, names)
    mean, std = rows.mean(axis=0), rows.std(axis=0, ddof=1)
    Z = (rows - mean) / std
    made = Composite.from_correlation(
        Z.T @ Z / (len(rows) - 1), names, directions=directions, population=population, share=share
    )
    return replace(made, population=f"{population} ({len(rows)} rows)", mean=mean, std=std)


def _arbitrary(eigenvalues: FloatArray, sums: FloatArray, kept: int) -> tuple[str, ...]:
    """Return what is arbitrary in the kept components, whose entries add up to ``sums`` (k,)."""
    unclear = [
        f"the sign of component {i + 1} is a coin toss, and so are the weights: its entries add up "
        f"to {sums[i]:.3f}, less than {CLEAR:g}"
        for i in np.flatnonzero(sums[:kept] < CLEAR)
    ]
    gaps = eigenvalues[:-1] - eigenvalues[1:]
    mixed = [
        f"components {i + 1} and {i + 2} have the same eigenvalue: turned about each other they "
        "would do as well, with other weights"
        for i in np.flatnonzero(gaps[:kept] < ROUNDING)
    ]
    return (*unclear, *mixed)


def _against(names: Sequence[str], weights: FloatArray, signs: FloatArray) -> tuple[str, ...]:
    """Return which weights go against the directions of their indices, ``signs`` (k,)."""
    words = {1.0: ("punishes", "large"), -1.0: ("rewards", "small")}
    return tuple(
        f"the weight {weight:.3f} {words[sign][0]} {name}, which should be {words[sign][1]}"
        for name, weight, sign in zip(names, weights, signs, strict=True)
        if weight * sign < -ROUNDING
    )


def _signs(directions: Sequence[Direction], names: Sequence[str]) -> FloatArray:
    """Return +1 for each index that should be large, -1 for the others."""
    if isinstance(names, str) or not names or len(set(names)) < len(names):
        raise ValueError(f"names are {names!r}: give each index a name of its own")
    if isinstance(directions, str) or len(directions) != len(names):
        raise ValueError(
            f"directions are {directions!r}: say of each of {', '.join(names)} whether to "
            f"{' or '.join(SIGNS)} it"
        )
    check_known("direction", directions, SIGNS)
    return np.array([SIGNS[direction] for direction in directions])


def _correlation(given: npt.ArrayLike, count: int) -> FloatArray:
    """Return a correlation matrix (count, count)."""
    R = np.asarray(given)
    if R.dtype.kind not in "fiu" or R.shape != (count, count) or not np.isfinite(R).all():
        raise ValueError(
            f"the correlation must be finite numbers of shape {count, count}: got {R.tolist()}"
        )
    off = max(abs(R - R.T).max(), abs(R.diagonal() - 1.0).max(), -np.linalg.eigvalsh(R)[0])
    if off > ROUNDING:
        raise ValueError(
            "the correlation must be symmetric, with ones on the diagonal and no negative "
            f"eigenvalue: got {R.tolist()}"
        )
    return R.astype(np.float64)


def _table(values: npt.ArrayLike, names: Sequence[str]) -> FloatArray:
    """Return numbers of shape (..., k)."""
    array = np.asarray(values)
    if array.dtype.kind not in "fiu" or array.shape[-1:] != (len(names),):
        raise ValueError(
            f"values must be numbers of shape (..., {len(names)}), columns {', '.join(names)}: "
            f"got {array.dtype} of shape {array.shape}"
        )
    return array.astype(np.float64)


def _check_population(rows: FloatArray, names: Sequence[str]) -> None:
    """Refuse rows (m, k) with a value that is not finite, or an index that does not vary."""
    finite = np.isfinite(rows)
    broken = np.flatnonzero(~finite.all(axis=1))
    if len(broken):
        columns = np.array(names)
        shown = [f"row {i} ({', '.join(columns[~finite[i]])})" for i in broken[:NAMED]]
        more = f" and {len(broken) - NAMED} more" if len(broken) > NAMED else ""
        raise ValueError(
            f"values are not finite in {', '.join(shown)}{more}, counted from 0: leave them out"
        )
    for name, column in zip(names, rows.T, strict=True):
        if np.ptp(column) <= ROUNDING * abs(column).max():
            raise ValueError(
                f"{name} is {column[0]:g} in all {len(rows)} rows: without variance there is no "
                "z-score; leave it out"
            )
