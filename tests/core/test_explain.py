"""Broken limits in words, of a problem that nobody registered."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest


def told(problem: Any, design: list[float]) -> list[str]:
    return problem.evaluate(np.array([design])).explain(0).splitlines()


def test_a_limit_of_an_index_says_where_it_is_worst(slider: Any) -> None:
    (sentence,) = told(slider(), [0.5, 0.3])
    assert sentence == (
        "slope: the steepest slope is 59.04 deg at x = 500 mm, 7.47 deg too large; it must be at "
        "most 51.57 deg"
    )


def test_a_limit_of_a_variable_or_of_the_whole_machine_has_no_place(slider: Any) -> None:
    assert told(slider(free="all"), [0.3, 1.45, 0.4, 0.35]) == [
        "size: the size is 2500 mm, 500 mm too large; it must be at most 2000 mm",
        "margin: the margin is -50 mm, 50 mm too small; it must be at least 0 mm",
        "short: rod is 1450 mm, 50 mm too large; it must be at most 1400 mm",
    ]


def test_out_of_reach_the_mechanism_says_how_far(slider: Any) -> None:
    assert told(slider(), [0.2, 0.2]) == ["reach: 100.0 mm are lacking"]


def test_on_the_edge_of_reach_the_nearest_own_limit_is_told(slider: Any) -> None:
    problem = slider(task={"way": 0.5})
    evaluation = problem.evaluate(np.array([[0.25, 0.25 - 5e-7]]))  # within the tolerance of reach
    assert evaluation.constraints[0, 1] <= 0.0 < evaluation.unreached[0]
    assert np.isnan(evaluation.objectives[0, 0])
    assert not evaluation.feasible[0]
    assert evaluation.explain(0) == "reach: 0.0 mm are lacking"


@pytest.mark.parametrize("design", [[np.nan, 1.0], [-0.1, 1.0], [np.inf, 1.0]])
def test_what_makes_no_machine_is_undefined_but_for_that(slider: Any, design: list[float]) -> None:
    evaluation = slider().evaluate(np.array([design]))
    assert evaluation.defined[0].tolist() == [True, False, False, False, False, False]
    assert evaluation.constraints[0, 1:] == pytest.approx(1.0 + evaluation.constraints[0, 0])
    assert [line.split(":")[0] for line in evaluation.explain(0).splitlines()] == ["dimensions"]


def test_where_every_limit_holds_it_says_so(slider: Any) -> None:
    assert told(slider(), [0.3, 0.5]) == ["feasible: every limit holds"]
