"""The paper's space model, and what the composite would be of our own atlas over it.

n1 + n2 + n3 = 3 and n1 <= n2 leave a triangle of ratios, which X = (2 n2 + n3) / sqrt 3, Y = n3 lay
into a plane. The paper samples 160 designs of it and doesn't say which: the grid here is ours.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from pkm_gym.core.composite import Composite, Direction, composite
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.reference import Reference
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms.pss5_upu.declared import LEAST_SHARE

NAMES = ("K_v", "K_w", "K_lambda", "K_eta")
LARGE: tuple[Direction, ...] = ("maximise", "maximise", "maximise", "maximise")
ROOT = math.sqrt(3.0)
CORNERS = ((ROOT, 0.0), (2.0 * ROOT, 0.0), (ROOT, 3.0))  # X, Y: r = R = 1.5 n, R = 3 n, L = 3 n
STEP = (0.03, 0.05)  # of X and Y in our grid
EDGE = 1e-9


def to_plane(shares: npt.ArrayLike) -> FloatArray:
    """Return X, Y (..., 2) of n2, n3 (..., 2)."""
    n2, n3 = np.moveaxis(np.asarray(shares, dtype=float), -1, 0)
    return np.stack([(2.0 * n2 + n3) / ROOT, n3], axis=-1)


def to_shares(places: npt.ArrayLike) -> FloatArray:
    """Return n2, n3 (..., 2) of X, Y (..., 2)."""
    X, Y = np.moveaxis(np.asarray(places, dtype=float), -1, 0)
    return np.stack([0.5 * (ROOT * X - Y), Y], axis=-1)


def space_grid(step: tuple[float, float] = STEP) -> FloatArray:
    """Return designs (n, 2), n2 and n3, at multiples of ``step`` in X and Y within the triangle.

    Each of n1, n2, n3 is at least the problem's least share.
    """
    X, Y = (np.arange(0.0, end, by) for end, by in zip((2.0 * ROOT, 3.0), step, strict=True))
    designs = to_shares(np.stack(np.meshgrid(X, Y), axis=-1).reshape(-1, 2))
    n1 = 3.0 - designs.sum(axis=1)
    least = np.minimum(n1, designs.min(axis=1))
    return designs[(least > LEAST_SHARE - EDGE) & (n1 < designs[:, 0])]


def values_of(evaluation: Evaluation) -> FloatArray:
    """Return the four indices (n, 4) of designs, NaN out of reach."""
    return np.stack([evaluation.indices[name] for name in NAMES], axis=-1)


def printed_composite(reference: Reference) -> Composite:
    """Return the composite of the correlation matrix that the paper prints, its Table 3."""
    table = reference.data["table3"]["correlation"]
    return Composite.from_correlation(
        table, NAMES, directions=LARGE, population="the paper's 160 samples"
    )


def own_composites(evaluation: Evaluation) -> tuple[Composite, Composite]:
    """Return the composites of the feasible and of the reachable designs among those of a grid."""
    values = values_of(evaluation)
    populations = {
        "feasible designs of our grid": evaluation.feasible,
        "reachable designs of our grid": np.isfinite(values).all(axis=1),
    }
    feasible, reachable = (
        composite(values[chosen], NAMES, directions=LARGE, population=words)
        for words, chosen in populations.items()
    )
    return feasible, reachable
