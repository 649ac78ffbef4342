"""Counts that would take more memory than there is are refused before anything is done."""

from __future__ import annotations

from pkm_gym.core.problem import DesignProblem

MOST = 8_000_000_000  # bytes
NUMBER = 8  # bytes
COPIES = 3  # of solved tasks, where chunks are joined and written
TRIAL = 4_000  # bytes that Optuna keeps of a trial


def check_memory(what: str, number: int, each: int) -> None:
    """Refuse a number of things that take so many bytes each.

    Args:
        what: says it, such as "--trials".
        number: of them.
        each: bytes of one.

    Raises:
        ValueError: in one sentence: how much it would take, and what is allowed.
    """
    if number * each > MOST:
        raise ValueError(
            f"{what} {number} would take {number * each / 1e9:,.0f} GB of memory: choose at most "
            f"{MOST // each:,}"
        )


def solved_task(problem: DesignProblem) -> int:
    """Return the bytes of a task, its start, its optimum and what is known of it."""
    m, d, c = len(problem.task_variables), len(problem.low), len(problem.constraint_names)
    return COPIES * (NUMBER * (m + 2 * d + c + 3) + c + 2)
