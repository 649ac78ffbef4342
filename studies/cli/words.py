"""A problem and its designs as words of a command line: typed back, they are the same."""

from __future__ import annotations

import shlex
from typing import Any

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import called


def option_word(value: Any) -> str:
    """Return an option's value as ``--set`` takes it."""
    if value is None or isinstance(value, bool):
        return str(value).lower()
    return "x".join(map(repr, value)) if isinstance(value, tuple) else str(value)


def words_of(problem: DesignProblem, design: FloatArray | None = None) -> dict[str, str]:
    """Return what ``--set`` takes, with all digits: a design (d,), and what isn't by default.

    That is every task field and option that differs from its default, and the options that a report
    of a design sets otherwise.
    """
    words = {} if design is None else {k: repr(x) for k, x in problem.named(design).items()}
    usual = problem.task_type()
    for item in usual.variables():
        value = getattr(problem.task, item.name)
        if value != getattr(usual, item.name):
            words[f"task.{item.name}"] = repr(float(value))
    reported = {name: getattr(problem.options, name) for name in problem.declared.reporting}
    options = problem.options.changed() | reported
    return words | {name: option_word(value) for name, value in options.items()}


def evaluate_command(problem: DesignProblem, design: FloatArray) -> str:
    """Return the command that evaluates a design (d,) as this problem does."""
    names = [objective.name for objective in problem.objectives]
    usual = problem.declared.objectives[0].name
    asked = [] if names == [usual] else [f"--objective={name}" for name in names]
    settings = [f"{key}={text}" for key, text in words_of(problem, design).items()]
    return shlex.join(["pkm-gym", "evaluate", called(problem), *asked, "--set", *settings])
