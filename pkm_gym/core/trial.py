"""What an Optuna trial is told of a design; Optuna itself is not imported here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from pkm_gym.core.merit import LARGEST
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import converted, show
from pkm_gym.core.worst import Worst, declared_worst, worst_of

if TYPE_CHECKING:
    from pkm_gym.core.declaration import Objective
    from pkm_gym.core.evaluation import Evaluation
    from pkm_gym.core.problem import DesignProblem
    from pkm_gym.core.task import Task


def trial_values(evaluation: Evaluation, worst: Worst | None = None) -> FloatArray:
    """Return the values (n, k) of trials: objectives, made worse than any feasible one if not.

    So the best trial by value is the answer. ``worst`` is the declared one, which holds for every
    legal task, if it isn't given.
    """
    problem = evaluation.problem
    values, widths = worst or declared_worst(problem)
    columns = zip(evaluation.objectives.T, problem.objectives, values, widths, strict=True)
    return np.stack(
        [penalised(x, evaluation.constraints, o.sign, far, wide) for x, o, far, wide in columns],
        axis=1,
    )


def penalised(
    values: FloatArray, constraints: FloatArray, sign: float, worst: float, width: float
) -> FloatArray:
    """Return values (n,) of an objective, worse than any feasible one where constraints are broken.

    Such a design gets ``worst``, made worse by its violations (n, c): by less than ``width``.
    """
    excess = np.maximum(constraints, 0.0)
    violation = (excess / (1.0 + excess)).sum(axis=1)
    share = width / constraints.shape[1]
    feasible = (constraints <= 0.0).all(axis=1)
    return np.where(feasible, values, worst + sign * share * violation)


def descended_values(evaluation: Evaluation, worst: Worst) -> FloatArray:
    """Return values (n,) that rank designs as merit does, in the first objective's own unit.

    For a sampler that knows no constraints. A feasible design has its objective, another one what
    the exact penalty of merit makes of it, pressed together beyond ``worst``; where nothing can be
    evaluated, it is farther yet, the farther out of reach the more.
    """
    problem = evaluation.problem
    first, far, wide = problem.objectives[0], float(worst.values[0]), float(worst.widths[0])
    excess = np.maximum(evaluation.constraints, 0.0).sum(axis=1)
    values = evaluation.objectives[:, 0]
    with np.errstate(over="ignore", invalid="ignore"):
        made = np.exp(first.sign * problem.penalty_weight * excess)
        penalised = (first.offset + values) * made - first.offset
        beyond = first.sign * (penalised - far) / wide
    known = (evaluation.unreached <= 0.0) & (first.offset + values > 0.0)
    out = np.maximum(evaluation.unreached, 0.0)
    past = np.where(known, np.clip(beyond, 0.0, LARGEST), LARGEST)
    share = np.where(evaluation.unreached > 0.0, 1.0 + out / (1.0 + out), past / (1.0 + past))
    pressed = far + first.sign * wide * share
    near = known & (beyond <= 0.0)
    return np.where(evaluation.feasible, values, np.where(near, penalised, pressed))


def trial_attributes(evaluation: Evaluation, i: int) -> dict[str, Any]:
    """Return the user attributes of the trial of design i, as people read them.

    The indices, named with their units ("alpha_min [deg]"); feasible; log merit; and, where some
    variables have units, the design in words, since a trial's parameters are plain SI.
    """
    problem = evaluation.problem
    attributes: dict[str, Any] = {
        attribute_name(name, problem.unit(name)): converted(float(values[i]), problem.unit(name))[0]
        for name, values in evaluation.indices.items()
        if np.isfinite(values[i])
    }
    attributes["feasible"] = bool(evaluation.feasible[i])
    attributes["log_merit"] = float(evaluation.log_merit[i])
    if any(v.unit for v in problem.variables):
        values = zip(problem.variables, evaluation.designs[i].tolist(), strict=True)
        attributes["design"] = ", ".join(f"{v.name} = {show(x, v.unit)}" for v, x in values)
    return attributes


def attribute_name(name: str, unit: str) -> str:
    """Return the name of the user attribute that holds an index of this SI unit."""
    read = converted(0.0, unit)[1]
    return f"{name} [{read}]" if read else name


def told_objective(attributes: Mapping[str, Any], objective: Objective) -> float | None:
    """Return an objective in SI from the user attributes of a trial, None where they lack it.

    An undefined one is NaN.
    """
    name = attribute_name(objective.name, objective.unit)
    if objective.unit and objective.name in attributes:  # of an older version, without the unit
        return None
    return float(attributes.get(name, np.nan)) / converted(1.0, objective.unit)[0]


def record(trial: Any, evaluation: Evaluation, i: int) -> None:
    """Set the constraints and user attributes of the trial of design i."""
    names = evaluation.problem.constraint_names
    for name, value in zip(names, evaluation.constraints[i], strict=True):
        trial.set_constraint(name, float(value))
    for name, value in trial_attributes(evaluation, i).items():
        trial.set_user_attr(name, value)


class TrialObjective:
    """The objective of an Optuna study: ``study.optimize(problem.objective_for(task))``."""

    def __init__(self, problem: DesignProblem, task: Task) -> None:
        self.problem = problem
        self.task = task

    @cached_property
    def worst(self) -> Worst:
        """What no feasible design of the task reaches; measured at the first need."""
        return worst_of(self.problem, self.task)

    def values(self, evaluation: Evaluation) -> FloatArray:
        """Return the values (n, k) of trials of the task; see ``trial_values``."""
        return trial_values(evaluation, None if evaluation.feasible.all() else self.worst)

    def descended(self, evaluation: Evaluation) -> FloatArray:
        """Return the values (n,) for a sampler without constraints; see ``descended_values``."""
        return descended_values(evaluation, self.worst)

    def suggest(self, trial: Any) -> FloatArray:
        """Return the design (d,) that the trial's sampler proposes."""
        return np.array(
            [trial.suggest_float(v.name, v.low, v.high) for v in self.problem.variables]
        )

    def __call__(self, trial: Any) -> float | tuple[float, ...]:
        """Evaluate what the trial suggests; set its constraints and user attributes.

        Raises:
            ValueError: in a study of other directions than the problem's, which would find the
                worst design.
        """
        if hasattr(trial, "study"):
            self._check([direction.name.lower() for direction in trial.study.directions])
        evaluation = self.problem.evaluate(self.suggest(trial)[None], self.task)
        record(trial, evaluation, 0)
        values = tuple(map(float, self.values(evaluation)[0]))
        return values[0] if len(values) == 1 else values

    def _check(self, directions: Sequence[str]) -> None:
        wanted = self.problem.directions
        if tuple(directions) != wanted:
            names = " and ".join(objective.name for objective in self.problem.objectives)
            raise ValueError(
                f"the study is to {' and '.join(directions)}, but {names} of {self.problem.name} "
                f"to {' and '.join(wanted)}: make it with pkm_gym.studies.create_study(problem)"
            )
