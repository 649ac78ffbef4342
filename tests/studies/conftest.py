"""How the tests of the studies keep to a folder of their own and don't wait for pictures."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.studies.dashboard.pictures import Pictures
from pkm_gym.studies.search.search import SearchResult, search


@pytest.fixture
def diamond() -> DesignProblem:
    """The Diamond with the paper's task."""
    return pkm_gym.make_problem("diamond")


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    """Work in an empty folder; draw nothing."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(Pictures, "draw", lambda *_: [])
    monkeypatch.setattr(Pictures, "promise", lambda *_: None)


@pytest.fixture
def searched(request: pytest.FixtureRequest, diamond: DesignProblem) -> Callable[..., SearchResult]:
    """Search the Diamond at random, unless told otherwise, without pictures."""
    request.getfixturevalue("undrawn")

    def run(problem: DesignProblem = diamond, **arguments: Any) -> SearchResult:
        return search(problem, **{"sampler": "random", "trials": 30, "name": "a", **arguments})

    return run
