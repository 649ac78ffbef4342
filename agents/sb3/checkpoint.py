"""The whole state of a training run, in a file that needs no unpickling of code."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import torch

from pkm_gym.agents.runs.state import check_finite, read_state, restoring, write_state
from pkm_gym.core.reading import shaped

COUNTERS = ("num_timesteps", "_n_updates", "_episode_num")
REPLAY = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def save_checkpoint(model: Any, path: Path, **more: Any) -> None:
    """Write a model between two rollouts; the file appears whole or not at all.

    It holds weights, optimisers, counters, the environment's sessions, every generator of random
    numbers and, where there is one, the replay buffer.

    Args:
        model: an SB3 model whose environment is a ``SessionVecEnv``.
        path: of the file.
        more: plain values to keep with it.
    """
    state = {
        "parameters": model.get_parameters(),
        "variables": {name: _find(model, name).detach() for name in _variables(model)},
        "counters": {name: getattr(model, name) for name in COUNTERS},
        "last_obs": torch.as_tensor(model._last_obs),
        "last_starts": torch.as_tensor(model._last_episode_starts),
        "torch": torch.get_rng_state(),
        "numpy": _numpy_state(),
        "action_space": json.dumps(model.action_space.np_random.bit_generator.state),
        "sessions": _tensors(model.env.state()),
        "replay": _replay(model),
        "more": more,
    }
    write_state(path, state)


def load_checkpoint(model: Any, path: Path) -> dict[str, Any]:
    """Bring a new model of the same recipe to the state of a file; return what was kept with it.

    Raises:
        ValueError: for a file that is missing, damaged or another recipe's.
    """
    state = read_state(path)
    with restoring(path):
        for name in ("parameters", "variables"):
            check_finite(state[name], name)
        # SB3 takes a text for the name of a file.
        model.set_parameters(shaped(dict[str, Any], state["parameters"], "parameters"))
        with torch.no_grad():
            for name, value in state["variables"].items():
                _find(model, name).copy_(value)
        for name in COUNTERS:
            setattr(model, name, shaped(int, state["counters"][name], name))
        model._last_obs = _like(model.env.observation_space.shape, model.n_envs, state["last_obs"])
        model._last_episode_starts = _like((), model.n_envs, state["last_starts"])
        model.env.restore(_arrays(state["sessions"]))
        _restore_replay(model, state["replay"])
        model.action_space.np_random.bit_generator.state = json.loads(state["action_space"])
        numpy_state = json.loads(state["numpy"])
        numpy_state["state"]["key"] = np.array(numpy_state["state"]["key"], dtype=np.uint32)
        np.random.set_state(numpy_state)  # noqa: NPY002 (SB3 draws from NumPy's global generator)
        torch.set_rng_state(state["torch"])
        return shaped(dict[str, Any], state["more"])


def _like(shape: tuple[int, ...], n: int, tensor: torch.Tensor) -> Any:
    """Return the array (n, *shape) that a tensor is."""
    if tensor.shape != (n, *shape):
        raise ValueError(f"{tuple(tensor.shape)} in the place of {(n, *shape)}")
    return tensor.numpy()


def _variables(model: Any) -> list[str]:
    """Return the names of the tensors that are no module's, such as SAC's entropy coefficient."""
    names: list[str] = model._get_torch_save_params()[1]
    return names


def _find(model: Any, name: str) -> Any:
    for part in name.split("."):
        model = getattr(model, part)
    return model


def _numpy_state() -> str:
    state: dict[str, Any] = np.random.get_state(legacy=False)  # noqa: NPY002 (SB3 draws from NumPy's global generator)
    state["state"]["key"] = state["state"]["key"].tolist()
    return json.dumps(state)


def _replay(model: Any) -> dict[str, Any] | None:
    buffer = getattr(model, "replay_buffer", None)
    if buffer is None:
        return None
    end = buffer.buffer_size if buffer.full else buffer.pos
    arrays = {name: torch.as_tensor(getattr(buffer, name)[:end]) for name in REPLAY}
    return {"pos": buffer.pos, "full": buffer.full, "arrays": arrays}


def _restore_replay(model: Any, kept: dict[str, Any] | None) -> None:
    if kept is None:
        return
    buffer = model.replay_buffer
    buffer.pos, buffer.full = kept["pos"], kept["full"]
    for name, tensor in kept["arrays"].items():
        getattr(buffer, name)[: len(tensor)] = tensor.numpy()


def _tensors(state: dict[str, Any]) -> dict[str, Any]:
    return {
        name: torch.as_tensor(value) if isinstance(value, np.ndarray) else value
        for name, value in state.items()
    }


def _arrays(state: dict[str, Any]) -> dict[str, Any]:
    return {
        name: value.numpy() if isinstance(value, torch.Tensor) else value
        for name, value in state.items()
    }
