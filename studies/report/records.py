"""Problems and rows of designs as programs read them: SI, full digits, every unit stated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.task import Task
from pkm_gym.mechanisms import called
from pkm_gym.studies.report.rows import Row, dimensions_of


def asked(problem: DesignProblem, task: Task | None = None) -> dict[str, Any]:
    """Return what is asked: problem, objectives, options, task, and what its ratios make."""
    task = task or problem.task
    return {
        "mechanism": called(problem),
        "objective": [objective.name for objective in problem.objectives],
        "options": asdict(problem.options),
        "hash": problem.hash(),
        "task": asdict(task),
        "task_derived": {k: x for k, (x, _) in problem.declared.products_of(task).items()},
    }


def units_asked(problem: DesignProblem) -> dict[str, dict[str, str]]:
    """Return the units of what ``asked`` says."""
    return {
        "task": {v.name: v.unit for v in problem.task_variables},
        "task_derived": {name: p.unit for name, p in problem.declared.products.items()},
    }


def design_units(problem: DesignProblem) -> dict[str, dict[str, str]]:
    """Return the units of a design's variables and derived dimensions."""
    variables = {v.name: v.unit for v in problem.all_variables}
    return {"design": variables, "derived": dict(problem.derived_units)}


def units_told(problem: DesignProblem) -> dict[str, Any]:
    """Return the units of a row, and of what is asked."""
    return {**units_asked(problem), "value": problem.objectives[0].unit, **design_units(problem)}


def record(problem: DesignProblem, row: Row) -> dict[str, Any]:
    """Return a row with its derived dimensions."""
    derived = {name: value for name, (value, _) in dimensions_of(problem, row).items()}
    return {**asdict(row), "design": dict(row.design), "derived": derived}


def told(problem: DesignProblem, rows: Sequence[Row], **more: Any) -> dict[str, Any]:
    """Return what a verb says of a problem, with its table's rows; ``more`` is put between."""
    return {
        **asked(problem),
        **more,
        "units": units_told(problem),
        "rows": [record(problem, row) for row in rows],
    }


def solved_tasks(problem: DesignProblem, pool: Pool, path: Path) -> dict[str, Any]:
    """Return a pool of solved tasks, a row each."""
    return {
        **asked(problem),
        "pool": path,
        "units": units_told(problem),
        "rows": [_solved(problem, pool, i) for i in range(len(pool))],
    }


def _solved(problem: DesignProblem, pool: Pool, i: int) -> dict[str, Any]:
    task, design = problem.unpack(pool.tasks[i]), pool.designs[i]
    active = [name for name, on in zip(problem.constraint_names, pool.active[i], strict=True) if on]
    return {
        "solvable": bool(pool.solvable[i]),
        "certified": bool(pool.certified[i]),
        "value": float(pool.optima[i]),
        "design": problem.named(design),
        "derived": {name: value for name, (value, _) in problem.derived(design, task).items()},
        "task": asdict(task),
        "task_derived": {k: x for k, (x, _) in problem.declared.products_of(task).items()},
        "active": active,
    }
