"""Session: the door to one task; every design that a method asks about is counted and kept."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from pkm_gym.benchmark.view import Told, View, fixed
from pkm_gym.core import merit
from pkm_gym.core.merit import WORST
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import BoolArray, FloatArray


class Spent(Exception):  # noqa: N818  # it ends a search like StopIteration, no error
    """The budget is used up. A method lets it pass: the run catches it."""


class Session:
    """One task of a benchmark, as a method sees it.

    Attributes:
        view: what is known of the design problem.
        task: array (m,), packed, in the order of ``view.task_names``.
        start: array (d,), the stored start, not evaluated; None in the *free* track.
        generator: of the random numbers a method may use: its results are then repeatable.
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
        self.view = View.of(problem)
        self.task = fixed(task)
        self.start = None if start is None else fixed(start)
        own, disturbing = np.random.SeedSequence(seed).spawn(2)
        self.generator = np.random.default_rng(own)
        self._problem, self._row, self._budget = problem, np.array(task)[None], budget
        self._count = 0
        self._noise, self._noise_generator = noise, np.random.default_rng(disturbing)
        self._delay = delay
        self._designs = np.empty((budget, d))
        self._values, self._log_merit = np.empty((2, budget))
        self._constraints = np.empty((budget, c))

    @property
    def budget(self) -> int:
        """How many designs may be evaluated."""
        return self._budget

    @property
    def count(self) -> int:
        """How many designs have been evaluated."""
        return self._count

    @property
    def designs(self) -> FloatArray:
        """Array (count, d), what was evaluated, in this order."""
        return self._designs[: self._count].copy()

    @property
    def values(self) -> FloatArray:
        """Array (count,), the objective as the method was told."""
        return self._values[: self._count].copy()

    @property
    def constraints(self) -> FloatArray:
        """Array (count, c), feasible when <= 0, as the method was told."""
        return self._constraints[: self._count].copy()

    @property
    def log_merit(self) -> FloatArray:
        """Array (count,), as the method was told."""
        return self._log_merit[: self._count].copy()

    @property
    def feasible(self) -> BoolArray:
        """Array (count,), whether every constraint holds, as the method was told."""
        return np.asarray((self._constraints[: self._count] <= 0.0).all(axis=1))

    @property
    def answer(self) -> FloatArray:
        """Array (d,), the best feasible design so far; without one that of lowest merit.

        Raises:
            ValueError: before anything is evaluated.
        """
        told = self.values, self.feasible, self.log_merit
        return self._designs[merit.answer(*told, self.view.objective.sign)].copy()

    def evaluate(self, designs: FloatArray) -> Told:
        """Evaluate a design (d,) or designs (n, d) of the task; each one counts.

        A batch that is larger than what is left is evaluated as far as the budget goes.

        Raises:
            Spent: if the budget does not hold for all of them.
            ValueError: for a wrong shape, a number that isn't finite, or a design outside the
                search bounds.
        """
        rows = np.array(designs, dtype=float, ndmin=2)
        self._check(rows)
        left = self._budget - self._count
        if left == 0:
            raise Spent
        told = self._disturbed(Told.of(self._problem.evaluate(rows[:left], self._row)))
        self._keep(told)
        if self._delay:
            time.sleep(self._delay * len(told))
        if len(rows) > left:
            raise Spent
        return told

    def _check(self, rows: FloatArray) -> None:
        low, high = self._problem.low, self._problem.high
        if rows.ndim != 2 or rows.shape[1] != len(low):
            raise ValueError(
                f"a design must have the shape ({len(low)},) or (n, {len(low)}), columns "
                f"{', '.join(self._problem.variable_names)}: got {rows.shape}"
            )
        outside = ~((rows >= low) & (rows <= high))
        if outside.any():
            i, j = np.argwhere(outside)[0]
            variable = self._problem.variables[j]
            raise ValueError(
                f"{variable.name} is {float(rows[i, j])!r}: designs must lie within the search "
                f"bounds, {variable.low:g} to {variable.high:g} {variable.unit}".rstrip()
            )

    def _disturbed(self, exact: Told) -> Told:
        """Return what the method is told: with noise, each number is off by a share of its size."""
        if not self._noise:
            return exact
        of_value = self._noise * self._noise_generator.standard_normal(len(exact))
        of_limits = self._noise_generator.standard_normal(exact.constraints.shape)
        return Told(
            exact.designs,
            exact.values * np.exp(self.view.objective.sign * of_value),
            exact.constraints + self._noise * of_limits,
            np.minimum(exact.log_merit + of_value, WORST),
        )

    def _keep(self, told: Told) -> None:
        rows = slice(self._count, self._count + len(told))
        self._designs[rows] = told.designs
        self._values[rows] = told.values
        self._constraints[rows] = told.constraints
        self._log_merit[rows] = told.log_merit
        self._count += len(told)
