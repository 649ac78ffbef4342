"""Opponents that know the training tasks and their optima, but run no model of their own."""

from __future__ import annotations

from pkm_gym.benchmark.ladder import Ladder
from pkm_gym.benchmark.methods import Search, method
from pkm_gym.benchmark.optima import KnownOptima
from pkm_gym.benchmark.scratch import UnitCube, descend, slsqp_inside
from pkm_gym.benchmark.session import Session
from pkm_gym.benchmark.training import Training
from pkm_gym.benchmark.view import View

RUNGS = 12
RUNGS_BEFORE = 6  # of COBYQA
RADII = (0.002, 0.02, 0.2)  # of COBYQA's trust regions at first, shares of the range


@method(knowledge="transfer")
def neighbours(view: View, training: Training) -> Search:
    """Evaluate the optimal designs of the nearest training tasks, the nearest first."""
    optima = KnownOptima(view, training)

    def search(session: Session) -> None:
        for design in optima.nearest(session.task, session.budget):
            session.evaluate(design)

    return search


@method(knowledge="transfer")
def interpolated(view: View, training: Training) -> Search:
    """Evaluate the interpolated optimum, then that of a task with corrected limits, and so on."""
    ladder = Ladder(view, training)

    def search(session: Session) -> None:
        ladder.climb(session, RUNGS)

    return search


@method(knowledge="transfer")
def interpolated_cobyqa(view: View, training: Training) -> Search:
    """Climb a few rungs of the ladder, then go on with COBYQA from the best of them.

    When it has converged it starts again where it is, with a larger trust region.
    """
    ladder = Ladder(view, training)

    def search(session: Session) -> None:
        ladder.climb(session, RUNGS_BEFORE)
        for radius in RADII:
            descend(session, session.answer, radius)

    return search


@method(knowledge="transfer")
def interpolated_slsqp(view: View, training: Training) -> Search:
    """Climb a few rungs of the ladder, then go on with SLSQP from the best of them."""
    ladder = Ladder(view, training)

    def search(session: Session) -> None:
        ladder.climb(session, RUNGS_BEFORE)
        cube = UnitCube(session)
        slsqp_inside(cube, cube.point(session.answer))

    return search
