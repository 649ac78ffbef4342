"""Recipe: the hyperparameters of a training run, from TOML files and the command line."""

from __future__ import annotations

import inspect
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

from pkm_gym.agents.runs.schema import ALGORITHM, POLICY, check_settings
from pkm_gym.agents.sb3.network import ACTIVATIONS
from pkm_gym.core.names import check_known, imported, unknown
from pkm_gym.core.reading import about, read_toml, shaped

LEARNERS = {
    "ppo": "stable_baselines3:PPO",
    "sac": "stable_baselines3:SAC",
    "td3": "stable_baselines3:TD3",
    "tqc": "sb3_contrib:TQC",
}
ALGORITHMS = {**LEARNERS, "model": "pkm_gym.agents.planner.settings:Settings"}
GROUPS = ("algorithm", "policy", "environment")
STARTS = ("centre", "interpolated")


@dataclass(frozen=True)
class Recipe:
    """What a run is made of.

    Attributes:
        steps: evaluations of designs in all.
        envs: sessions side by side.
        checkpoints: how often the state is kept and the agent is scored.
        starts: where sessions start: at the "centre" or "interpolated" between the pool's optima.
        algorithm: arguments of the algorithm's class in SB3.
        policy: ``net_arch``, ``activation`` and other ``policy_kwargs``.
        environment: arguments of ``DesignEnv``.
    """

    steps: int
    envs: int
    checkpoints: int = 20
    starts: str = "centre"
    algorithm: dict[str, Any] = field(default_factory=dict)
    policy: dict[str, Any] = field(default_factory=dict)
    environment: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse illegal values.

        Raises:
            ValueError: naming the key, its value and what is allowed.
        """
        for name in ("steps", "envs", "checkpoints"):
            value = getattr(self, name)
            if not isinstance(value, int) or isinstance(value, bool) or value < 1:
                raise ValueError(f"{name} is {value!r}: it must be a whole number of at least 1")
        if not isinstance(self.starts, str):
            raise ValueError(f"starts is {self.starts!r}: it must be {' or '.join(STARTS)}")  # noqa: TRY004 (a user's)
        check_known("starts", [self.starts], STARTS)
        check_known("activation", [self.policy.get("activation", "relu")], ACTIVATIONS)


def algorithm_class(algorithm: str) -> Any:
    """Return the class of an algorithm.

    Raises:
        ValueError: for an unknown one, with its closest match.
    """
    check_known("algorithm", [algorithm], ALGORITHMS)
    return imported(ALGORITHMS[algorithm])


def read_recipe(
    algorithm: str,
    env_id: str,
    *,
    file: Path | None = None,
    settings: Iterable[str] = (),
    **given: Any,
) -> Recipe:
    """Return the recipe of an algorithm for an environment.

    Args:
        algorithm: one of ``ALGORITHMS``.
        env_id: its block changes the file's default block.
        file: hyperparameters instead of those that are shipped.
        settings: ``KEY=VALUE`` that change them, such as ``algorithm.gamma=0.9``.
        given: top-level values that change them; None leaves one as it is.

    Raises:
        ValueError: for an unreadable file, an unknown key (with its closest match) or an illegal
            value.
    """
    made = algorithm_class(algorithm)
    source = file or files("pkm_gym.agents").joinpath(f"params/{algorithm}.toml")
    content = read_toml(source, "recipe")
    merged: dict[str, Any] = {}
    with about(source, "recipe"):
        blocks = shaped(dict[str, dict[str, Any]], content)
        for block in (blocks.get("default", {}), blocks.get(env_id, {})):
            _merge(merged, block)
        _recipe(algorithm, made, {"steps": 1, "envs": 1, **merged})
    for setting in settings:
        _merge(merged, _nested(setting))
    _merge(merged, {name: value for name, value in given.items() if value is not None})
    for name in ("steps", "envs"):
        if name not in merged:
            raise ValueError(f"the recipe {str(source)!r} lacks {name}: add it, or say it")
    return _recipe(algorithm, made, merged)


def _recipe(algorithm: str, made: Any, settings: Mapping[str, Any]) -> Recipe:
    """Return the recipe of settings whose keys and values are legal."""
    merged = dict(settings)
    check_known("setting", merged, [item.name for item in fields(Recipe)])
    for group in GROUPS:
        held = merged.setdefault(group, {})
        if not isinstance(held, Mapping):
            raise ValueError(f"{group} is {held!r}: write {group}.KEY=VALUE")  # noqa: TRY004 (a user's)
    own, policy = merged["algorithm"], dict(merged["policy"])
    if algorithm in LEARNERS:
        check_settings("algorithm", own, ALGORITHM, inspect.signature(made).parameters)
        policy.pop("activation", None)  # a name, which the recipe checks
        network = made.policy_aliases["MlpPolicy"]
        check_settings("policy", policy, POLICY, inspect.signature(network).parameters)
    else:
        check_known(f"setting of {algorithm}", own, inspect.signature(made).parameters)
        made(**own)  # refuses illegal values
    return Recipe(**merged)


def resumed_recipe(
    kept: Recipe, algorithm: str, env_id: str, *, file: Path | None, settings: Iterable[str],
    steps: int | None,
) -> Recipe:  # fmt: skip
    """Return the recipe of a run with what is said of it now; all of it, where a file is given.

    Raises:
        ValueError: as ``read_recipe``.
    """
    if file is not None:
        return read_recipe(algorithm, env_id, file=file, settings=settings, steps=steps)
    merged = asdict(kept)
    for setting in settings:
        _merge(merged, _nested(setting))
    if steps is not None:
        merged["steps"] = steps
    return Recipe(**merged)


def _merge(into: dict[str, Any], block: Mapping[str, Any]) -> None:
    for name, value in block.items():
        if isinstance(value, Mapping):
            held = into.get(name)
            into[name] = {**held} if isinstance(held, Mapping) else {}
            _merge(into[name], value)
        else:
            into[name] = value


def _nested(setting: str) -> dict[str, Any]:
    """Return ``algorithm.gamma=0.9`` as {"algorithm": {"gamma": 0.9}}."""
    key, equals, text = (part.strip() for part in setting.partition("="))
    if not (key and equals and text):
        raise ValueError(f"--set {setting} says no value: write --set {key or 'KEY'}=VALUE")
    groups = [item.name for item in fields(Recipe)]
    first = key.partition(".")[0]
    if first not in groups:
        raise ValueError(unknown("setting", first, groups))
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text
    for name in reversed(key.split(".")):
        value = {name: value}
    nested: dict[str, Any] = value
    return nested
