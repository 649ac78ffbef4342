"""Optuna studies of the design problems."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from optuna import Study

    from pkm_gym.core.problem import DesignProblem

__all__ = ["create_study"]


def create_study(problem: DesignProblem, *, merit: bool = False, **arguments: Any) -> Study:
    """Return a new study in the directions of a problem's objectives.

    Args:
        problem: the design problem.
        merit: whether its values are the merit, which is minimised, for a sampler that knows no
            constraints.
        arguments: other ones of ``optuna.create_study``.

    Raises:
        ValueError: for a direction, which the problem says.
    """
    import optuna
    from optuna.study import StudyDirection

    if given := {"direction", "directions"} & arguments.keys():
        raise ValueError(f"{given.pop()} is what {problem.name} says: leave it out")
    words = ("minimize",) if merit else problem.directions
    directions = [StudyDirection[word.upper()] for word in words]
    return optuna.create_study(directions=directions, **arguments)
