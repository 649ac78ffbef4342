"""Small training runs: seconds long, on the Diamond's Family or on one of its variables."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import torch

import pkm_gym
from pkm_gym.agents.designers.designer import Centre, Designer
from pkm_gym.agents.planner.planner import Planner
from pkm_gym.agents.planner.surrogate import Layers, Surrogate
from pkm_gym.agents.runs.course import DesignCourse, design_course
from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.agents.runs.run import Run
from pkm_gym.agents.sb3.network import Layer, Network
from pkm_gym.envs.observation import observation_layout
from pkm_gym.envs.rules import Rules

SMALL = {
    "ppo": ["algorithm.n_steps=12", "algorithm.batch_size=48"],
    "sac": ["algorithm.learning_starts=60", "algorithm.buffer_size=1000"],
    "td3": ["algorithm.learning_starts=60", "algorithm.buffer_size=1000"],
    "tqc": ["algorithm.learning_starts=60", "algorithm.buffer_size=1000"],
}


@pytest.fixture(autouse=True)
def one_thread() -> None:
    """Results are equal to the bit on one thread only."""
    torch.set_num_threads(1)


@pytest.fixture
def small(tmp_path) -> Callable[..., tuple[Run, DesignCourse]]:
    """A function that prepares a run of a few hundred steps on the Diamond's ``gap``."""

    def prepared(
        algorithm: str = "ppo", *settings: str, env_id: str = "PKM/Diamond-v0", **given: Any
    ) -> tuple[Run, DesignCourse]:
        own = ["envs=8", "checkpoints=2", "policy.net_arch=[16,16]", "environment.free=['gap']"]
        recipe = read_recipe(
            algorithm, env_id, settings=[*own, *SMALL[algorithm], *settings],
            **{"steps": 384, **given},
        )  # fmt: skip
        folder = tmp_path / f"{algorithm}-{len(list(tmp_path.iterdir()))}"
        run = Run(env_id, algorithm, 7, recipe, None, None, folder, "a test")
        run.write()
        return run, design_course(run.env_id, recipe, folder, pool=None, validation=None)

    return prepared


@pytest.fixture
def random_network() -> Callable[..., Designer]:
    """A function that returns a designer of the Diamond with random weights."""

    def made(name: str = "diamond", **rules: Any) -> Designer:
        problem = pkm_gym.make_problem(name)
        size, d = observation_layout(problem)["step_size"].stop, len(problem.low)
        rng = np.random.default_rng(3)
        layers = tuple(
            Layer(rng.normal(0.0, 0.3, shape).astype(np.float32), np.zeros(shape[0], np.float32))
            for shape in ((16, size), (16, 16), (d, 16))
        )
        return Designer(problem, Rules(**rules), Network(layers, "silu", False), Centre(problem))

    return made


@pytest.fixture
def surrogate() -> Surrogate:
    """A surrogate of the Diamond with random weights, as a file keeps them."""
    problem = pkm_gym.make_problem("diamond")
    rng = np.random.default_rng(5)
    f, size, width, pieces = 4, 10, 6, 3
    shapes = ((f, size, width), (f, width, width), (f, width, pieces))
    drawn = Surrogate(
        problem=problem,
        columns=np.array([4, 5, 7]),
        errors=np.full(f, 1e-3),
        middle=rng.normal(0.0, 0.1, size),
        spread=rng.uniform(0.5, 1.0, size),
        mean=np.full(f, -0.1),
        scale=np.full(f, 0.1),
        weights=Layers(*(rng.normal(0.0, shape[1] ** -0.5, shape) for shape in shapes)),
        biases=Layers(*(rng.normal(0.0, 0.3, (f, 1, shape[2])) for shape in shapes)),
        straight=rng.normal(0.0, 0.3, (f, size, pieces)),
    )
    return Surrogate.of_tensors(problem, drawn.tensors())


@pytest.fixture
def random_planner(surrogate: Surrogate) -> Designer:
    """A designer that plans with a surrogate of random weights."""
    return Designer(surrogate.problem, Rules(), Planner(surrogate), Centre(surrogate.problem))


@pytest.fixture(params=["network", "planner"])
def designer(
    request: pytest.FixtureRequest, random_network: Any, random_planner: Designer
) -> Designer:
    """A designer of the Diamond of each kind."""
    return random_network() if request.param == "network" else random_planner
