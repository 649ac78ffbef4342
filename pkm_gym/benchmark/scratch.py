"""Opponents that know nothing of other tasks: random, Sobol and SciPy's optimisers.

All of them search the unit cube that the box of the variables is mapped to. The local ones see the
constraints' values; after converging they start again from a random point, until the budget is
spent.
"""

from __future__ import annotations

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

# COBYQA's first trust region and its last, shares of the range.
FIRST_RADIUS, LAST_RADIUS = 0.1, 1e-8

DIFFERENCE = 1e-6  # of SLSQP's forward differences, a share of the range
TOLERANCE = 1e-12  # of SLSQP, in log merit

Minimise = Callable[["UnitCube", FloatArray], None]


class UnitCube:
    """A task as SciPy wants it: functions of a point (d,) of the unit cube.

    Whatever is asked of one design shares its one counted evaluation.
    """

    def __init__(self, evaluator: Evaluator) -> None:
        problem = evaluator.problem
        self.dimensions = len(problem.low)
        self.bounds = Bounds(np.zeros(self.dimensions), np.ones(self.dimensions))
        self._evaluator = evaluator
        self._low, self._high = problem.low, problem.high
        self._sign = problem.objectives[0].sign
        self._known: dict[bytes, Evaluation] = {}

    def point(self, design: FloatArray) -> FloatArray:
        """Return where a design (d,) lies."""
        return np.clip((design - self._low) / (self._high - self._low), 0.0, 1.0)

    def draw(self) -> FloatArray:
        """Return a random point (d,)."""
        return self._evaluator.generator.random(self.dimensions)

    def evaluate(self, point: FloatArray) -> Evaluation:
        """Return the evaluation of a point, counted when it is first asked for."""
        design = self._low + (self._high - self._low) * point
        design = np.clip(design, self._low, self._high)
        key = design.tobytes()
        if key not in self._known:
            self._known[key] = self._evaluator.evaluate(design)
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
def random(_problem: DesignProblem, _pool: Pool) -> Search:
    """Draw designs uniformly from the box."""

    def propose(problem: DesignProblem, _task: FloatArray, history: Evaluator) -> FloatArray:
        return history.generator.uniform(problem.low, problem.high)

    return proposing(propose)


@method()
def sobol(problem: DesignProblem, _pool: Pool) -> Search:
    """Take the points of a scrambled Sobol sequence."""

    def search(evaluator: Evaluator) -> None:
        sequence = qmc.Sobol(len(problem.low), rng=evaluator.generator)
        points = sequence.random_base2(int(np.ceil(np.log2(evaluator.budget))))
        evaluator.evaluate(problem.low + (problem.high - problem.low) * points)

    return search


@method()
def cobyqa(_problem: DesignProblem, _pool: Pool) -> Search:
    """Minimise with COBYQA, first from the centre of the box."""
    return restarted(_cobyqa)


@method(start="given")
def start_cobyqa(_problem: DesignProblem, _pool: Pool) -> Search:
    """Minimise with COBYQA, first from the given start."""
    return restarted(_cobyqa)


@method()
def slsqp(_problem: DesignProblem, _pool: Pool) -> Search:
    """Minimise with SLSQP, first from the centre of the box; its differences are counted."""
    return restarted(_slsqp)


@method()
def de(_problem: DesignProblem, _pool: Pool) -> Search:
    """Minimise the merit by differential evolution with 4 members a variable."""

    def search(evaluator: Evaluator) -> None:
        cube = UnitCube(evaluator)
        while True:
            differential_evolution(
                cube.merit,
                cube.bounds,
                popsize=4,
                recombination=0.9,
                maxiter=10**9,
                tol=0.0,
                polish=False,
                rng=evaluator.generator,
            )

    return search


def restarted(minimise: Minimise) -> Search:
    """Return the search that minimises from the given start or the centre, then at random."""

    def search(evaluator: Evaluator) -> None:
        cube = UnitCube(evaluator)
        centre = np.full(cube.dimensions, 0.5)
        point = centre if evaluator.start is None else cube.point(evaluator.start)
        cube.objective(point)  # COBYQA would move one that lies near a bound
        while True:
            minimise(cube, point)
            point = cube.draw()

    return search


def descend(evaluator: Evaluator, design: FloatArray, radius: float) -> None:
    """Minimise once with COBYQA, from a design (d,) and a first radius, a share of the range."""
    cube = UnitCube(evaluator)
    _cobyqa(cube, cube.point(design), radius)


def _cobyqa(cube: UnitCube, point: FloatArray, radius: float = FIRST_RADIUS) -> None:
    minimize(
        cube.objective,
        point,
        method="COBYQA",
        bounds=cube.bounds,
        constraints=NonlinearConstraint(cube.limits, -np.inf, 0.0),
        options={"initial_tr_radius": radius, "final_tr_radius": LAST_RADIUS},
    )


def _slsqp(cube: UnitCube, point: FloatArray) -> None:
    # In this form the limits are differentiated with the objective's step: at the same points.
    kept: Any = {"type": "ineq", "fun": lambda point: -cube.limits(point)}
    minimize(
        cube.objective,
        point,
        method="SLSQP",
        bounds=cube.bounds,
        constraints=kept,
        options={"eps": DIFFERENCE, "ftol": TOLERANCE},
    )
