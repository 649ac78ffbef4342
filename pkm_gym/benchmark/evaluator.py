"""Evaluator: all that a method sees of a task; every design it asks about is counted and kept."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from pkm_gym.core import merit
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.merit import WORST
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray


class Spent(Exception):  # noqa: N818  # it ends a search like StopIteration, no error
    """The budget is used up. A method lets it pass: the run catches it."""


class Evaluator:
    """One task of a benchmark, as a method sees it.

    Attributes:
        problem: the design problem.
        task: array (m,), packed; ``problem.unpack(task)`` gives it by name.
        budget: how many designs may be evaluated.
        start: array (d,), the stored start, not evaluated; None in the *free* track.
        generator: of the random numbers a method may use: its results are then repeatable.
        count: how many designs have been evaluated.
    """

    def __init__(
        self,
        problem: DesignProblem,
        task: FloatArray,
        *,
        budget: int,
        start: FloatArray | None = None,
        seed: Any = 0,
        noise: float = 0.0,
        delay: float = 0.0,
    ) -> None:
        d, c = len(problem.low), len(problem.constraint_names)
        self.problem = problem
        self.task = task
        self.budget = budget
        self.start = start
        own, disturbing = np.random.SeedSequence(seed).spawn(2)
        self.generator = np.random.default_rng(own)
        self.count = 0
        self._noise, self._noise_generator = noise, np.random.default_rng(disturbing)
        self._delay = delay
        self._designs = np.empty((budget, d))
        self._values, self._log_merit = np.empty((2, budget))
        self._constraints = np.empty((budget, c))

    @property
    def designs(self) -> FloatArray:
        """Array (count, d), what was evaluated, in this order."""
        return self._designs[: self.count].copy()

    @property
    def values(self) -> FloatArray:
        """Array (count,), the first objective as the method was told."""
        return self._values[: self.count].copy()

    @property
    def constraints(self) -> FloatArray:
        """Array (count, c), feasible when <= 0, as the method was told."""
        return self._constraints[: self.count].copy()

    @property
    def log_merit(self) -> FloatArray:
        """Array (count,), as the method was told."""
        return self._log_merit[: self.count].copy()

    @property
    def feasible(self) -> BoolArray:
        """Array (count,), whether every constraint holds, as the method was told."""
        return np.asarray((self._constraints[: self.count] <= 0.0).all(axis=1))

    @property
    def answer(self) -> FloatArray:
        """Array (d,), the best feasible design so far; without one that of lowest merit.

        Raises:
            ValueError: before anything is evaluated.
        """
        told = self.values, self.feasible, self.log_merit
        return self._designs[merit.answer(*told, self.problem.objectives[0].sign)].copy()

    def evaluate(self, designs: FloatArray) -> Evaluation:
        """Evaluate a design (d,) or designs (n, d) of the task; each one counts.

        A batch that is larger than what is left is evaluated as far as the budget goes.

        Raises:
            Spent: if the budget does not hold for all of them.
            ValueError: for a wrong shape, a number that isn't finite, or a design outside the
                search bounds.
        """
        rows = np.array(designs, dtype=float, ndmin=2)
        self._check(rows)
        left = self.budget - self.count
        if left == 0:
            raise Spent
        evaluation = self._keep(self._disturbed(self.problem.evaluate(rows[:left], self._row)))
        if self._delay:
            time.sleep(self._delay * len(evaluation))
        if len(rows) > left:
            raise Spent
        return evaluation

    @property
    def _row(self) -> FloatArray:
        return self.task[None, :]

    def _check(self, rows: FloatArray) -> None:
        low, high = self.problem.low, self.problem.high
        if rows.ndim != 2 or rows.shape[1] != len(low):
            raise ValueError(
                f"a design must have the shape ({len(low)},) or (n, {len(low)}), columns "
                f"{', '.join(self.problem.variable_names)}: got {rows.shape}"
            )
        outside = ~((rows >= low) & (rows <= high))
        if outside.any():
            i, j = np.argwhere(outside)[0]
            variable = self.problem.variables[j]
            raise ValueError(
                f"{variable.name} is {float(rows[i, j])!r}: designs must lie within the search "
                f"bounds, {variable.low:g} to {variable.high:g} {variable.unit}".rstrip()
            )

    def _disturbed(self, exact: Evaluation) -> Evaluation:
        """Return what the method is told: with noise, each number is off by a share of its size."""
        if not self._noise:
            return exact
        of_value = self._noise * self._noise_generator.standard_normal(len(exact))
        of_limits = self._noise_generator.standard_normal(exact.constraints.shape)
        return exact.told(
            exact.objectives[:, 0] * np.exp(self.problem.objectives[0].sign * of_value),
            exact.constraints + self._noise * of_limits,
            np.minimum(exact.log_merit + of_value, WORST),
        )

    def _keep(self, told: Evaluation) -> Evaluation:
        rows = slice(self.count, self.count + len(told))
        self._designs[rows] = told.designs
        self._values[rows] = told.objectives[:, 0]
        self._constraints[rows] = told.constraints
        self._log_merit[rows] = told.log_merit
        self.count += len(told)
        return told
