"""Random usable designs, to try a model on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem


@dataclass(frozen=True)
class Drawn:
    """Designs, each for a task of its own, with their machines."""

    evaluation: Evaluation
    machines: list[Any]


@pytest.fixture(scope="session")
def draw() -> Callable[[DesignProblem, int], Drawn]:
    """A function that draws n designs whose largest violation is less than 0.5."""

    def drawn(problem: DesignProblem, n: int) -> Drawn:
        rng = np.random.default_rng(2)
        designs = problem.low + (problem.high - problem.low) * rng.random(
            (20 * n, len(problem.low))
        )
        tasks = problem.draw_tasks(len(designs), rng)
        kept = np.flatnonzero((problem.evaluate(designs, tasks).constraints < 0.5).all(axis=1))[:n]
        assert len(kept) == n
        evaluation = problem.evaluate(designs[kept], tasks[kept])
        machines = [
            problem.mechanism(design, evaluation.task(i))
            for i, design in enumerate(evaluation.designs)
        ]
        return Drawn(evaluation, machines)

    return drawn
