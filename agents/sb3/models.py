"""Models that SB3 itself has saved: read only if the user trusts them."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

from pkm_gym.agents.designers.designer import Centre, Designer
from pkm_gym.agents.runs.environments import find_spec
from pkm_gym.agents.runs.recipe import algorithm_class
from pkm_gym.agents.sb3.network import Network
from pkm_gym.core.files import read_bytes
from pkm_gym.core.reading import about
from pkm_gym.envs.design import DesignEnv


def load_model(
    path: str, *, trust: bool, env_id: str | None, algorithm: str = "ppo"
) -> tuple[Designer, int]:
    """Return the designer of a model that SB3 saved, and the steps that trained it.

    Its sessions start at the centre; a step is an evaluation.

    Args:
        path: of the .zip file.
        trust: whether it may be unpickled.
        env_id: the environment it was trained in, with its arguments as they come.
        algorithm: that trained it.

    Raises:
        ValueError: without trust or an environment, or for a file that is none, or another's.
    """
    if not trust:
        raise ValueError(
            f"{path!r} is an SB3 model: loading it unpickles, and so may run, whatever is in it; "
            "add --trust if you know where it comes from"
        )
    if env_id is None:
        raise ValueError(f"{path!r} doesn't say its environment: give --env ID")
    env = DesignEnv(**find_spec(env_id).kwargs)
    with about(Path(path), "SB3 model"):
        content = BytesIO(read_bytes(Path(path)))
    try:
        model = algorithm_class(algorithm).load(content, device="cpu")
    except Exception:  # zip, pickle and torch raise their own
        raise ValueError(f"{path!r} is no model of {algorithm}, or a damaged one") from None
    if model.observation_space != env.observation_space:
        raise ValueError(f"{path!r} was trained in an environment of other observations")
    designer = Designer(env.problem, env.rules, Network.of_model(model), Centre(env.problem))
    return designer, int(model.num_timesteps)
