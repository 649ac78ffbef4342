"""What every test may ask for: each registered problem, the optima of its Family, usable designs.

Nothing here or in a test that runs over all problems knows one of them by name: what it must know
of a problem is declared, or it is drawn.
"""

from __future__ import annotations

import re
import resource
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from typing import Any

import hypothesis
import numpy as np
import pytest

import pkm_gym
import pkm_gym.twin  # before any test imports mujoco: it chooses how to draw without a screen
from pkm_gym import mechanisms
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import Solutions, solve_tasks
from pkm_gym.core.types import FloatArray
from pkm_gym.mechanisms import declaration

FEW, MANY = 32, 256  # tasks of a Family
DEAR = 4  # times as few where each task takes descents from many starts
USABLE = 60  # feasible designs of a Family
SLIGHTLY = 0.5  # the largest violation that counts as a slight one
PROBLEMS = frozenset(pkm_gym.problems())

Spread = Callable[[DesignProblem, np.random.Generator, int], tuple[FloatArray, FloatArray]]

# Kernels compile at their first call, so no deadline; derandomised, so that a failure repeats.
hypothesis.settings.register_profile("pkm_gym", deadline=None, derandomize=True, max_examples=60)
hypothesis.settings.load_profile("pkm_gym")


# Workers ------------------------------------------------------------------------------------------


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Give what is made of one problem, else what is in one file, to one worker.

    So what is dear to make of a problem, its solved tasks above all, is made once.
    """
    from xdist.scheduler.loadscope import LoadScopeScheduling

    class ByProblem(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file, _, test = nodeid.partition("::")
            named = PROBLEMS.intersection(re.split(r"[\[\]-]", test))
            return min(named, default=file)

    return ByProblem(config, log)


# Problems -----------------------------------------------------------------------------------------


@pytest.fixture(scope="session", params=pkm_gym.problems())
def problem(request: pytest.FixtureRequest) -> DesignProblem:
    """Each registered problem as it comes, with the paper's task."""
    return pkm_gym.make_problem(request.param)


@pytest.fixture(scope="session")
def family_problem(problem: DesignProblem) -> DesignProblem:
    """Each registered problem as its Family's tasks are designed for: often just as it comes."""
    return mechanisms.family_problem(problem.name) if problem.declared.family else problem


@pytest.fixture(
    scope="session",
    params=[name for name in pkm_gym.problems() if declaration(name).motion is not None],
)
def twinned(request: pytest.FixtureRequest) -> DesignProblem:
    """Each problem that drives its mechanism's twin."""
    return pkm_gym.make_problem(request.param)


@pytest.fixture
def rng() -> np.random.Generator:
    """A generator of fixed seed, new for each test."""
    return np.random.default_rng(43)


# Files --------------------------------------------------------------------------------------------


@pytest.fixture
def limited() -> Callable[[int], AbstractContextManager[None]]:
    """A context in which no file grows beyond so many bytes, as on a full disk."""

    @contextmanager
    def to(size: int) -> Iterator[None]:
        _, hard = before = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
        try:
            yield
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)

    return to


# Poses --------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def anywhere() -> Callable[[Mechanism, np.random.Generator, int], FloatArray]:
    """A function that draws n poses in and far around a workspace, most of them out of reach."""

    def drawn(machine: Mechanism, rng: np.random.Generator, n: int) -> FloatArray:
        known = machine.search_poses()
        known = known[np.isfinite(known).all(axis=1)]
        low, high = known.min(axis=0), known.max(axis=0)
        far = np.maximum(high - low, 0.1 * np.abs(known).max())
        return 0.5 * (low + high) + far * rng.uniform(-10.0, 10.0, (n, len(low)))

    return drawn


@pytest.fixture(scope="session")
def out_of_reach(anywhere: Callable) -> Callable[[Mechanism], FloatArray]:
    """A function that returns a pose (k,) that a machine doesn't reach."""

    def pose(machine: Mechanism) -> FloatArray:
        drawn = anywhere(machine, np.random.default_rng(12), 500)
        reached = np.isfinite(machine.inverse_kinematics(drawn)).all(axis=1)
        return drawn[~reached][0]

    return pose


# Tasks with their optima --------------------------------------------------------------------------


@pytest.fixture(scope="session")
def solved(family_problem: DesignProblem) -> Solutions:
    """A few tasks of the problem's Family, solved."""
    return _solved(family_problem.name, FEW)


