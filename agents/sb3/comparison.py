"""Agents on one task: what came of their training, beside the searches of ``pkm-gym compare``."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback

from pkm_gym.agents.designers.designer import Centre, Designer
from pkm_gym.agents.runs.course import DesignCourse
from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.agents.runs.run import Run
from pkm_gym.agents.sb3.network import Network
from pkm_gym.agents.sb3.trainer import make_model
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.design import DesignEnv
from pkm_gym.mechanisms import lasting
from pkm_gym.studies.report.rows import Row, row_of

ALGORITHMS = ("ppo", "sac")


class AnswerKeeper(BaseCallback):
    """Keeps the answer of every session that training has finished."""

    def __init__(self, problem: DesignProblem) -> None:
        super().__init__()
        self._names = problem.variable_names
        self.answers: list[FloatArray] = []

    def _on_step(self) -> bool:
        ended = self.training_env.infos.get("final_info")  # type: ignore[attr-defined]  # SessionVecEnv
        if ended is not None:
            designs = ended["answer"]["design"]
            done = ended["_answer"]
            self.answers.append(np.column_stack([designs[name][done] for name in self._names]))
        return True


class TrainingResult(NamedTuple):
    """What came of training on one task.

    Attributes:
        best: the evaluation of the best design that training evaluated.
        final: the evaluation of the trained agent's own answer.
        evaluations: how many designs training evaluated.
    """

    best: Evaluation
    final: Evaluation
    evaluations: int


def train_on(
    problem: DesignProblem,
    algorithm: str,
    *,
    seed: int,
    steps: int | None = None,
    progress: Callable[[], None] = lambda: None,
) -> TrainingResult:
    """Train an agent on a problem's own task.

    Args:
        problem: with one objective.
        algorithm: "ppo" or "sac".
        seed: of the agent.
        steps: evaluations; as many as the recipe says if None.
        progress: called at the end.
    """
    course = course_on(problem)
    recipe = read_recipe(algorithm, "", steps=steps)
    with TemporaryDirectory() as folder:
        run = Run("", algorithm, seed, recipe, None, None, Path(folder))
        model = make_model(run, course)
        keeper = AnswerKeeper(problem)
        model.learn(recipe.steps, callback=keeper)
    answers = problem.evaluate(np.concatenate(keeper.answers))
    best = problem.evaluate(answers.designs[answers.best()][None])
    designer = Designer(problem, course.env.rules, Network.of_model(model), course.starts)
    final = problem.evaluate(designer.design(problem.task).answer.designs)
    progress()
    return TrainingResult(best, final, model.num_timesteps)


def algorithm_rows(
    problem: DesignProblem,
    optimum: Row | None,
    seeds: int,
    progress: Callable[[], None],
) -> dict[str, list[Row]]:
    """Return the rows of each algorithm's runs: the best of training, and the agent's own answer.

    Args:
        problem: with one objective.
        optimum: the row of the verified optimum, if there is one.
        seeds: runs of each.
        progress: called after each run.
    """
    torch.set_num_threads(1)  # more are slower for nets so small
    rows: dict[str, list[Row]] = {}
    for algorithm in ALGORITHMS:
        trained = [
            train_on(problem, algorithm, seed=seed, progress=progress) for seed in range(seeds)
        ]
        for name, evaluations in (
            (f"{algorithm}, training", [run.best for run in trained]),
            (f"{algorithm}, trained", [run.final for run in trained]),
        ):
            rows[name] = [
                row_of(f"{name}, seed {seed}", evaluation, 0, optimum, evaluations=run.evaluations)
                for seed, (evaluation, run) in enumerate(zip(evaluations, trained, strict=True))
            ]
    return rows


def course_on(problem: DesignProblem) -> DesignCourse:
    """Return the course of a problem as it is made, on its own task."""
    arguments: dict[str, Any] = {
        "problem": lasting(problem),
        "task": problem.task,
        "objective": [objective.name for objective in problem.objectives],
        "free": problem.variable_names,
        "fixed": dict(problem.fixed),
        "bounds": {v.name: (v.low, v.high) for v in problem.variables},
        **asdict(problem.options),
    }
    env = DesignEnv(**arguments)
    nothing = np.empty(0)
    return DesignCourse(
        {**arguments, "infos": True}, env, Centre(problem), None, nothing.reshape(0, 1), nothing
    )
