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

from pkm_gym.benchmark.methods import Search, method, proposing
from pkm_gym.benchmark.session import Session
from pkm_gym.benchmark.view import Told, View
from pkm_gym.core.types import FloatArray

# COBYQA's first trust region and its last, shares of the range.
FIRST_RADIUS, LAST_RADIUS = 0.1, 1e-8

DIFFERENCE = 1e-6  # of SLSQP's forward differences, a share of the range
TOLERANCE = 1e-12  # of SLSQP, in log merit
MARGIN = 1e-9  # by which SLSQP may be asked to keep limits
MANY = 10**9  # iterations: the budget ends the search

Minimise = Callable[["UnitCube", FloatArray], None]


class UnitCube:
    """A task as SciPy wants it: functions of a point (d,) of the unit cube.

    Whatever is asked of one design shares its one counted evaluation.
    """

    def __init__(self, session: Session) -> None:
        view = session.view
        self.dimensions = len(view.low)
        self.bounds = Bounds(np.zeros(self.dimensions), np.ones(self.dimensions))
        self._session = session
        self._low, self._high = view.low, view.high
        self._sign = view.objective.sign
        self._known: dict[bytes, Told] = {}

    def point(self, design: FloatArray) -> FloatArray:
        """Return where a design (d,) lies."""
        return np.clip((design - self._low) / (self._high - self._low), 0.0, 1.0)

    def draw(self) -> FloatArray:
        """Return a random point (d,)."""
        return self._session.generator.random(self.dimensions)

    def evaluate(self, point: FloatArray) -> Told:
        """Return the evaluation of a point, counted when it is first asked for."""
        design = self._low + (self._high - self._low) * point
        design = np.clip(design, self._low, self._high)
        key = design.tobytes()
        if key not in self._known:
            self._known[key] = self._session.evaluate(design)
        return self._known[key]

    def merit(self, point: FloatArray) -> float:
        """Return the log merit, penalties included."""
        return float(self.evaluate(point).log_merit[0])

    def objective(self, point: FloatArray) -> float:
        """Return the log of the first objective, to be minimised.

        Up to a constant it is the log merit without penalties; where nothing can be evaluated it is
        the log merit, which lies far above and falls towards the reach.
        """
        told = self.evaluate(point)
        value = told.values[0]
        if not value > 0.0:
            return float(told.log_merit[0])
        return self._sign * float(np.log(value))

    def limits(self, point: FloatArray) -> FloatArray:
        """Return the constraints (c,), <= 0 where feasible.

        Violations c are told as c / (1 + c): far outside they reach hundreds.
        """
        constraints = self.evaluate(point).constraints[0]
        return np.where(constraints > 0.0, constraints / (1.0 + np.abs(constraints)), constraints)


@method()
def random(_view: View, _training: None) -> Search:
    """Draw designs uniformly from the box."""

    def propose(session: Session) -> FloatArray:
        return session.generator.uniform(session.view.low, session.view.high)

    return proposing(propose)


@method()
def sobol(view: View, _training: None) -> Search:
    """Take the points of a scrambled Sobol sequence."""

    def search(session: Session) -> None:
        sequence = qmc.Sobol(len(view.low), rng=session.generator)
        points = sequence.random_base2(int(np.ceil(np.log2(session.budget))))
        session.evaluate(view.low + (view.high - view.low) * points)

    return search


@method()
def cobyqa(_view: View, _training: None) -> Search:
    """Minimise with COBYQA, first from the centre of the box."""
    return restarted(_cobyqa)


@method(start="given")
def start_cobyqa(_view: View, _training: None) -> Search:
    """Minimise with COBYQA, first from the given start."""
    return restarted(_cobyqa)


@method()
def slsqp(_view: View, _training: None) -> Search:
    """Minimise with SLSQP, first from the centre of the box; its differences are counted."""
    return restarted(_slsqp)


@method()
def slsqp_margin(_view: View, _training: None) -> Search:
    """Minimise with SLSQP, as above, every limit kept by a margin: where it ends is feasible."""
    return restarted(slsqp_inside)


@method()
def cobyla(_view: View, _training: None) -> Search:
    """Minimise with COBYLA, first from the centre of the box."""
    return restarted(_cobyla)


@method()
def de(_view: View, _training: None) -> Search:
    """Minimise the merit by differential evolution with 4 members a variable."""

    def search(session: Session) -> None:
        cube = UnitCube(session)
        while True:
            differential_evolution(
                cube.merit,
                cube.bounds,
                popsize=4,
                recombination=0.9,
                maxiter=MANY,
                tol=0.0,
                polish=False,
                rng=session.generator,
            )

    return search


def restarted(minimise: Minimise) -> Search:
    """Return the search that minimises from the given start or the centre, then at random."""

    def search(session: Session) -> None:
        cube = UnitCube(session)
        centre = np.full(cube.dimensions, 0.5)
        point = centre if session.start is None else cube.point(session.start)
        cube.objective(point)  # COBYQA would move one that lies near a bound
        while True:
            minimise(cube, point)
            point = cube.draw()

    return search


def descend(session: Session, design: FloatArray, radius: float) -> None:
    """Minimise once with COBYQA, from a design (d,) and a first radius, a share of the range."""
    cube = UnitCube(session)
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


def _cobyla(cube: UnitCube, point: FloatArray) -> None:
    # "catol" is what SciPy's types don't know
    options: Any = {"rhobeg": FIRST_RADIUS, "tol": LAST_RADIUS, "catol": 0.0, "maxiter": MANY}
    minimize(
        cube.objective,
        point,
        method="COBYLA",
        bounds=cube.bounds,
        constraints=NonlinearConstraint(cube.limits, -np.inf, 0.0),
        options=options,
    )


def slsqp_inside(cube: UnitCube, point: FloatArray) -> None:
    """Minimise once with SLSQP from a point (d,), every limit kept by a margin."""
    _slsqp(cube, point, MARGIN)


def _slsqp(cube: UnitCube, point: FloatArray, margin: float = 0.0) -> None:
    # In this form the limits are differentiated with the objective's step: at the same points.
    kept: Any = {"type": "ineq", "fun": lambda point: -cube.limits(point) - margin}
    minimize(
        cube.objective,
        point,
        method="SLSQP",
        bounds=cube.bounds,
        constraints=kept,
        options={"eps": DIFFERENCE, "ftol": TOLERANCE},
    )
