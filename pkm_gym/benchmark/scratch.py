"""Opponents that know nothing of other tasks: random, Sobol and SciPy's optimisers.

All of them search the unit cube that the box of the variables is mapped to. The local ones see the
constraints' values; after converging they start again from a random point, until the budget is
spent.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.optimize import Bounds, NonlinearConstraint, differential_evolution, minimize
from scipy.stats import qmc

from pkm_gym.benchmark.evaluator import Evaluator
from pkm_gym.benchmark.methods import Search, method, proposing
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

# First trust region and last, shares of the range. Limits are maxima over a workspace, so a
# smaller last one would only be spent on their kinks.
FIRST_RADIUS, LAST_RADIUS = 0.1, 1e-8

DIFFERENCE = 1e-6  # of SLSQP's forward differences, a share of the range
TOLERANCE = 1e-12  # of SLSQP, in log merit

# How many of the latest points an objective and its constraints share; a gradient takes d + 1.
REMEMBERED = 32

Minimise = Callable[["UnitCube", FloatArray], None]


class UnitCube:
    """A task as SciPy wants it: functions of a point (d,) of the unit cube.

    Whatever is asked at one of the latest points shares its one counted evaluation.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        problem = evaluator.problem
        self.dimensions = len(problem.low)
        self._evaluator = evaluator
        self._low, self._high = problem.low, problem.high
        self._sign = 1.0 if problem.objectives[0].direction == "minimise" else -1.0
        self._known: dict[bytes, Evaluation] = {}

    def point(self, design: FloatArray) -> FloatArray:
        """Return where a design (d,) lies."""
        return (design - self._low) / (self._high - self._low)

    def draw(self) -> FloatArray:
        """Return a random point (d,)."""
        return self._evaluator.generator.random(self.dimensions)

    def evaluate(self, point: FloatArray) -> Evaluation:
        """Return the evaluation of a point, counted unless it is one of the latest."""
        key = point.tobytes()
        if key not in self._known:
            if len(self._known) == REMEMBERED:
                del self._known[next(iter(self._known))]
            design = self._low + (self._high - self._low) * point
            self._known[key] = self._evaluator.evaluate(np.clip(design, self._low, self._high))
        return self._known[key]

    def merit(self, point: FloatArray) -> float:
        """Return the log merit, penalties included."""
        return float(self.evaluate(point).log_merit[0])

    def objective(self, point: FloatArray) -> float:
        """Return the log of the first objective, to be minimised.

        Up to a constant it is the log merit without penalties; where nothing can be evaluated it is
        the log merit, which lies far above and falls towards the reach.
        """
        evaluation = self.evaluate(point)
        value = evaluation.objectives[0, 0]
        if not value > 0.0:
            return float(evaluation.log_merit[0])
        return self._sign * float(np.log(value))

    def limits(self, point: FloatArray) -> FloatArray:
        """Return the constraints (c,), <= 0 where feasible.

        Violations c are told as c / (1 + c): far outside they reach hundreds.
        """
        constraints = self.evaluate(point).constraints[0]
        return np.where(constraints > 0.0, constraints / (1.0 + np.abs(constraints)), constraints)


@method()
def random(_problem: DesignProblem, _pool: Pool | None) -> Search:
    """Draw designs uniformly from the box."""

    def propose(problem: DesignProblem, _task: FloatArray, history: Evaluator) -> FloatArray:
        return history.generator.uniform(problem.low, problem.high)

    return proposing(propose)


@method()
def sobol(problem: DesignProblem, _pool: Pool | None) -> Search:
    """Take the points of a scrambled Sobol sequence."""

    def search(evaluator: Evaluator) -> None:
        sequence = qmc.Sobol(len(problem.low), rng=evaluator.generator)
        points = sequence.random_base2(int(np.ceil(np.log2(evaluator.budget))))
        evaluator.evaluate(problem.low + (problem.high - problem.low) * points)

    return search


@method()
def cobyqa(_problem: DesignProblem, _pool: Pool | None) -> Search:
    """Minimise with COBYQA, first from the centre of the box."""
    return restarted(_cobyqa)


@method(start="given")
def start_cobyqa(_problem: DesignProblem, _pool: Pool | None) -> Search:
    """Minimise with COBYQA, first from the given start."""
    return restarted(_cobyqa)


@method()
def slsqp(_problem: DesignProblem, _pool: Pool | None) -> Search:
    """Minimise with SLSQP, first from the centre of the box; its differences are counted."""
    return restarted(_slsqp)


@method()
def de(_problem: DesignProblem, _pool: Pool | None) -> Search:
    """Minimise the merit by differential evolution with 4 members a variable."""

    def evolve(cube: UnitCube, generator: np.random.Generator) -> None:
        differential_evolution(
            cube.merit,
            [(0.0, 1.0)] * cube.dimensions,
            popsize=4,
            recombination=0.9,
            maxiter=10**9,
            tol=0.0,
            polish=False,
            rng=generator,
        )

    def search(evaluator: Evaluator) -> None:
        while True:
            evolve(UnitCube(evaluator), evaluator.generator)

    return search


def restarted(minimise: Minimise) -> Search:
    """Return the search that minimises from the given start or the centre, then from random points."""

    def search(evaluator: Evaluator) -> None:
        cube = UnitCube(evaluator)
        centre = np.full(cube.dimensions, 0.5)
        point = centre if evaluator.start is None else cube.point(evaluator.start)
        while True:
            minimise(cube, np.clip(point, 0.0, 1.0))
            point = cube.draw()

    return search


def _cobyqa(cube: UnitCube, point: FloatArray) -> None:
    radii = {"initial_tr_radius": FIRST_RADIUS, "final_tr_radius": LAST_RADIUS}
    _minimise(cube, point, "COBYQA", NonlinearConstraint(cube.limits, -np.inf, 0.0), radii)


def _slsqp(cube: UnitCube, point: FloatArray) -> None:
    kept = {"type": "ineq", "fun": lambda point: -cube.limits(point)}
    _minimise(cube, point, "SLSQP", kept, {"eps": DIFFERENCE, "ftol": TOLERANCE})


def _minimise(
    cube: UnitCube, point: FloatArray, name: str, constraints: Any, options: dict[str, float]
) -> None:
    bounds = Bounds(np.zeros_like(point), np.ones_like(point))
    minimize(
        cube.objective, point, method=name, bounds=bounds, constraints=constraints, options=options
    )
