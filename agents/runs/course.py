"""DesignCourse: the sessions that an agent is trained on, the tasks that it is scored on."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console

from pkm_gym.agents.designers.designer import Centre, Designer, Policy, Starts
from pkm_gym.agents.designers.files import write_designer
from pkm_gym.agents.runs.environments import find_spec, is_motion
from pkm_gym.agents.runs.files import Origin
from pkm_gym.agents.runs.recipe import Recipe
from pkm_gym.agents.runs.run import VALIDATION
from pkm_gym.benchmark.scoring import score
from pkm_gym.benchmark.splits import split_file
from pkm_gym.core.pool import Pool
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.solve import solve_tasks
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.design import DesignEnv
from pkm_gym.envs.vector import DesignVectorEnv
from pkm_gym.mechanisms import family_problem, lasting
from pkm_gym.studies.search.solving import Job, solve_rest

if TYPE_CHECKING:
    from stable_baselines3.common.vec_env import VecEnv


VALIDATION_TASKS = 64  # drawn and solved where no file of them is given
VALIDATION_SEED = 1


@dataclass(frozen=True)
class DesignCourse:
    """What a run trains and scores its agent on.

    Attributes:
        arguments: of ``DesignVectorEnv``.
        env: one environment of those arguments.
        starts: where the agent's sessions start on a task of its own.
        pool: solved tasks to train on, None where there are none.
        tasks: array (n, m), the tasks of the score.
        optima: array (n,), the log merit of their optima.
    """

    arguments: Mapping[str, Any]
    env: DesignEnv
    starts: Starts
    pool: Pool | None
    tasks: FloatArray
    optima: FloatArray

    @property
    def problem(self) -> DesignProblem:
        """The design problem."""
        return self.env.problem

    @property
    def problem_arguments(self) -> dict[str, Any]:
        """The arguments that the problem was made with, beside its name."""
        own = set(inspect.signature(DesignEnv.__init__).parameters)
        given = {name: value for name, value in self.arguments.items() if name not in own}
        return self.problem.declared.family_arguments(given) if self.env.opening.family else given

    @property
    def goal(self) -> str:
        """What the agent is scored on."""
        return f"{len(self.tasks)} validation tasks"

    def vec_env(self, n: int) -> VecEnv:
        """Return n sessions as Stable-Baselines3 wants them."""
        from pkm_gym.agents.sb3.session_env import SessionVecEnv

        return SessionVecEnv(self.sessions(n))

    def designer(self, policy: Policy) -> Designer:
        """Return the designer that a policy makes."""
        return Designer(self.problem, self.env.rules, policy, self.starts)

    def score(self, policy: Policy) -> float:
        """Return the benchmark's score of a policy."""
        return score(self.designer(policy).design(self.tasks).regrets(self.optima))

    def write(self, policy: Policy, path: Path, origin: Origin) -> None:
        """Write a policy as a designer."""
        known = replace(origin, pool=len(self.pool) if self.pool else 0)
        write_designer(self.designer(policy), path, known, self.problem_arguments)

    def sessions(self, n: int) -> DesignVectorEnv:
        """Return n sessions to train on."""
        return DesignVectorEnv(num_envs=n, **{"infos": False, **self.arguments})


