"""Wrappers of a design environment: given tasks, a vector of objectives, a grid of designs."""

from __future__ import annotations

from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs

from pkm_gym.core.pool import Pool
from pkm_gym.core.trial import trial_values
from pkm_gym.core.types import FloatArray
from pkm_gym.envs.checks import finite
from pkm_gym.envs.design import DesignEnv, Observation
from pkm_gym.envs.infos import Info

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
        tasks: packed tasks (n, m), or a Pool, such as a split of the benchmark.

    Attributes:
        row: which task the running episode is about; -1 before the first.

    Raises:
        TypeError: if ``env`` is no design environment.
        ValueError: for another problem's pool, a wrong shape or an illegal task.
    """

    def __init__(self, env: Env, tasks: FloatArray | Pool) -> None:
        problem = design_env(env, "FixedTasks").problem
        if isinstance(tasks, Pool):
            if tasks.hash != problem.hash():
                raise ValueError(
                    f"the pool belongs to another problem (hash {tasks.hash[:12]}): FixedTasks "
                    f"needs one of {problem.name} (hash {problem.hash()[:12]})"
                )
            tasks = tasks.tasks
        n = max(1, len(tasks)) if np.ndim(tasks) else 1
        self.tasks = finite("tasks", tasks, (n, len(problem.task_variables)))
        problem.task_type.check_rows(self.tasks)
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


class MultiObjective(gym.Wrapper[Observation, Action, Observation, Action], RecordConstructorArgs):
    """Reward each step with a vector, one number for each objective, larger is better.

    It follows MO-Gymnasium: ``reward_space`` describes the vector, and ``step`` returns it as a
    float32 array (k,). It holds the objectives of the design that the step evaluated, those that
    are minimised with a minus; where the design breaks a constraint, each objective's ``worst``
    made worse by the violation. The scalar reward is ``info["scalar_reward"]``.

    Args:
        env: a design environment, made with ``objective=("...", "...")`` for several.

    Raises:
        TypeError: if ``env`` is no design environment.
    """

    def __init__(self, env: Env) -> None:
        self._inner = design_env(env, "MultiObjective")
        RecordConstructorArgs.__init__(self)
        gym.Wrapper.__init__(self, env)
        problem = self._inner.problem
        self._signs = np.array([-item.sign for item in problem.objectives])
        worst = self._signs * [item.worst for item in problem.objectives]
        lowest = (worst - len(problem.constraint_names)).astype(np.float32)
        self.reward_space = spaces.Box(lowest, np.full_like(lowest, np.inf), dtype=np.float32)

    def step(self, action: Action) -> tuple[Observation, npt.NDArray[np.float32], bool, bool, Info]:
        """Take the step; return the vector in place of the scalar reward."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        assert self._inner.evaluation is not None
        vector = self._signs * trial_values(self._inner.evaluation)[0]
        info["scalar_reward"] = float(reward)
        return observation, vector.astype(np.float32), terminated, truncated, info


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
