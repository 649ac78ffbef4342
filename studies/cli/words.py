"""A problem and its designs as words of a command line: typed back, they are the same."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from typing import Any

from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.product import Product
from pkm_gym.core.task import Task
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import called

DIGITS = (6, 12, 17)  # of a height that is typed back, as few as give its ratio


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


def with_products(problem: DesignProblem, words: Mapping[str, str]) -> dict[str, str]:
    """Return words with heights and times in place of their ratios, where they mean just those."""
    said = dict(words)
    for name, product in problem.declared.products.items():
        ratio = f"task.{product.ratio}"
        if ratio in said and (value := _typed(product, problem.task)) is not None:
            said = {f"task.{name}" if k == ratio else k: x for k, x in said.items()}
            said[f"task.{name}"] = repr(value)
    return said


def _typed(product: Product, task: Task) -> float | None:
    """Return the shortest product that gives a task's ratio to the bit, None without one."""
    value = product.value(task)
    tried = (float(f"{value:.{digits}g}") for digits in DIGITS)
    wanted = getattr(task, product.ratio)
    return next((x for x in tried if product.share(x, vars(task)) == wanted), None)


def evaluate_command(problem: DesignProblem, design: FloatArray) -> str:
    """Return the command that evaluates a design (d,) as this problem does."""
    names = [objective.name for objective in problem.objectives]
    usual = problem.declared.objectives[0].name
    asked = [] if names == [usual] else [f"--objective={name}" for name in names]
    words = with_products(problem, words_of(problem, design))
    settings = [f"{key}={text}" for key, text in words.items()]
    return shlex.join(["pkm-gym", "evaluate", called(problem), *asked, "--set", *settings])
