"""Wrappers of a design environment: given tasks, a grid of designs."""

from __future__ import annotations

from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from pkm_gym.core.pool import Pool
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.checks import finite
from pkm_gym.envs.design import DesignEnv, Observation
from pkm_gym.envs.infos import Info
from pkm_gym.envs.opening import read_pool

Action: TypeAlias = npt.NDArray[Any]
Env: TypeAlias = gym.Env[Observation, Action]


def design_env(env: Any, wrapper: str) -> DesignEnv:
    """Return the design environment that is wrapped.

    Raises:
        TypeError: if there is none.
    """
    inner = env.unwrapped if isinstance(env, gym.Env) else env
    if not isinstance(inner, DesignEnv):
        raise TypeError(
            f"{wrapper} wraps a design environment, such as gym.make('PKM/Diamond-v0'): "
            f"got {type(inner).__name__}"
        )
    return inner


class FixedTasks(gym.Wrapper[Observation, Action, Observation, Action], RecordConstructorArgs):
    """Go through given tasks in order, one an episode, and begin again after the last.

    Neither a seed nor a draw changes the order, so that everyone is measured on the same tasks.

    Args:
        env: a design environment.
        tasks: packed tasks (n, m), or a Pool, such as a split of the benchmark: those of its tasks
            that are solvable, since the others have no optimum to be measured by.

    Attributes:
        tasks: array (n, m), packed, the tasks that it goes through.
        row: which task the running episode is about; -1 before the first.

    Raises:
        TypeError: if ``env`` is no design environment.
        ValueError: for another problem's pool or one without a solvable task, a wrong shape, an
            illegal task, or one without a stored optimum where the environment needs it.
    """

    def __init__(self, env: Env, tasks: FloatArray | Pool) -> None:
        inner = design_env(env, "FixedTasks")
        problem = inner.problem
        if isinstance(tasks, Pool):
            pool = read_pool(problem, tasks)
            tasks = pool.tasks[pool.solvable]
        n = max(1, len(tasks)) if np.ndim(tasks) else 1
        self.tasks = finite("tasks", tasks, (n, len(problem.task_variables)))
        problem.task_type.check_rows(self.tasks)
        inner.opening.check_stored(self.tasks)
        self.row = -1
        RecordConstructorArgs.__init__(self, tasks=self.tasks.tolist())
        gym.Wrapper.__init__(self, env)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Start a session on the next task.

        Raises:
            ValueError: for the option "task".
        """
        if options and "task" in options:
            raise ValueError("reset option task: FixedTasks chooses the tasks itself, leave it out")
        row = (self.row + 1) % len(self.tasks)
        result = self.env.reset(seed=seed, options={**(options or {}), "task": self.tasks[row]})
        self.row = row
        return result


class DesignGrid(
    gym.ActionWrapper[Observation, np.int64, Action],
    RecordConstructorArgs,
):
    """Choose among the designs of a grid by number, for learners such as DQN.

    It is ``problem.grid()``: the paper's values where it prints them, steps of ours elsewhere.

    Args:
        env: a design environment, made with ``action_mode="absolute"``.

    Attributes:
        designs: array (n, d), the grid; action i evaluates design i.

    Raises:
        TypeError: if ``env`` is no design environment.
        ValueError: if its problem has no grid, none of it lies within the bounds, or its actions
            are relative.
    """

    def __init__(self, env: Env) -> None:
        inner = design_env(env, "DesignGrid")
        problem, mode = inner.problem, inner.rules.action_mode
        designs = problem.grid()
        if designs is None:
            raise ValueError(f"{problem.name} has no grid of designs: DesignGrid needs one")
        if len(designs) == 0:
            raise ValueError(f"no design of the grid lies within the bounds of this {problem.name}")
        if mode != "absolute":
            raise ValueError(
                f"action_mode is {mode!r}: DesignGrid needs an environment made with "
                "action_mode='absolute'"
            )
        RecordConstructorArgs.__init__(self)
        gym.ActionWrapper.__init__(self, env)
        self.designs = designs
        self.action_space = spaces.Discrete(len(designs))
        self._actions = 2.0 * (designs - problem.low) / (problem.high - problem.low) - 1.0

    def action(self, action: np.int64) -> Action:
        """Return the jump (d,) to a design of the grid.

        Raises:
            ValueError: for what is no number of a design.
        """
        if not self.action_space.contains(action):
            raise ValueError(
                f"action is {action!r}: it must be a whole number from 0 to {len(self.designs) - 1}"
            )
        return self._actions[int(action)].copy()