@pytest.fixture(
    scope="session",
    params=[pytest.param(FEW, id="few"), pytest.param(MANY, id="many", marks=pytest.mark.slow)],
)
def family(
    family_problem: DesignProblem, solved: Solutions, request: pytest.FixtureRequest
) -> Solutions:
    """Solved tasks of the problem's Family: a few, and many among the slow tests."""
    return solved if request.param == FEW else _solved(family_problem.name, request.param)


@cache  # pytest makes a fixture of parameters anew in each file
def _solved(name: str, n: int) -> Solutions:
    own = declaration(name)
    problem = mechanisms.family_problem(name) if own.family else pkm_gym.make_problem(name)
    n = n // DEAR if own.starts else n
    return solve_tasks(problem, problem.draw_tasks(n, np.random.default_rng(2010)))


@pytest.fixture(scope="session")
def paper(problem: DesignProblem) -> Solutions:
    """The paper's task, solved."""
    found = solve_tasks(problem, problem.pack(None)[None])
    assert found.solvable[0], f"nothing is feasible for the task of {problem.name}"
    return found


# Designs ------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def spread() -> Spread:
    """A function that draws n designs all over the box, each with a task of the Family."""

    def drawn(
        problem: DesignProblem, rng: np.random.Generator, n: int
    ) -> tuple[FloatArray, FloatArray]:
        designs = problem.low + (problem.high - problem.low) * rng.random((n, len(problem.low)))
        return designs, problem.draw_tasks(n, rng)

    return drawn


@pytest.fixture(scope="session")
def design(problem: DesignProblem, paper: Solutions) -> FloatArray:
    """A feasible design (d,) of the paper's task: the printed one, or else the optimum."""
    printed = problem.printed_design()
    return printed if problem.evaluate(printed[None]).feasible[0] else paper.designs[0]


@pytest.fixture(scope="session")
def beside() -> Callable[[DesignProblem, FloatArray, FloatArray], FloatArray]:
    """A function that returns the farthest feasible designs found beside feasible ones (n, d)."""

    def found(problem: DesignProblem, designs: FloatArray, tasks: FloatArray) -> FloatArray:
        best = designs.copy()
        for near in _around(problem, designs, np.random.default_rng(9)):  # ever farther off
            feasible = problem.evaluate(near, tasks).feasible
            best[feasible] = near[feasible]
        return best

    return found


@pytest.fixture(scope="session")
def usable(
    family_problem: DesignProblem, solved: Solutions, spread: Spread, beside: Callable
) -> Evaluation:
    """Feasible designs, each for a task of the Family: drawn, or beside optima where few are."""
    designs, tasks = spread(family_problem, np.random.default_rng(7), 4000)
    lucky = np.flatnonzero(family_problem.evaluate(designs, tasks).feasible)[:USABLE]
    rows = np.resize(np.flatnonzero(solved.solvable), USABLE - len(lucky))
    near = beside(family_problem, solved.designs[rows], solved.tasks[rows])
    evaluation = family_problem.evaluate(
        np.concatenate([designs[lucky], near]), np.concatenate([tasks[lucky], solved.tasks[rows]])
    )
    assert evaluation.feasible.all()
    return evaluation


@pytest.fixture(scope="session")
def broken(family_problem: DesignProblem, usable: Evaluation) -> Evaluation:
    """Designs that are not feasible, each for a task of the Family, but not far from it."""
    found = [
        family_problem.evaluate(near, usable.tasks)
        for near in _around(family_problem, usable.designs, np.random.default_rng(10))
    ]
    kept = [~e.feasible & (e.constraints.max(axis=1) < SLIGHTLY) for e in found]
    designs = np.concatenate([e.designs[k] for e, k in zip(found, kept, strict=True)])
    tasks = np.concatenate([usable.tasks[k] for k in kept])
    some = np.random.default_rng(11).permutation(len(designs))[:USABLE]
    return family_problem.evaluate(designs[some], tasks[some])


def _around(
    problem: DesignProblem, designs: FloatArray, rng: np.random.Generator
) -> list[FloatArray]:
    """Designs of the box (n, d) beside designs (n, d), drawn ever farther off."""
    span = problem.high - problem.low
    offsets = [size * rng.normal(size=designs.shape) for size in np.geomspace(1e-4, 0.3, 40)]
    return [np.clip(designs + span * way, problem.low, problem.high) for way in offsets]
