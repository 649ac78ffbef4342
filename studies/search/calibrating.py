"""What merit must know of a problem, measured on solved tasks of its Family.

Merit promises three things: it is 1 at the optimum of the default task and near 1 at those of the
Family; its minimiser is the constrained optimum, since the penalty weighs more than the multipliers
of the limits; and no feasible design is as bad as ``worst``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil, floor, log10

import numpy as np

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, solve_tasks
from pkm_gym.core.types import BoolArray, FloatArray

RANDOM = 20_000  # designs, each on a task of its own, for what is feasible at all
AROUND = 2000  # designs around each optimum, for the multipliers
RADII = (-4.0, 0.0)  # decimal logarithms of shares of the range: how far around it
SAFETY = 2.0  # the penalty's weight over the largest multiplier seen
NEGLIGIBLE = 0.02  # what a field must change of the log scale over its range to enter it
WITHIN = 2.0  # merit at an optimum of the Family: from 1 / WITHIN to WITHIN

Progress = Callable[[int], None]


@dataclass(frozen=True)
class Calibration:
    """What was measured of the first objective.

    Attributes:
        objective: its name.
        scale: the objective at the default task's optimum, over what ``powers`` and ``rates`` say.
        powers: task field -> power with which the optimum goes.
        rates: task field that may be 0 -> rate with which the optimum's logarithm goes.
        worst: a value that no feasible design reached, by far.
        multiplier: the largest gain in log merit for a unit of constraint.
        within: share of the tasks whose merit at the optimum is from 1/2 to 2.
        extremes: least and greatest merit at an optimum.
        tasks: how many tasks were solved.
        solvable: how many of them have a feasible design.
    """

    objective: str
    scale: float
    powers: Mapping[str, float]
    rates: Mapping[str, float]
    worst: float
    multiplier: float
    within: float
    extremes: tuple[float, float]
    tasks: int
    solvable: int

    @property
    def penalty_weight(self) -> float:
        """The weight that makes the penalty exact, with some to spare: two digits."""
        return max(1.0, _rounded(SAFETY * self.multiplier, ceil, digits=2))


def calibrate(
    problem: DesignProblem, n: int, *, seed: int = 0, progress: Progress | None = None
) -> Calibration:
    """Solve the default task and n - 1 of the Family, and measure what merit must know.

    Args:
        problem: whose first objective is measured.
        n: tasks.
        seed: of the tasks and searches.
        progress: called with the number of tasks that are solved.

    Raises:
        ValueError: where no design of the default task, or next to none at all, is feasible.
    """
    generator = np.random.default_rng(seed)
    random = _random(problem, generator)
    values = _positive(problem, random.objectives[:, 0])[random.feasible]
    if len(values) == 0:
        raise ValueError(
            f"none of {RANDOM:,} random designs of {problem.name} is feasible: widen its bounds or "
            "limits first"
        )
    problem.scale = float(np.median(values))
    tasks = np.concatenate([problem.pack(None)[None], problem.draw_tasks(n - 1, generator)])
    solved = solve_tasks(problem, tasks, seed=seed, progress=progress)
    if not solved.solvable[0]:
        raise ValueError(f"the default task of {problem.name} has no feasible design")
    optima = _positive(problem, solved.optima)
    powers, rates = _fitted(problem, tasks, optima, solved.solvable)
    product = np.exp(_logs(problem, tasks, powers, rates))
    scale = float(optima[0] / product[0])
    ratios = (optima / (scale * product))[solved.solvable]
    merits = ratios if problem.objectives[0].sign > 0.0 else 1.0 / ratios
    return Calibration(
        objective=problem.objectives[0].name,
        scale=scale,
        powers=powers,
        rates=rates,
        worst=_worst(problem, random.objectives[:, 0][random.feasible], solved),
        multiplier=_multiplier(problem, solved, generator),
        within=float(((merits >= 1.0 / WITHIN) & (merits <= WITHIN)).mean()),
        extremes=(float(merits.min()), float(merits.max())),
        tasks=n,
        solvable=int(solved.solvable.sum()),
    )


def _random(problem: DesignProblem, generator: np.random.Generator) -> Evaluation:
    designs = generator.uniform(problem.low, problem.high, (RANDOM, len(problem.low)))
    return problem.evaluate(designs, problem.draw_tasks(RANDOM, generator))


def _positive(problem: DesignProblem, values: FloatArray) -> FloatArray:
    """Return what merit takes the logarithm of."""
    positive = values + problem.objectives[0].offset
    if (positive[np.isfinite(positive)] <= 0.0).any():
        raise ValueError(
            f"{problem.objectives[0].name} of {problem.name} can be 0 or negative: declare an "
            "offset of the objective"
        )
    return positive


def _fitted(
    problem: DesignProblem, tasks: FloatArray, optima: FloatArray, solvable: BoolArray
) -> tuple[dict[str, float], dict[str, float]]:
    """Return powers of the positive drawn fields and rates of the others: least squares of logs."""
    drawn = {v.name: v.legal_low > 0.0 for v in problem.task_variables if v.drawn}
    if not drawn or solvable.sum() < 4 * (len(drawn) + 1):
        return {}, {}
    values = {name: tasks[solvable, problem.task_type.names().index(name)] for name in drawn}
    columns = [np.log(x) if drawn[name] else x for name, x in values.items()]
    whole = np.column_stack([np.ones(solvable.sum()), *columns])
    fitted = np.linalg.lstsq(whole, np.log(optima[solvable]), rcond=None)[0][1:]
    kept = {
        name: round(float(slope), 3)
        for name, slope, column in zip(drawn, fitted, columns, strict=True)
        if abs(slope) * np.ptp(column) >= NEGLIGIBLE
    }
    powers = {name: slope for name, slope in kept.items() if drawn[name]}
    return powers, {name: slope for name, slope in kept.items() if not drawn[name]}


def _logs(
    problem: DesignProblem,
    tasks: FloatArray,
    powers: Mapping[str, float],
    rates: Mapping[str, float],
) -> FloatArray:
    """Return the logarithm (n,) of what tasks (n, m) multiply the scale with."""
    names = problem.task_type.names()
    total = np.zeros(len(tasks))
    for name, power in powers.items():
        total += power * np.log(tasks[:, names.index(name)])
    for name, rate in rates.items():
        total += rate * tasks[:, names.index(name)]
    return total


def _worst(problem: DesignProblem, feasible: FloatArray, solved: Solutions) -> float:
    """Return a value beyond the worst feasible one by the width of them all: one digit."""
    values = np.concatenate([feasible, solved.optima[solved.solvable]])
    width = float(np.ptp(values)) or abs(float(values[0])) or 1.0
    if problem.objectives[0].sign > 0.0:
        return _rounded(float(values.max()) + width, ceil)
    return _rounded(float(values.min()) - width, floor)


def _multiplier(problem: DesignProblem, solved: Solutions, generator: np.random.Generator) -> float:
    """Return the largest gain of the log objective for a unit of constraint, around the optima."""
    sign, largest = problem.objectives[0].sign, 0.0
    span, d = problem.high - problem.low, len(problem.low)
    for k in np.flatnonzero(solved.solvable).tolist():
        radius = 10.0 ** generator.uniform(*RADII, (AROUND, 1))
        moved = solved.designs[k] + radius * span * generator.uniform(-1.0, 1.0, (AROUND, d))
        around = problem.evaluate(
            np.clip(moved, problem.low, problem.high), np.repeat(solved.tasks[k : k + 1], AROUND, 0)
        )
        violation = np.maximum(around.constraints, 0.0).sum(axis=1)
        kept = (around.unreached <= 0.0) & (violation > 1e-9)
        if sign < 0.0:  # an index that is 0 there, as that of a singular machine, gains nothing
            kept &= around.objectives[:, 0] + problem.objectives[0].offset != 0.0
        best, values = (
            np.log(_positive(problem, x))
            for x in (solved.optima[k : k + 1], around.objectives[kept, 0])
        )
        if kept.any():
            largest = max(largest, float((sign * (best - values) / violation[kept]).max()))
    return largest


def _rounded(value: float, way: Callable[[float], int], digits: int = 1) -> float:
    """Return a value with so many digits, rounded up (``ceil``) or down (``floor``)."""
    if value == 0.0:
        return 0.0
    unit = 10.0 ** (floor(log10(abs(value))) - digits + 1)
    return float(f"{way(round(value / unit, 9)) * unit:.12g}")
