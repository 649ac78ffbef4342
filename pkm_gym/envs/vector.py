"""DesignVectorEnv: n design sessions at a time, one compiled call a step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium import logger
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from pkm_gym.core.names import check_known
from pkm_gym.core.types import BoolArray, FloatArray
from pkm_gym.envs.checks import check_arguments, check_whole, finite
from pkm_gym.envs.design import DesignEnv, Observation
from pkm_gym.envs.infos import Info, merge, select, session_info
from pkm_gym.envs.objectives import Rewards, RewardSpace
from pkm_gym.envs.observation import observe
from pkm_gym.envs.rendering import Frame
from pkm_gym.envs.session import Rows, Session


class DesignVectorEnv(RewardSpace, VectorEnv[Observation, npt.NDArray[Any], npt.NDArray[Any]]):
    """What n ``DesignEnv`` in a ``SyncVectorEnv`` give, many times faster.

    Spaces, rewards and infos are those of ``DesignEnv``, batched as Gymnasium batches them. Each
    session has a generator of its own; ``reset(seed=s)`` seeds the i-th with s + i.

    ``autoreset_mode`` says what happens when a session ends: "SameStep" (the default) opens the
    next one in the same step and puts the end of the last into ``final_obs`` and ``final_info``;
    "NextStep" opens it in the next step, whose action is ignored; "Disabled" leaves it to
    ``reset(options={"reset_mask": mask})``.

    ``infos=False`` leaves everything but ``final_obs`` out of the infos, which take longer to write
    than thousands of designs to evaluate.
    """

    def __init__(
        self,
        problem: str,
        num_envs: int = 1,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.SAME_STEP,
        render_mode: str | None = None,
        infos: bool = True,
        **arguments: Any,
    ) -> None:
        """Make the environments.

        Args:
            problem: name of the problem, such as "diamond".
            num_envs: number of sessions.
            autoreset_mode: "SameStep", "NextStep", "Disabled" or a member of ``AutoresetMode``.
            render_mode: "rgb_array" or None.
            infos: whether a step says more than observations, rewards and flags.
            arguments: those of ``DesignEnv``.

        Raises:
            ValueError: for an unknown name, with its closest match, or an illegal value.
        """
        check_arguments(problem, arguments, DesignVectorEnv, DesignEnv)
        check_whole("num_envs", num_envs)
        if not isinstance(autoreset_mode, AutoresetMode):
            check_known("autoreset_mode", [autoreset_mode], [mode.value for mode in AutoresetMode])
        if render_mode is not None:
            check_known("render_mode", [render_mode], ["rgb_array"])
        one = DesignEnv(problem, **arguments)
        self.problem, self.rules, self.opening = one.problem, one.rules, one.opening
        self.observation_layout, self.painter = one.observation_layout, one.painter
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.render_mode = render_mode
        self.infos = infos
        self.metadata = {
            **one.metadata,
            "render_modes": ["rgb_array"],
            "autoreset_mode": self.autoreset_mode,
        }
        self.single_observation_space = one.observation_space
        self.single_action_space = one.action_space
        self.observation_space = batch_space(one.observation_space, num_envs)
        self.action_space = batch_space(one.action_space, num_envs)
        self.session = Session(self.problem, self.rules, num_envs)
        self._seeded = [seeding.np_random(None) for _ in range(num_envs)]
        self._to_reset = np.zeros(num_envs, dtype=np.bool_)

    @property  # type: ignore[misc]  # nobody sets it
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]  # one each, as in SyncVectorEnv
        """The generator of each session."""
        return tuple(generator for generator, _ in self._seeded)

    @property
    def np_random_seed(self) -> tuple[int, ...]:  # type: ignore[override]  # one each, as in SyncVectorEnv
        """The seed of each session's generator."""
        return tuple(seed for _, seed in self._seeded)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, Info]:
        """Open new sessions.

        Args:
            seed: of the first session, the next ones following; or one for each.
            options: those of ``DesignEnv``, where "task" and "design" may hold a row for each
                session to be opened, and "reset_mask", a boolean array (n,): which ones to open.

        Raises:
            ValueError: for an unknown option or an illegal value.
        """
        given = dict(options or {})
        mask = self._mask(given.pop("reset_mask", None))
        for i, own_seed in enumerate(self._seeds(seed)):
            if mask[i] and own_seed is not None:
                self._seeded[i] = seeding.np_random(own_seed)
        rows = np.flatnonzero(mask)
        self._open(rows, given)
        self._to_reset[rows] = False
        return self._observations(), self._reset_info({}, rows)

    def step(
        self, actions: npt.NDArray[Any]
    ) -> tuple[Observation, FloatArray | Rewards, BoolArray, BoolArray, Info]:
        """Evaluate the designs that the actions (n, d) mean; the rewards are (n,), or (n, k).

        Raises:
            ValueError: for a wrong shape or type, NaN or infinity; nothing has changed then.
            ResetNeeded: if a session is over, or has not begun, and is not reset by itself.
        """
        moves = finite("actions", actions, (self.num_envs, len(self.problem.low)))
        opened, rows = np.flatnonzero(self._to_reset), np.flatnonzero(~self._to_reset)
        if (self.session.left[rows] == 0).any():
            raise ResetNeeded("a session is over or has not begun: call reset()")
        evaluation, earned = self.session.step(rows, moves[rows])
        rewards = np.zeros((self.num_envs, *earned.shape[1:]), dtype=earned.dtype)
        rewards[rows] = earned
        info = session_info(self.session, rows, evaluation) if self.infos else {}
        ended = np.zeros(self.num_envs, dtype=np.bool_)
        ended[rows] = self.session.left[rows] == 0
        infos: Info = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and ended.any():
            over = ended[rows]
            opened = rows[over]
            self._add_final(infos, select(info, over), opened)
            rows, info = rows[~over], select(info, ~over)
        elif self.autoreset_mode is AutoresetMode.NEXT_STEP:
            self._to_reset = ended.copy()
        if len(opened):
            self._open(opened)
            self._reset_info(infos, opened)
        if len(rows):
            merge(infos, info, rows, self.num_envs)
        return self._observations(), rewards, ended, np.zeros_like(ended), infos

    def render(self) -> tuple[Frame, ...] | None:
        """Draw the design that each session evaluated last."""
        if self.render_mode is None:
            logger.warn("render() draws nothing: make the environments with a render_mode")
            return None
        shown = zip(self.session.last, self.session.tasks, strict=True)
        return tuple(self.painter.frame(design, task) for design, task in shown)

    def close_extras(self, **_: Any) -> None:
        """Close the camera."""
        self.painter.close()

    def _open(self, rows: Rows, options: dict[str, Any] | None = None) -> None:
        generators = [self._seeded[row][0] for row in rows]
        self.session.open(rows, *self.opening.draw(generators, options))

    def _reset_info(self, infos: Info, rows: Rows) -> Info:
        if self.infos:
            merge(infos, session_info(self.session, rows, None), rows, self.num_envs)
        return infos

    def _observations(self) -> Observation:
        return observe(self.problem, self.session.tasks, self.session)

    def _add_final(self, infos: Info, info: Info, rows: Rows) -> None:
        """Put the end of sessions into the infos before the next ones are opened."""
        final = np.full(self.num_envs, None, dtype=object)
        observations = self._observations()
        for row in rows:
            final[row] = observations[row].copy()
        ended = np.zeros(self.num_envs, dtype=np.bool_)
        ended[rows] = True
        infos["final_obs"], infos["_final_obs"] = final, ended
        if self.infos:
            infos["final_info"] = merge({}, info, rows, self.num_envs)
            infos["_final_info"] = ended.copy()

    def _seeds(self, seed: int | Sequence[int | None] | None) -> Sequence[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise ValueError(f"seed has {len(seed)} entries: it must have {self.num_envs}")
        return seed

    def _mask(self, given: Any) -> BoolArray:
        if given is None:
            return np.ones(self.num_envs, dtype=np.bool_)
        mask = np.asarray(given)
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,) or not mask.any():
            raise ValueError(
                f"option reset_mask is {given!r}: it must be a boolean array of shape "
                f"({self.num_envs},) with at least one True"
            )
        return mask
