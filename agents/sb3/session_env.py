"""SessionVecEnv: n design sessions as Stable-Baselines3 wants them, without a loop over them."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvStepReturn

from pkm_gym.envs.vector import DesignVectorEnv


class SessionVecEnv(VecEnv):
    """A ``DesignVectorEnv`` behind SB3's interface.

    All sessions advance by one ``evaluate`` call. A session that ends says so in its info, as SB3
    expects it: ``terminal_observation``, and ``episode`` with its return, length and time.

    Attributes:
        sessions: the vector environment.
        infos: what it said in the last step.
    """

    def __init__(self, sessions: DesignVectorEnv) -> None:
        """Wrap vector environments.

        Raises:
            ValueError: unless they reset themselves in the same step.
        """
        if sessions.autoreset_mode is not AutoresetMode.SAME_STEP:
            raise ValueError(
                f"autoreset_mode is {sessions.autoreset_mode.value!r}: SB3 needs 'SameStep'"
            )
        self.sessions = sessions
        self.infos: dict[str, Any] = {}
        self._actions = np.zeros(sessions.action_space.shape or (), dtype=np.float32)
        self._returns = np.zeros(sessions.num_envs)
        self._began = time.monotonic()
        super().__init__(
            sessions.num_envs, sessions.single_observation_space, sessions.single_action_space
        )

    def reset(self) -> npt.NDArray[np.float32]:
        """Open a new session in each environment, with the seeds and options given before.

        Raises:
            ValueError: for an unknown option or an illegal value.
        """
        seeds = None if self._seeds[0] is None else list(self._seeds)
        for options, mask in self._asked():
            asked = {**options, "reset_mask": mask}
            observations, infos = self.sessions.reset(seed=seeds, options=asked)
            for row in np.flatnonzero(mask).tolist():
                self.reset_infos[row] = _of_row(infos, row)
        self._returns[:] = 0.0
        self._reset_seeds()
        self._reset_options()
        return observations

    def _asked(self) -> list[tuple[dict[str, Any], npt.NDArray[np.bool_]]]:
        """Return the options, each with the sessions (n,) that they are for."""
        if len(self._options) != self.num_envs:
            raise ValueError(
                f"set_options got {len(self._options)} dictionaries: it must be one for all, or "
                f"one for each of the {self.num_envs} sessions"
            )
        given = {id(options) if options else 0: options for options in self._options}
        keys = np.array([id(options) if options else 0 for options in self._options])
        return [(options, keys == key) for key, options in given.items()]

    def get_images(self) -> Sequence[npt.NDArray[np.uint8] | None]:
        """Draw the design that each session evaluated last."""
        return self.sessions.render() or [None] * self.num_envs

    def step_async(self, actions: npt.NDArray[Any]) -> None:
        """Keep the actions (n, d) of the next step."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Evaluate the designs that the actions mean."""
        observations, rewards, ended, _, infos = self.sessions.step(self._actions)
        self.infos = infos
        self._returns += rewards
        said: list[dict[str, Any]] = [{}] * self.num_envs
        if ended.any():
            for row in np.flatnonzero(ended).tolist():
                said[row] = {
                    "terminal_observation": infos["final_obs"][row],
                    "episode": self._episode(row),
                }
            self._returns[ended] = 0.0
        return observations, rewards.astype(np.float32), ended, said

    def state(self) -> dict[str, Any]:
        """Return copies of what the next steps depend on: arrays, and the generators as text."""
        return {
            **{name: array.copy() for name, array in self._arrays().items()},
            "generators": json.dumps([g.bit_generator.state for g in self.sessions.np_random]),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go on from what ``state`` returned."""
        for name, array in self._arrays().items():
            array[:] = state[name]
        kept = json.loads(state["generators"])
        for generator, own in zip(self.sessions.np_random, kept, strict=True):
            generator.bit_generator.state = own

    def _arrays(self) -> dict[str, npt.NDArray[Any]]:
        session = self.sessions.session
        own = {name: getattr(session, name) for name in ("tasks", "optima", "evaluations", "last")}
        points: dict[str, Any] = {
            "best": session.best,
            "other": session.other,
            "answer": session.answer,
        }
        parts = {
            f"{name}.{field}": array
            for name, point in points.items()
            for field, array in point._asdict().items()
        }
        return {**own, **parts, "returns": self._returns}

    def close(self) -> None:
        """Close the sessions."""
        self.sessions.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """Return an attribute of the sessions, which all share it."""
        return [getattr(self.sessions, attr_name)] * len(self._rows(indices))

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Set an attribute of all sessions.

        Raises:
            ValueError: for some of them only, since they share it.
        """
        if len(self._rows(indices)) < self.num_envs:
            raise ValueError(f"{attr_name} belongs to all sessions: set it without indices")
        setattr(self.sessions, attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: Any = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method of the sessions, once for all."""
        result = getattr(self.sessions, method_name)(*method_args, **method_kwargs)
        return [result] * len(self._rows(indices))

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:  # noqa: ARG002 (SB3's name)
        """Say that no single session is wrapped."""
        return [False] * len(self._rows(indices))

    def _rows(self, indices: int | Iterable[int] | None) -> Sequence[int]:
        return list(self._get_indices(indices))

    def _episode(self, row: int) -> dict[str, float]:
        return {
            "r": float(self._returns[row]),
            "l": self.sessions.rules.budget,
            "t": time.monotonic() - self._began,
        }


def _of_row(infos: dict[str, Any], row: int) -> dict[str, Any]:
    """Return what is said of one session in infos that are batched as Gymnasium batches them."""
    return {
        name: _of_row(value, row) if isinstance(value, dict) else value[row]
        for name, value in infos.items()
        if not name.startswith("_") and infos[f"_{name}"][row]
    }
