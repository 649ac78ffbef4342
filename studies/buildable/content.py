"""What the verbs print as JSON: SI units, null where undefined."""

from __future__ import annotations

from dataclasses import asdict
from math import isfinite
from typing import Any

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.studies.buildable.rounding import Rounded
from pkm_gym.studies.buildable.sensitivity import Sensitivity
from pkm_gym.studies.buildable.tolerance import Tolerances


def of_design(evaluation: Evaluation) -> dict[str, Any]:
    """Return the first design of an evaluation: variables, task, indices, constraints."""
    problem = evaluation.problem
    return {
        "mechanism": problem.name,
        "objective": [objective.name for objective in problem.objectives],
        "options": asdict(problem.options),
        "task": asdict(problem.task),
        "design": problem.named(evaluation.designs[0]),
        "feasible": bool(evaluation.feasible[0]),
        "indices": {k: float(x[0]) for k, x in evaluation.indices.items()},
        "constraints": dict(
            zip(problem.constraint_names, evaluation.constraints[0].tolist(), strict=True)
        ),
    }


def of_rounded(found: Rounded) -> dict[str, Any]:
    """Return what a search of a lattice found."""
    told = {
        "start": of_design(found.start),
        "built": of_design(found.best),
        "dimensions": {
            name: {"start": x, "built": y, "unit": found.units[name], "on": name in found.lattice}
            for name, (x, y) in found.dimensions.items()
        },
        "cost": found.cost,
        "touched": {name: dict(steps) for name, steps in found.touched.items()},
        "reach": found.reach,
        "window": found.window,
        "examined": found.examined,
    }
    return _plain(told)


def of_tolerances(found: Tolerances) -> dict[str, Any]:
    """Return what became of the machines, each of them left out."""
    told = {
        "nominal": of_design(found.nominal),
        "sigma": found.sigma,
        "machines": found.machines,
        "evaluations": found.evaluations,
        "yield": found.share,
        "broken": found.broken,
        "goal": found.goal,
        "margins": found.margins,
        "objective": asdict(found.objective),
        "constraints": {name: asdict(own) for name, own in found.constraints.items()},
    }
    return _plain(told)


def of_sensitivity(found: Sensitivity) -> dict[str, Any]:
    """Return slopes, bends and prices."""
    told = {
        "nominal": of_design(found.nominal),
        "steps": found.steps,
        "gradient": found.gradient,
        "hessian": found.hessian.tolist(),
        "kinks": found.kinks,
        "optimal": found.optimal,
        "left": found.multipliers.left,
        "multipliers": {
            "limits": found.multipliers.limits,
            "edges": found.multipliers.edges,
        },
        "prices": {
            "limits": {name: asdict(price) for name, price in found.limits.items()},
            "task": {name: asdict(price) for name, price in found.task.items()},
        },
    }
    return _plain(told)


def _plain(told: Any) -> Any:
    """Return the same with text for keys, and null for numbers that JSON can't hold."""
    if isinstance(told, dict):
        return {str(key): _plain(value) for key, value in told.items()}
    if isinstance(told, list | tuple):
        return [_plain(value) for value in told]
    return None if isinstance(told, float) and not isfinite(told) else told
