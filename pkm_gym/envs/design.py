"""DesignEnv: one design session at a time."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import numpy.typing as npt
from gymnasium import spaces
from gymnasium.error import ResetNeeded

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.names import check_known
from pkm_gym.envs.checks import check_arguments, finite
from pkm_gym.envs.infos import Info, session_info, single
from pkm_gym.envs.objectives import RewardSpace
from pkm_gym.envs.observation import observation_layout, observe
from pkm_gym.envs.opening import Opening, PoolLike
from pkm_gym.envs.rendering import Frame, Painter, Window
from pkm_gym.envs.rules import Rules
from pkm_gym.envs.session import Session
from pkm_gym.mechanisms import family_problem, make_problem

Observation = npt.NDArray[np.float32]
ONLY = np.arange(1)


class DesignEnv(RewardSpace, gym.Env[Observation, npt.NDArray[Any]]):
    """An episode is a design session: a few evaluations to find the best design for a task.

    ## Description
    A parallel kinematic machine is to be dimensioned for a task (its workspace, its payload, the
    bounds of its performance indices). A *design* is a point in a box of ``d`` variables. Its
    *merit* is one positive number, smaller is better: objective over the task's scale, raised by
    what breaks the constraints. It is about 1 at the optimum, and its logarithm is at most 7.

    Each step evaluates one design near the best one so far (the *incumbent*, of lowest merit); the
    steps shrink from the whole range of the box to a small share of it. After ``budget`` steps the
    session ends. Its *answer* is the best feasible design by the objective itself, since the
    lowest merit may belong to a slightly infeasible one.

    ## Action Space
    ``Box(-1, 1, (d,), float32)``; values beyond are clipped, NaN and infinity are refused.

    | action_mode | design that is evaluated, clipped to the box |
    |---|---|
    | "relative" | best + action * step * (high - low) |
    | "absolute" | low + (action + 1) / 2 * (high - low) |

    step = max(step_min, step_first * step_decay^t), t = 0 at the first step.

    ## Observation Space
    ``Box(-1, 1, (m + 2 d + 3 c + 6,), float32)`` for ``m`` numbers of a task and ``c`` constraints.
    ``observation_layout`` holds the slice of each part. Fixed and Family ids share it, unless the
    Family frees other variables.

    | part | size | content |
    |---|---|---|
    | task | m | the Family's range to +-0.6, the legal range to +-1; 0 where it isn't drawn |
    | best_design | d | the best design so far, the box to +-1 |
    | best_merit | 1 | tanh(log merit / 3) of it |
    | best_constraints | c | tanh(constraints) of it |
    | zoom_constraints | c | tanh(constraints / (2 step)) of it |
    | other_design | d | (other - best) / (4 step), in shares of the range, clipped |
    | other_merit | 1 | tanh((log merit of the other - of the best) / step) |
    | other_constraints | c | tanh(constraints / (2 step)) of the other |
    | evaluated | 2 | whether the best, and the other, have been evaluated: 0 or 1 |
    | budget_left | 1 | share of the budget that is left |
    | step_size | 1 | 1 + log10(step) / 2 |

    The *other* point is the one that lost the latest comparison with the best. Until the best has
    been evaluated its log merit counts as 7 and its constraints as 0; until the other has, its
    parts are 0.

    ## Rewards
    With ``best`` the lowest log merit so far, 7 before the first evaluation:

    | reward | of a step |
    |---|---|
    | "improvement" | best before - best after; the return is 7 - best |
    | "final" | -best on the last step, 0 before |
    | "regret" | 0.3 log((r before + e) / (r after + e)), r = max(0, best - optimum) |
    | "objectives" | a float32 array (k,) of the design's objectives, larger is better |

    e is ``regret_floor``. "regret" needs tasks solved beforehand: a ``pool``, or the paper's own
    problem, whose verified optimum is known.

    "objectives" follows MO-Gymnasium, whose ``make`` expects a vector: ``unwrapped.reward_space``
    describes it. It has the objectives that ``objective=`` names, those that are minimised with a
    minus; where the design breaks a constraint, each one's ``worst`` made worse by the violation.

    ## Starting State
    The incumbent is the centre of the box, a random design (``start="random"``), the one stored
    with the task (``start="pool"``) or one between the pool's optima (``start="interpolated"``: for
    a task of the pool from the seven eighths of the others, for any other task from them all). It
    is not evaluated yet. A Family draws a new task, from the pool's
    solvable ones if there is one. ``reset(options={"task": ..., "design": ...})`` gives either: the
    task as a mapping of the fields that differ from the paper's or packed (m,), the design as a
    mapping of the variables or an array (d,), in SI units.

    ## Episode End
    ``terminated`` after ``budget`` steps, which the observation shows; ``truncated`` never.

    ## Info
    ``task``; ``design`` (evaluated in the step) with its ``indices``, ``constraints``, ``feasible``
    and ``merit``; ``best_design``; ``answer`` with its ``design``, ``objective``, ``merit`` and
    ``feasible``. Numbers are named and in SI units, ``units`` says which. The keys are always the
    same. An index that isn't defined is infinite, ``defined`` says which are. After a reset all
    designs are the start: nothing has been evaluated, no index is defined, nothing is feasible, and
    the numbers are infinite.

    ## Arguments
    See ``__init__``. Given as Python's numbers, strings, lists and mappings, or as a Task, they
    survive ``EnvSpec.to_json``; Gymnasium doesn't write arrays, paths, sets, enums and Pools.

    ## Version History
    * v0: initial version

    ## References
    The paper of each mechanism is named on its page, docs/mechanisms.
    """

    metadata = {"render_modes": ["human", "rgb_array"], "render_fps": 2}  # noqa: RUF012 (Gymnasium's convention)

    def __init__(
        self,
        problem: str,
        *,
        family: bool = False,
        budget: int | None = None,
        step_first: float = 1.0,
        step_decay: float = 0.5,
        step_min: float = 5e-4,
        action_mode: str = "relative",
        reward: str = "improvement",
        regret_floor: float = 1e-5,
        start: str = "centre",
        pool: PoolLike | None = None,
        render_mode: str | None = None,
        renderer: str = "matplotlib",
        **arguments: Any,
    ) -> None:
        """Make the environment of a design problem.

        Args:
            problem: name of the problem, such as "diamond".
            family: draw a new task for each episode; otherwise it is the problem's. The problem is
                then made with what its declaration says of the Family, see
                ``pkm_gym.mechanisms.family_problem``.
            budget: steps, and so evaluations, of an episode; 12 unless the problem declares more.
            step_first: size of the first step, a share of the range.
            step_decay: ratio of the next step to this one.
            step_min: the smallest step.
            action_mode: "relative" to the best design so far, or "absolute" in the box.
            reward: "improvement", "final", "regret" or "objectives".
            regret_floor: what "regret" counts as solved.
            start: "centre", "random", "pool" or "interpolated", which takes seconds where a pool
                has thousands of tasks.
            pool: solved tasks: a file as ``pkm-gym solve-tasks`` writes it, the name of one of the
                benchmark's splits such as "train", or a Pool.
            render_mode: "rgb_array", "human" or None.
            renderer: "matplotlib": a sheet with the machine, its map and its numbers; "mujoco": the
                machine as a camera sees it, which needs OpenGL.
            arguments: of the problem, see ``pkm_gym.make_problem``: ``task``, ``objective``,
                ``free``, ``fixed``, ``bounds`` and its options.

        Raises:
            ValueError: for an unknown name, with its closest match, an illegal value, or a pool
                that is missing, bad or another problem's.
        """
        check_arguments(problem, arguments, DesignEnv)
        if render_mode is not None:
            check_known("render_mode", [render_mode], self.metadata["render_modes"])
        made = family_problem if family else make_problem
        self.problem = made(problem, **arguments)
        self.rules = Rules(
            self.problem.declared.evaluations if budget is None else budget,
            step_first,
            step_decay,
            step_min,
            action_mode,
            reward,
            regret_floor,
        )
        self.opening = Opening(
            self.problem, family=family, start=start, pool=pool, regret=reward == "regret"
        )
        self.observation_layout = observation_layout(self.problem)
        size = self.observation_layout["step_size"].stop
        self.observation_space = spaces.Box(-1.0, 1.0, (size,), np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, (len(self.problem.low),), np.float32)
        self.render_mode = render_mode
        self.session = Session(self.problem, self.rules, 1)
        self.painter = Painter(self.problem, renderer)
        self.evaluation: Evaluation | None = None  # of the latest step
        self._window = Window()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, Info]:
        """Start a new session; see "Starting State" for the options.

        Raises:
            ValueError: for an unknown option, an illegal value, or a task without a stored optimum
                where one is needed.
        """
        super().reset(seed=seed)
        self.session.open(ONLY, *self.opening.draw([self.np_random], options))
        if self.render_mode == "human":
            self.render()
        return self._observation(), single(session_info(self.session, ONLY, None))

    def step(self, action: npt.NDArray[Any]) -> tuple[Observation, Any, bool, bool, Info]:
        """Evaluate the design that the action means.

        Raises:
            ValueError: for a wrong shape or type, NaN or infinity; nothing has changed then.
            ResetNeeded: before the first reset and after the end of the episode.
        """
        actions = finite("action", action, self.problem.low.shape)[None]
        if self.session.left[0] == 0:
            raise ResetNeeded("the episode is over or has not begun: call reset()")
        self.evaluation, rewards = self.session.step(ONLY, actions)
        if self.render_mode == "human":
            self.render()
        info = single(session_info(self.session, ONLY, self.evaluation))
        terminated = bool(self.session.left[0] == 0)
        reward = float(rewards[0]) if rewards.ndim == 1 else rewards[0]
        return self._observation(), reward, terminated, False, info

    def render(self) -> Frame | None:
        """Draw the design that was evaluated last (the start, before the first step)."""
        if self.render_mode is None:
            gym.logger.warn("render() draws nothing: make the environment with a render_mode")
            return None
        shown = self.session.last[0], self.session.tasks[0]
        if self.render_mode == "rgb_array":
            return self.painter.frame(*shown)
        self._window.show(self.painter, *shown)
        return None

    def close(self) -> None:
        """Close the window and the camera."""
        self._window.close()
        self.painter.close()

    def _observation(self) -> Observation:
        return observe(self.problem, self.session.tasks, self.session)[0]
