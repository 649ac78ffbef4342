"""The design that a verb starts from: what the user gives, else the optimum of the task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.cli.arguments import design_from
from pkm_gym.studies.cli.settings import Texts
from pkm_gym.studies.cli.terminal import console
from pkm_gym.studies.report.rows import in_full
from pkm_gym.studies.search.polish import told_optimum


@dataclass(frozen=True)
class Start:
    """A design to begin with.

    Attributes:
        problem: with the task.
        design: array (d,).
        words: what it is.
        notes: how it was completed.
    """

    problem: DesignProblem
    design: FloatArray
    words: str
    notes: tuple[str, ...] = ()


def start_from(
    name: str,
    set_: Texts = None,
    design: Path | None = None,
    objective: Sequence[str] | None = None,
    free: Sequence[str] | None = None,
) -> Start:
    """Return the design that ``--set`` or a file gives, or else the optimum of the task.

    Raises:
        ValueError: in one sentence, as ``design_from`` does, or where nothing feasible is known.
    """
    given = design_from(name, set_, objective=objective, free=free, file=design)
    problem = given.problem.with_task(given.task)
    if given.names:
        return Start(problem, given.design, "the given design", given.notes)
    optimum = told_optimum(console(), problem)
    if optimum is None:
        raise ValueError(
            "no feasible design of this task is known: give one with --design or --set"
        )
    named = {v: optimum.design[v] for v in problem.variable_names}
    return Start(problem, problem.design(named), f"the {in_full(optimum)}")
