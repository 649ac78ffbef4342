"""How a design's objective goes with its dimensions, and what each limit costs at an optimum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.limit import Limit
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import converted
from pkm_gym.studies.buildable.dimensions import BUILT, Dimensions
from pkm_gym.studies.buildable.multipliers import STEP, Multipliers, multipliers, values_of

SLOPE, BEND = 1e-6, 1e-4  # steps of first and second differences, of a coordinate's size
SMALLEST = 1e-3  # m or rad or 1, of a coordinate's size
KINK = 0.1  # of the larger slope: where those to both sides differ by so much, there is a kink
PERCENT = 0.01
BALANCED = 0.02  # of the objective's slope: less is left at an optimum


@dataclass(frozen=True)
class Price:
    """What a number of the task is worth at an optimum.

    Attributes:
        value: as it is, SI.
        unit: SI.
        share: by which share the objective at the optimum gets worse with 1 % more of it, to first
            order; less than 0: better.
    """

    value: float
    unit: str
    share: float


@dataclass(frozen=True)
class Sensitivity:
    """Slopes, bends and prices of a design.

    Attributes:
        nominal: evaluation of the design, one.
        steps: dimension -> what it is told for in SI: 1 mm, 1 deg, or 1 % of a pure number.
        values: dimension -> its value.
        units: of each dimension, SI.
        gradient: dimension -> change of the objective for that step, to first order.
        hessian: array (k, k), second derivatives of the objective for those steps.
        kinks: the dimensions whose slopes to both sides differ.
        held: the dimensions that are no variables of the search, or follow another.
        multipliers: of the limits and search bounds that hold the design back.
        limits: constraint -> price of its bound, of the active ones whose bound is not 0.
        task: field -> price, of the fields that make a difference.
    """

    nominal: Evaluation
    steps: dict[str, float]
    values: dict[str, float]
    units: dict[str, str]
    gradient: dict[str, float]
    hessian: FloatArray
    kinks: tuple[str, ...]
    held: tuple[str, ...]
    multipliers: Multipliers
    limits: dict[str, Price]
    task: dict[str, Price]

    @property
    def optimal(self) -> bool:
        """Whether the slopes balance, so that prices hold."""
        return bool(self.nominal.feasible[0]) and self.multipliers.left <= BALANCED


def sensitivity(problem: DesignProblem, design: FloatArray, *, seed: int = 0) -> Sensitivity:
    """Return how the first objective goes with a design (d,), by central differences, and prices.

    Args:
        problem: the problem, with its task.
        design: array (d,), an optimum where prices are wanted.
        seed: of the places about the design where slopes are taken for the multipliers.

    Raises:
        ValueError: for a design that makes no machine, or whose objective is undefined.
    """
    design = np.asarray(design, dtype=float)
    dimensions = Dimensions(problem, design)
    nominal = problem.evaluate(design[None])
    if not np.isfinite(nominal.objectives[0, 0]):
        raise ValueError(
            f"{problem.objectives[0].name} of this design is undefined: {nominal.explain(0)}"
        )
    point = dimensions.of(dimensions.full)
    steps = _steps(dimensions, point)
    gradient, kinked = _gradient(dimensions, point)
    found = multipliers(problem, design, seed=seed)
    names = dimensions.names
    return Sensitivity(
        nominal,
        dict(zip(names, steps.tolist(), strict=True)),
        dict(zip(names, point.tolist(), strict=True)),
        dimensions.units,
        dict(zip(names, (gradient * steps).tolist(), strict=True)),
        _hessian(dimensions, point) * np.outer(steps, steps),
        tuple(name for name, bad in zip(names, kinked.tolist(), strict=True) if bad),
        tuple(n for n in names if n not in dimensions.searched),
        found,
        _limit_prices(problem, found),
        _task_prices(problem, float(nominal.objectives[0, 0]), found),
    )


def _steps(dimensions: Dimensions, point: FloatArray) -> FloatArray:
    """Return what slopes are told for: 1 mm, 1 deg, 1 % of a pure number."""
    return np.array(
        [
            1.0 / converted(1.0, dimensions.units[name])[0]
            if dimensions.units[name] in BUILT
            else PERCENT * abs(x)
            for name, x in zip(dimensions.names, point.tolist(), strict=True)
        ]
    )


def _size(point: FloatArray) -> FloatArray:
    return np.maximum(np.abs(point), SMALLEST)


def _gradient(dimensions: Dimensions, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the slopes (k,) of the objective, and where those to both sides differ."""
    step = SLOPE * _size(point)
    probes = np.concatenate([point + np.diag(step), point - np.diag(step), point[None]])
    values = dimensions.evaluate(probes).objectives[:, 0]
    k = len(point)
    ahead, behind = (values[:k] - values[-1]) / step, (values[-1] - values[k:-1]) / step
    largest = np.maximum(np.abs(ahead), np.abs(behind))
    floor = 1e-6 * np.max(largest * _size(point), initial=0.0) / _size(point)
    kinked = np.abs(ahead - behind) > KINK * largest + floor
    return 0.5 * (ahead + behind), kinked


def _hessian(dimensions: Dimensions, point: FloatArray) -> FloatArray:
    """Return the second derivatives (k, k) of the objective, by central differences."""
    k, step = len(point), np.diag(BEND * _size(point))
    i, j = np.triu_indices(k)
    corners = [point + a * step[i] + b * step[j] for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
    values = dimensions.evaluate(np.concatenate(corners)).objectives[:, 0].reshape(4, -1)
    size = np.diag(step)
    upper = (values[0] - values[1] - values[2] + values[3]) / (4.0 * size[i] * size[j])
    hessian = np.empty((k, k))
    hessian[i, j] = hessian[j, i] = upper
    return hessian


def _limit_prices(problem: DesignProblem, found: Multipliers) -> dict[str, Price]:
    """Return the price of 1 % more of each active limit's bound."""
    prices = {}
    for limit in problem.limits:
        if not isinstance(limit, Limit) or limit.name not in found.limits:
            continue
        bound, unit = limit.bound_of(problem.task), problem.unit(limit.quantity)
        if bound == 0.0:
            continue
        # by how much the violation changes with 1 % more of the bound
        change = -limit.sign * PERCENT * (1.0 if limit.relative(unit) else bound)
        prices[limit.name] = Price(bound, unit, found.limits[limit.name] * change)
    return prices


def _task_prices(problem: DesignProblem, nominal: float, found: Multipliers) -> dict[str, Price]:
    """Return the price of 1 % more of each task field that makes a difference.

    The envelope theorem: at an optimum nothing is gained by moving the design, so the slopes with
    the field count, at the same places and weights as those that balance.
    """
    prices = {}
    row = problem.pack(None)
    for k, field in enumerate(problem.task_variables):
        low, high = row.copy(), row.copy()
        low[k] = max(field.legal_low, row[k] - STEP * abs(row[k]))
        high[k] = min(field.legal_high, row[k] + STEP * abs(row[k]))
        if not high[k] > low[k]:
            continue
        below, above = (values_of(problem, found.places, at[None], nominal) for at in (low, high))
        slope = float((found.weights * (above - below)).sum() / (high[k] - low[k]))
        if np.isfinite(slope) and slope != 0.0:
            prices[field.name] = Price(float(row[k]), field.unit, PERCENT * float(row[k]) * slope)
    return prices