def design_course(
    env_id: str,
    recipe: Recipe,
    folder: Path,
    *,
    pool: Path | None,
    validation: Path | None,
    screen: Console | None = None,
) -> DesignCourse:
    """Return the course of a run; what they need beside its files is written to its folder.

    Args:
        env_id: of the environment.
        recipe: of the run.
        folder: of the run.
        pool: file of solved tasks to train on, as ``pkm-gym solve-tasks`` writes it; None: the
            benchmark's training tasks, if they are needed.
        validation: file of solved tasks to be scored on; None: the benchmark's, or else tasks that
            are drawn and solved now.
        screen: where it is told if tasks are solved, which takes minutes; nowhere if None.

    Raises:
        ValueError: for an unknown id, an illegal argument, or a pool that is missing or bad.
    """
    arguments = {**find_spec(env_id).kwargs, **recipe.environment, "start": recipe.starts}
    if arguments.get("reward") == "objectives":
        raise ValueError("reward is 'objectives', a vector: agents are trained on a number")
    needed = recipe.starts == "interpolated" or arguments.get("reward") == "regret"
    if pool is not None:
        arguments["pool"] = str(pool)
    elif needed and arguments.get("family"):
        if _split(_problem(arguments), "train") is None:
            raise ValueError(f"{env_id} needs solved tasks to train on: give --pool FILE.npz")
        arguments["pool"] = "train"
    env = _environment(arguments)
    if validation is None and env.opening.family:
        validation = _split(env.problem, "val")
    scored = _validation(env, folder, validation, screen or Console(quiet=True))
    kept = scored.solvable
    optima = env.problem.evaluate(scored.designs[kept], scored.tasks[kept]).log_merit
    starts = env.opening.between.whole if env.opening.between else Centre(env.problem)
    return DesignCourse(arguments, env, starts, env.opening.pool, scored.tasks[kept], optima)


def course_for(
    env_id: str,
    recipe: Recipe,
    folder: Path,
    *,
    pool: Path | None,
    validation: Path | None,
    screen: Console | None = None,
) -> Any:
    """Return the course of a run, of a design or of a motion environment; see both."""
    spec = find_spec(env_id, motion=True)
    if is_motion(spec):
        from pkm_gym.agents.sb3.motion import motion_course

        return motion_course(spec, recipe, pool=pool, validation=validation)
    return design_course(spec.id, recipe, folder, pool=pool, validation=validation, screen=screen)


def check_course(env_id: str, recipe: Recipe, *files: Path | None) -> None:
    """Refuse the arguments of an environment, or files of solved tasks, before a run is begun.

    Raises:
        ValueError: in one sentence.
    """
    spec = find_spec(env_id, motion=True)
    if is_motion(spec):
        return
    problem = _problem({**spec.kwargs, **recipe.environment})
    for file in files:
        if file is not None:
            Pool.load(file, problem)


def _environment(arguments: Mapping[str, Any]) -> DesignEnv:
    """Return the environment that is trained on.

    Raises:
        ValueError: in one sentence, also where its pool can't be interpolated.
    """
    try:
        env = DesignEnv(**arguments)
        if env.opening.between:
            _ = env.opening.between.whole
    except np.linalg.LinAlgError:
        raise ValueError(
            f"{str(arguments['pool'])!r} has solvable tasks too few or too alike to interpolate "
            "between: solve more, or --set starts=centre"
        ) from None
    return env


def _problem(arguments: Mapping[str, Any]) -> DesignProblem:
    """Return the problem of an environment's arguments, before its pool is at hand."""
    plain = {k: v for k, v in arguments.items() if k not in ("pool", "start", "reward")}
    return DesignEnv(**plain).problem


def _split(problem: DesignProblem, split: str) -> Path | None:
    """Return the benchmark's file of a split, None where it has none of just this problem."""
    path = split_file(problem, split)
    plain = problem.hash() == family_problem(lasting(problem)).hash()
    return path if plain and path.exists() else None


def _validation(env: DesignEnv, folder: Path, given: Path | None, screen: Console) -> Pool:
    """Return the tasks of the score: those given, or drawn and solved once for the folder."""
    file = given or folder / VALIDATION
    if file.exists() or given:
        return Pool.load(file, env.problem)
    problem = env.problem
    if env.opening.family:
        tasks = problem.draw_tasks(VALIDATION_TASKS, np.random.default_rng(VALIDATION_SEED))
        screen.print(
            f"solving {len(tasks)} tasks to score the agent on, once: {file} keeps them",
            soft_wrap=True,
        )
        part = file.with_name(file.name + ".part")
        job = Job(problem, tasks, tasks[:0], VALIDATION_SEED, "pkm-gym train", part)
        solutions = solve_rest(job, job.kept(), screen)
        part.unlink(missing_ok=True)
    else:
        solutions = solve_tasks(problem, problem.pack(None)[None])
    pool = Pool.from_solutions(solutions, solutions.designs, problem, "pkm-gym train")
    pool.save(file)
    return pool
