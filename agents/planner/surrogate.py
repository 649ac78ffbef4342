"""Surrogate: a trained model of a problem near its optima, smooth pieces and their kinks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from pkm_gym.benchmark.interpolation import task_points
from pkm_gym.core.merit import CAP
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reading import check_arrays
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.observation import FAMILY_EDGE

BEYOND = 0.02  # how far beyond the Family's range (a range is 1.2) errors are twice as large

IntArray = npt.NDArray[np.intp]

ARRAYS = ("errors", "middle", "spread", "mean", "scale", "straight")  # of the tensors of a file

# Of the tensors of a file: f outputs, w numbers in each hidden layer, p pieces.
SHAPES: dict[str, tuple[str, tuple[int | str, ...]]] = {
    "middle": ("f", ("inputs",)),
    "spread": ("f", ("inputs",)),
    **dict.fromkeys(("errors", "mean", "scale"), ("f", ("f",))),
    "straight": ("f", ("f", "inputs", "p")),
    "columns": ("iu", ("columns",)),
    "weight.0": ("f", ("f", "inputs", "w")),
    "weight.1": ("f", ("f", "w", "w")),
    "weight.2": ("f", ("f", "w", "p")),
    "bias.0": ("f", ("f", 1, "w")),
    "bias.1": ("f", ("f", 1, "w")),
    "bias.2": ("f", ("f", 1, "p")),
}


class Layers(NamedTuple):
    """Arrays of the three layers: two hidden ones, and the one that makes the pieces."""

    first: FloatArray
    second: FloatArray
    last: FloatArray


class Pieces(NamedTuple):
    """The pieces of all outputs at n places.

    Attributes:
        values: array (n, outputs, pieces).
        slopes: array (n, outputs, pieces, d), over the places.
    """

    values: FloatArray
    slopes: FloatArray


@dataclass(frozen=True)
class Surrogate:
    """Small networks, one for each output, from a task and a design to the output's pieces.

    The first output is the log merit without its penalty. The others are the constraints that may
    hold an optimum back. A constraint is the largest of its pieces, for limits over a workspace
    have kinks: the worst pose jumps. The first output has one piece only.

    A task is given by its drawn fields (``task_points``); a design by its place in the
    unit cube.

    Attributes:
        problem: what is modelled.
        columns: array (outputs - 1,), the constraints among the problem's.
        errors: array (outputs,), the typical error near an optimum.
        middle, spread: arrays (inputs,), by which inputs are standardised.
        mean, scale: arrays (outputs,), by which outputs are.
        weights: arrays (outputs, in, out); what an output doesn't depend on has none.
        biases: arrays (outputs, 1, out).
        straight: array (outputs, inputs, pieces), weights from the inputs to the pieces.
    """

    problem: DesignProblem
    columns: IntArray
    errors: FloatArray
    middle: FloatArray
    spread: FloatArray
    mean: FloatArray
    scale: FloatArray
    weights: Layers
    biases: Layers
    straight: FloatArray

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the outputs."""
        return ("merit", *(self.problem.constraint_names[j] for j in self.columns))

    def pieces(self, point: FloatArray, places: FloatArray) -> Pieces:
        """Return the pieces at places (n, d) of a task's point (m,)."""
        m = len(point)
        inputs = (np.c_[np.tile(point, (len(places), 1)), places] - self.middle) / self.spread
        weights, biases = self.weights, self.biases
        seed = weights.first[:, m:] / self.spread[m:, None]  # (outputs, d, width)
        hidden, rise = _silu(inputs @ weights.first + biases.first)
        slopes = rise[:, :, None, :] * seed[:, None]  # (outputs, n, d, width)
        hidden, rise = _silu(hidden @ weights.second + biases.second)
        slopes = rise[:, :, None, :] * (slopes @ weights.second[:, None])
        values = hidden @ weights.last + biases.last + inputs @ self.straight
        straight = self.straight[:, m:] / self.spread[m:, None]
        slopes = slopes @ weights.last[:, None] + straight[:, None]
        scale = self.scale[:, None]
        made = values.swapaxes(0, 1) * scale + self.mean[:, None]
        made[:, 0, 1:] = -np.inf
        return Pieces(made, np.moveaxis(slopes, (1, 3), (0, 2)) * scale[..., None])

    def told(self, log_merit: FloatArray, constraints: FloatArray) -> FloatArray:
        """Return what evaluations say of the outputs: array (n, outputs), NaN where nothing.

        Args:
            log_merit: array (n,).
            constraints: array (n, c), all of the problem's.
        """
        return outputs(self.problem, log_merit, constraints)[:, np.r_[0, 1 + self.columns]]

    def point(self, task: FloatArray) -> FloatArray:
        """Return the point (m,) of a packed task."""
        return task_points(self.problem, task[None])[0]

    def errors_at(self, point: FloatArray) -> FloatArray:
        """Return the typical errors (outputs,) for a task's point (m,): larger beyond the range."""
        beyond = np.max(np.abs(point), initial=FAMILY_EDGE) - FAMILY_EDGE
        errors: FloatArray = self.errors * (1.0 + beyond / BEYOND)
        return errors

    def tensors(self) -> dict[str, Any]:
        """Return all arrays by name, for a file: float32 but for the columns."""
        arrays = {name: getattr(self, name) for name in ARRAYS}
        arrays |= {f"weight.{i}": array for i, array in enumerate(self.weights)}
        arrays |= {f"bias.{i}": array for i, array in enumerate(self.biases)}
        single = {name: array.astype(np.float32) for name, array in arrays.items()}
        return {"columns": self.columns.astype(np.int64), **single}

    @classmethod
    def of_tensors(cls, problem: DesignProblem, tensors: Mapping[str, Any]) -> Surrogate:
        """Return the surrogate of what ``tensors()`` returned.

        Raises:
            ValueError: in one sentence, for arrays that are missing or don't fit the problem.
        """
        size = sum(v.drawn for v in problem.task_variables) + len(problem.low)
        check_arrays(tensors, {**SHAPES, "middle": ("f", (size,))})
        columns, c = tensors["columns"].tolist(), len(problem.constraint_names)
        wanted = len(tensors["errors"]) - 1
        if len(columns) != wanted or not set(columns) <= set(range(c)):
            raise ValueError(f"columns is {columns}: it must number {wanted} of {c} constraints")
        weights, biases = (
            Layers(*(tensors[f"{kind}.{i}"].astype(float) for i in range(len(Layers._fields))))
            for kind in ("weight", "bias")
        )
        return cls(
            problem=problem,
            columns=tensors["columns"].astype(np.intp),
            weights=weights,
            biases=biases,
            **{name: tensors[name].astype(float) for name in ARRAYS},
        )


def outputs(problem: DesignProblem, log_merit: FloatArray, constraints: FloatArray) -> FloatArray:
    """Return log merits (n,) without their penalty, and constraints (n, c): array (n, 1 + c).

    NaN where the log merit is capped, for there it says nothing of the design.
    """
    penalty = problem.penalty_weight * np.maximum(0.0, constraints).sum(axis=1)
    whole = np.c_[log_merit - penalty, constraints]
    return np.where(log_merit[:, None] < CAP, whole, np.nan)


def _silu(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x / (1 + exp(-x)) and its derivative."""
    half = 0.5 + 0.5 * np.tanh(0.5 * x)
    return x * half, half * (1.0 + x * (1.0 - half))
