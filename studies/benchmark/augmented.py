"""An opponent of the benchmark: pycma's CMA-ES, which adapts the weights of broken limits."""

from __future__ import annotations

import numpy as np

from pkm_gym.benchmark.methods import Search, method
from pkm_gym.benchmark.scratch import UnitCube
from pkm_gym.benchmark.session import Session
from pkm_gym.benchmark.view import View
from pkm_gym.core.types import FloatArray

SIGMA = 0.3  # the first step size, a share of the range
# No words, no files; with a prefix that names no folder none is made for them.
QUIET = {"verbose": -9, "verb_log": 0, "verb_filenameprefix": "cma"}


@method()
def cma_al(_view: View, _training: None) -> Search:
    """Search with CMA-ES and an augmented Lagrangian, from the centre, then from random points."""

    def search(session: Session) -> None:
        cube = UnitCube(session)
        start = np.full(cube.dimensions, 0.5)
        while True:
            _descend(cube, start, 1 + int(session.generator.integers(2**31)))
            start = cube.draw()

    return search


def _descend(cube: UnitCube, start: FloatArray, seed: int) -> None:
    """Run it from a point (d,) of the unit cube until it has converged."""
    from cma import CMAEvolutionStrategy, ConstrainedFitnessAL, constraints_handler, logger

    constraints_handler._Logger = logger.LoggerDummy  # pycma's own way to keep it from files
    lagrangian = ConstrainedFitnessAL(
        cube.objective, cube.limits, find_feasible_first=True, archives=()
    )
    settings = {"bounds": [0.0, 1.0], "seed": seed, **QUIET}
    optimiser = CMAEvolutionStrategy(start, SIGMA, settings)
    while not optimiser.stop():
        points = optimiser.ask()
        optimiser.tell(points, [lagrangian(point) for point in points])
        lagrangian.update(optimiser)
