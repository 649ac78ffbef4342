"""What the verbs hand to programs: SI units, a row each dimension."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.buildable.rounding import Rounded
from pkm_gym.studies.buildable.sensitivity import Sensitivity
from pkm_gym.studies.buildable.tolerance import Tolerances
from pkm_gym.studies.report.answer import handed_over
from pkm_gym.studies.report.records import asked, design_units, units_asked


def of_rounded(found: Rounded, path: Path) -> dict[str, Any]:
    """Return what a search of a lattice found, and the file of the design."""
    problem = found.best.problem
    return {
        **asked(problem),
        "start": _design(found.start),
        "built": _design(found.best),
        "cost": found.cost,
        "touched": {name: dict(steps) for name, steps in found.touched.items()},
        "reach": found.reach,
        "window": found.window,
        "examined": found.examined,
        **handed_over(found.best, path),
        "units": _units(problem, "start", "built"),
        "rows": [
            {
                "dimension": name,
                "unit": found.units[name],
                "start": x,
                "built": y,
                "on": name in found.lattice,
            }
            for name, (x, y) in found.dimensions.items()
        ],
    }


def of_tolerances(found: Tolerances, path: Path) -> dict[str, Any]:
    """Return what became of the machines, each of them left out."""
    problem, own = found.nominal.problem, found.objective
    return {
        **asked(problem),
        "nominal": _design(found.nominal),
        "machines": found.machines,
        "evaluations": found.evaluations,
        "yield": found.share,
        "broken": found.broken,
        "goal": found.goal,
        "margins": found.margins,
        "distribution": asdict(own),
        "constraints": {name: asdict(limit) for name, limit in found.constraints.items()},
        **handed_over(found.nominal, path),
        "units": _units(problem, "nominal"),
        "rows": [
            {
                "dimension": name,
                "unit": found.units[name],
                "sigma": sigma,
                "first": own.first.get(name),
                "total": own.total.get(name),
            }
            for name, sigma in found.sigma.items()
        ],
    }


def of_sensitivity(found: Sensitivity, path: Path) -> dict[str, Any]:
    """Return slopes, bends and prices."""
    problem, held = found.nominal.problem, found.multipliers
    return {
        **asked(problem),
        "nominal": _design(found.nominal),
        "hessian": found.hessian,
        "optimal": found.optimal,
        "left": held.left,
        "multipliers": {"limits": held.limits, "edges": held.edges},
        "prices": {
            "limits": {name: asdict(price) for name, price in found.limits.items()},
            "task": {name: asdict(price) for name, price in found.task.items()},
        },
        **handed_over(found.nominal, path),
        "units": _units(problem, "nominal"),
        "rows": [
            {
                "dimension": name,
                "unit": found.units[name],
                "value": value,
                "step": found.steps[name],
                "slope": found.gradient[name],
                "bend": found.hessian[k, k],
                "kink": name in found.kinks,
                "held": name in found.held,
            }
            for k, (name, value) in enumerate(found.values.items())
        ],
    }


def _design(evaluation: Evaluation) -> dict[str, Any]:
    """Return the first design of an evaluation: variables, indices, constraints."""
    problem = evaluation.problem
    constraints = zip(problem.constraint_names, evaluation.constraints[0], strict=True)
    return {
        "design": problem.named(evaluation.designs[0]),
        "feasible": bool(evaluation.feasible[0]),
        "indices": {name: values[0] for name, values in evaluation.indices.items()},
        "constraints": dict(constraints),
    }


def _units(problem: DesignProblem, *designs: str) -> dict[str, Any]:
    indices = {index.name: index.unit for index in problem.index_table}
    own = {"design": design_units(problem)["design"], "indices": indices}
    return {**units_asked(problem), **dict.fromkeys(designs, own)}
