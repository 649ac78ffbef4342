"""Samples: designs evaluated near optima, for a surrogate to be trained on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pkm_gym.agents.planner.nearby import Nearby
from pkm_gym.agents.planner.settings import NEAREST, Settings
from pkm_gym.agents.planner.surrogate import IntArray, outputs
from pkm_gym.benchmark.interpolation import task_points
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray

BATCH = 100_000  # designs evaluated at once
WITHIN = 0.02  # a constraint that comes no nearer to its limit holds no optimum back
SHARE = 1e-3  # of the samples, in which a constraint has to come so near
ROUNDING = 1e-10
PROBED = 2000  # samples by which it is seen what depends on what


@dataclass(frozen=True)
class Samples:
    """What was evaluated, k designs of each of n tasks near its optimum, or near that of another.

    Attributes:
        points: array (n, m), the tasks.
        places: array (n, k, d), the designs in the unit cube.
        distances: array (n, k), from that optimum.
        columns: array (f - 1,), the constraints that may hold an optimum back.
        told: array (n, k, f), the log merit without its penalty and those constraints; NaN where
            the merit is capped.
        depends: array (f, m), on which fields of the task each of them depends.
    """

    points: FloatArray
    places: FloatArray
    distances: FloatArray
    columns: IntArray
    told: FloatArray
    depends: BoolArray


def draw(
    problem: DesignProblem, pool: Pool, settings: Settings, steps: int, rng: np.random.Generator
) -> Samples:
    """Evaluate ``steps`` designs, as many for each task, near the optima of a pool.

    Distances from them are log-uniform. The tasks are the pool's solvable ones, or drawn from the
    Family; see ``Settings.tasks``.
    """
    tasks, optima = _tasks(problem, pool, settings.tasks, rng)
    (n, d), k = optima.shape, steps // len(tasks)
    directions = rng.standard_normal((n, k, d))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    distances = np.exp(rng.uniform(np.log(NEAREST), np.log(settings.farthest), (n, k)))
    places = np.clip(optima[:, None] + distances[..., None] * directions, 0.0, 1.0)
    every = np.repeat(tasks, k, axis=0)
    told = _told(problem, places.reshape(-1, d), every)
    near = np.nanquantile(told[:, 1:], 1.0 - SHARE, axis=0) > -WITHIN
    columns = np.flatnonzero(near)
    kept = np.r_[0, 1 + columns]
    probed = rng.integers(n * k, size=PROBED)
    depends = _depends(problem, places.reshape(-1, d)[probed], every[probed])[kept]
    return Samples(
        task_points(problem, tasks),
        places,
        distances,
        columns,
        told[:, kept].reshape(n, k, -1),
        depends,
    )


def _tasks(
    problem: DesignProblem, pool: Pool, drawn: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return tasks (n, m), and the place (n, d) near which each is sampled."""
    nearby = Nearby.of_pool(problem, pool)
    if not drawn:
        return pool.tasks[pool.solvable], nearby.places
    tasks = problem.draw_tasks(drawn, rng)
    optima = nearby.of(task_points(problem, tasks))
    return tasks, optima[np.arange(drawn), rng.integers(optima.shape[1], size=drawn)]


def _told(problem: DesignProblem, places: FloatArray, tasks: FloatArray) -> FloatArray:
    """Return the outputs (n, 1 + c) at places (n, d) for packed tasks (n, m)."""
    designs = problem.low + (problem.high - problem.low) * places
    told = []
    for at in range(0, len(designs), BATCH):
        made = problem.evaluate(designs[at : at + BATCH], tasks[at : at + BATCH])
        told.append(outputs(problem, made.log_merit, made.constraints))
    return np.concatenate(told)


def _depends(problem: DesignProblem, places: FloatArray, tasks: FloatArray) -> BoolArray:
    """Return which outputs (1 + c, m) change when a drawn field of the task is mirrored."""
    before = _told(problem, places, tasks)
    changes = []
    for i, variable in enumerate(problem.task_variables):
        if variable.drawn:
            mirrored = tasks.copy()
            mirrored[:, i] = variable.low + variable.high - tasks[:, i]
            change = np.abs(_told(problem, places, mirrored) - before)
            changes.append(np.nan_to_num(change).max(axis=0) > ROUNDING)
    return np.array(changes).T
