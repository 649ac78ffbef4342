"""Tasks solved chunk after chunk: what an earlier run has solved and spent."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from pkm_gym.mechanisms import family_problem
from pkm_gym.studies.search.solving import Job, solve


@pytest.mark.parametrize("name", ["diamond", "stroke_leg"])
def test_what_an_earlier_run_has_spent_is_counted_once(tmp_path: Path, name: str) -> None:
    problem, screen = family_problem(name), Console(file=io.StringIO())
    tasks = problem.draw_tasks(2, np.random.default_rng(1))
    starts = np.repeat(problem.printed_design()[None], 2, axis=0)
    job = Job(problem, tasks, starts, 0, "a command", tmp_path / "pool.npz.part")
    first = solve(job, screen)
    again = solve(job, screen)
    np.testing.assert_array_equal(again.designs, first.designs)
    assert again.evaluations == first.evaluations > 0
    assert again.seconds == first.seconds > 0.0
