"""Lagrange multipliers of an optimum whose limits have kinks: slopes are sampled about it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import ACTIVE
from pkm_gym.core.types import FloatArray

ABOUT = 1e-6  # of the range: how far from the design slopes are taken
STEP = 1e-8  # of the range, of finite differences
PLACES = 4  # for each variable
EDGE = 1e-6  # of the range: so close to a search bound a design is on it
HEAVY = 1e3  # weight of the equation that says that the objective counts once


@dataclass(frozen=True)
class Multipliers:
    """By which share the objective at the optimum gets worse as limits are tightened.

    Attributes:
        limits: constraint -> share for each unit of its (scaled) violation, of the active ones.
        edges: variable -> share for each unit of the variable by which the search bound moves
            inwards, of those on a bound that hold the design back.
        places: array (p, d), designs close by whose slopes balance.
        weights: array (p, 1 + c), how much of each's slopes counts: of the objective, as a share of
            it, and of the constraints.
        left: how much of the objective's slope nothing balances, as a share of it: 0 at an optimum.
    """

    limits: dict[str, float]
    edges: dict[str, float]
    places: FloatArray
    weights: FloatArray
    left: float


def multipliers(problem: DesignProblem, design: FloatArray, *, seed: int = 0) -> Multipliers:
    """Return the multipliers at a design (d,): of its active limits and search bounds.

    A limit is the extreme over a workspace, and often equal at several poses: it has a kink there,
    and no slope. Slopes at places close by are those of its pieces; the multipliers are the least
    squares solution, none below 0, that balances all of them with the objective's, which has kinks
    itself. The sum over a limit's slopes is its multiplier.

    Args:
        problem: the problem, with its task.
        design: array (d,).
        seed: of the places.
    """
    from scipy.optimize import nnls

    span = problem.high - problem.low
    names = problem.constraint_names
    evaluation = problem.evaluate(design[None])
    active = np.flatnonzero(evaluation.constraints[0] > -ACTIVE)
    places, slopes = _slopes(problem, design, span, seed)
    if not len(places):
        return Multipliers({}, {}, places, np.zeros((0, 1 + len(names))), 1.0)
    objective, limits = slopes[:, 0], slopes[:, 1:][:, active]
    at_low, at_high = design - problem.low <= EDGE * span, problem.high - design <= EDGE * span
    edges = [(j, -1.0) for j in at_low.nonzero()[0]] + [(j, 1.0) for j in at_high.nonzero()[0]]
    bounds = np.zeros((len(edges), len(span)))
    for row, (j, way) in zip(bounds, edges, strict=True):
        row[j] = way
    rows = np.concatenate([objective, limits.reshape(len(places) * len(active), len(span)), bounds])
    size = float(np.linalg.norm(objective.mean(axis=0))) or 1.0
    once = np.concatenate([np.ones(len(objective)), np.zeros(len(rows) - len(objective))])
    matrix = np.vstack([rows.T / size, HEAVY * once])
    weights, left = nnls(matrix, np.concatenate([np.zeros(len(span)), [HEAVY]]))
    of_limits = weights[len(objective) : len(rows) - len(edges)].reshape(len(places), len(active))
    of_edges = weights[len(rows) - len(edges) :]
    each = np.zeros((len(places), 1 + len(names)))
    each[:, 0], each[:, 1 + active] = weights[: len(places)], of_limits
    counted = each.any(axis=1)
    return Multipliers(
        {names[j]: float(x) for j, x in zip(active, of_limits.sum(axis=0), strict=True)},
        {
            problem.variable_names[j]: float(x / span[j])
            for (j, _), x in zip(edges, of_edges, strict=True)
            if x > 0.0
        },
        places[counted],
        each[counted],
        float(left),
    )


def values_of(
    problem: DesignProblem, designs: FloatArray, tasks: FloatArray, nominal: float
) -> FloatArray:
    """Return what slopes are of (n, 1 + c): the objective as a share, and the constraints.

    Less is better of both. Of designs (n, d) for tasks (n, m) or (1, m).
    """
    evaluation = problem.evaluate(designs, tasks)
    own = problem.objectives[0].sign * evaluation.objectives[:, 0] / abs(nominal)
    return np.column_stack([own, evaluation.constraints])


def _slopes(
    problem: DesignProblem, design: FloatArray, span: FloatArray, seed: int
) -> tuple[FloatArray, FloatArray]:
    """Return places (p, d) about a design, and slopes (p, 1 + c, d) of ``values_of`` there.

    Per range of each variable; places where something is undefined are left out.
    """
    d = len(span)
    generator = np.random.default_rng(seed)
    places = design + ABOUT * span * generator.uniform(-1.0, 1.0, (PLACES * d, d))
    probes = np.concatenate([places[:, None], places[:, None] + STEP * np.diag(span)], axis=1)
    nominal = float(problem.evaluate(design[None]).objectives[0, 0])
    values = values_of(problem, probes.reshape(-1, d), problem.pack(None)[None], nominal)
    values = values.reshape(len(places), d + 1, -1)
    slopes = np.swapaxes((values[:, 1:] - values[:, :1]) / STEP, 1, 2)
    known = np.isfinite(slopes).all(axis=(1, 2))
    return places[known], slopes[known]
