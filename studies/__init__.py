"""Optuna studies of the design problems."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from optuna import Study

    from pkm_gym.core.problem import DesignProblem

__all__ = ["create_study"]


def create_study(problem: DesignProblem, **arguments: Any) -> Study:
    """Return a new study in the directions of a problem's objectives.

    Args:
        problem: the design problem.
        arguments: other ones of ``optuna.create_study``.

    Raises:
        ValueError: for a direction, which the problem says.
    """
    import optuna
    from optuna.study import StudyDirection

    if given := {"direction", "directions"} & arguments.keys():
        raise ValueError(f"{given.pop()} is what {problem.name} says: leave it out")
    directions = [StudyDirection[word.upper()] for word in problem.directions]
    return optuna.create_study(directions=directions, **arguments)
