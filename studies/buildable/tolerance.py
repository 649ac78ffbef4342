"""What manufacturing tolerances do to a design: distributions, yield, Sobol indices, margins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.studies.buildable.dimensions import Dimensions
from pkm_gym.studies.buildable.errors import normal, power_of, sobol_points

SAMPLES = 1024
QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)
GOAL = 0.95  # share of machines that a margin is told for
BATCH = 4096

Report = Callable[[int], None]


@dataclass(frozen=True)
class Distribution:
    """Of one number over the machines that are built, undefined ones left out.

    Attributes:
        nominal: of the machine without errors.
        mean, std: over the machines.
        quantiles: share -> value.
        first: dimension -> first-order Sobol index, the share of the variance that its error
            makes alone; empty where the number is undefined of some machine, or doesn't vary.
        total: dimension -> total Sobol index, with what it makes together with others.
    """

    nominal: float
    mean: float
    std: float
    quantiles: dict[float, float]
    first: dict[str, float]
    total: dict[str, float]


@dataclass(frozen=True)
class Tolerances:
    """What became of the machines that were built.

    Attributes:
        nominal: evaluation of the design, one.
        sigma: dimension -> standard deviation of its error, SI.
        units: of each dimension, SI.
        machines: how many were built for the distributions.
        evaluations: how many designs were evaluated in all.
        share: of the machines that hold every limit: the yield.
        broken: constraint -> share of the machines that break it; of those that some break.
        margins: constraint -> by how much a nominal design must keep it, scaled as the constraints
            are, so that ``goal`` of its machines hold it; of those that some break.
        goal: a share.
        objective: of the first objective, over all machines.
        constraints: name -> of each constraint.
        values: array (n,), the first objective of each machine.
        feasible: array (n,), whether it holds every limit.
    """

    nominal: Evaluation
    sigma: dict[str, float]
    units: dict[str, str]
    machines: int
    evaluations: int
    share: float
    broken: dict[str, float]
    margins: dict[str, float]
    goal: float
    objective: Distribution
    constraints: dict[str, Distribution]
    values: FloatArray
    feasible: BoolArray


def tolerance(
    problem: DesignProblem,
    design: FloatArray,
    sigma: Mapping[str, float],
    *,
    samples: int = SAMPLES,
    goal: float = GOAL,
    seed: int = 0,
    report: Report | None = None,
) -> Tolerances:
    """Build machines of a design (d,) with normal errors of its dimensions.

    Saltelli's scheme on scrambled Sobol points: the distributions are over two sets of ``samples``
    machines, the Sobol indices take as many again for each dimension.

    Args:
        problem: the problem, with its task.
        design: array (d,).
        sigma: dimension -> standard deviation, SI; see ``Dimensions``.
        samples: a power of two.
        goal: a share of machines, that margins are told for.
        seed: of the scrambling.
        report: called with the number of designs evaluated so far.

    Raises:
        ValueError: in one sentence, for a design that makes no machine, an unknown dimension, or a
            number that is not allowed.
    """
    check_share("the goal", goal)
    dimensions, power = Dimensions(problem, design), power_of(samples)
    check_known("dimension", sigma, dimensions.names)
    names = [name for name in dimensions.names if name in sigma]
    if not names or not all(sigma[name] > 0.0 for name in names):
        raise ValueError("tolerances need a standard deviation > 0 of some dimension: l1=0.1mm")
    unit = _saltelli(sobol_points(power, 2 * len(names), seed))
    points = np.repeat(dimensions.of(dimensions.full)[None], len(unit), axis=0)
    columns = [dimensions.names.index(name) for name in names]
    points[:, columns] += normal(unit) * np.array([sigma[name] for name in names])
    evaluation = _evaluated(dimensions, points, report or (lambda _: None))
    nominal = problem.evaluate(np.asarray(design)[None])
    return _told(nominal, evaluation, names, sigma, dimensions.units, goal)


def check_share(what: str, share: float) -> None:
    """Refuse what is no share of machines.

    Raises:
        ValueError: naming it.
    """
    if not 0.5 <= share < 1.0:
        raise ValueError(f"{what} is {share:g}: it must be a share of machines from 0.5 to below 1")


def _saltelli(pair: FloatArray) -> FloatArray:
    """Return the points (n (k + 2), k) that SALib takes, of two sets (n, 2 k) of k numbers.

    Of each sample: that of the first set, the same with each number from the second, the second's.
    """
    k = pair.shape[1] // 2
    first, second = pair[:, :k], pair[:, k:]
    rows = np.repeat(first[:, None], k + 2, axis=1)
    for j in range(k):
        rows[:, 1 + j, j] = second[:, j]
    rows[:, k + 1] = second
    return rows.reshape(-1, k)


def _evaluated(dimensions: Dimensions, points: FloatArray, report: Report) -> Evaluation:
    designs, tasks = dimensions.designs(points)
    parts = []
    for at in range(0, len(points), BATCH):
        part = slice(at, at + BATCH)
        parts.append(dimensions.problem.evaluate(designs[part], tasks[part]))
        report(min(at + BATCH, len(points)))
    return Evaluation.joined(parts)


def _told(
    nominal: Evaluation,
    evaluation: Evaluation,
    names: list[str],
    sigma: Mapping[str, float],
    units: Mapping[str, str],
    goal: float,
) -> Tolerances:
    """Return what is told of machines, of which all were evaluated that the indices need."""
    step = len(names) + 2
    own = np.arange(len(evaluation)) % step
    built = (own == 0) | (own == step - 1)
    constraints, feasible = evaluation.constraints[built], evaluation.feasible[built]
    limits = nominal.problem.constraint_names
    broken = (constraints > 0.0).mean(axis=0)
    kept = np.quantile(constraints, goal, axis=0, method="higher") - nominal.constraints[0]

    def told(values: FloatArray, at: float) -> Distribution:
        return _distribution(values, at, built, names)

    return Tolerances(
        nominal=nominal,
        sigma={name: sigma[name] for name in names},
        units={name: units[name] for name in names},
        machines=int(built.sum()),
        evaluations=len(evaluation),
        share=float(feasible.mean()),
        broken={n: float(x) for n, x in zip(limits, broken, strict=True) if x > 0.0},
        margins={n: float(x) for n, x, b in zip(limits, kept, broken, strict=True) if b > 0.0},
        goal=goal,
        objective=told(evaluation.objectives[:, 0], nominal.objectives[0, 0]),
        constraints={
            name: told(values, at)
            for name, values, at in zip(
                limits, evaluation.constraints.T, nominal.constraints[0], strict=True
            )
        },
        values=evaluation.objectives[built, 0],
        feasible=feasible,
    )


def _distribution(
    values: FloatArray, nominal: float, built: BoolArray, names: list[str]
) -> Distribution:
    own = values[built]
    known = own[np.isfinite(own)]
    first, total = sobol_indices(values, names)
    if not len(known):
        return Distribution(float(nominal), np.nan, np.nan, {}, first, total)
    return Distribution(
        float(nominal),
        float(known.mean()),
        float(known.std()),
        dict(zip(QUANTILES, map(float, np.quantile(known, QUANTILES)), strict=True)),
        first,
        total,
    )


def sobol_indices(
    values: FloatArray, names: list[str]
) -> tuple[dict[str, float], dict[str, float]]:
    """Return first-order and total Sobol indices by name, of values (n (k + 2),) as SALib sorts.

    Empty where a value is undefined or all are the same.
    """
    from SALib.analyze import sobol

    spread = np.ptp(values)
    if not (np.isfinite(spread) and spread > 1e-12 * max(1.0, float(np.abs(values).max()))):
        return {}, {}
    if len(names) == 1:
        return {names[0]: 1.0}, {names[0]: 1.0}
    told = sobol.analyze(
        {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)},
        values,
        calc_second_order=False,
        num_resamples=2,  # its confidence intervals are not used
        seed=0,
    )
    return tuple(dict(zip(names, map(float, told[key]), strict=True)) for key in ("S1", "ST"))  # type: ignore[return-value]
