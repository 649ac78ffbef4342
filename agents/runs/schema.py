"""What the settings of SB3's algorithms may be: checked before a run writes anything."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

from pkm_gym.core.names import check_known
from pkm_gym.core.reading import is_number

FREQUENCIES = ("step", "episode")


@dataclass(frozen=True)
class Rule:
    """What a setting must be, in words, and whether a value is that."""

    words: str
    holds: Callable[[Any], bool]


def _is_whole(value: Any, least: int = 1) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= least


def _whole(least: int = 1) -> Rule:
    return Rule(f"a whole number from {least} on", lambda value: _is_whole(value, least))


def _number(low: float = -inf, high: float = inf) -> Rule:
    words = "a number"
    if low > -inf:
        words += f" from {low:g}" + (f" to {high:g}" if high < inf else " on")
    return Rule(words, lambda value: is_number(value) and low <= value <= high)


def _positive() -> Rule:
    return Rule("a number above 0", lambda value: is_number(value) and value > 0.0)


def _either(word: str, number: Rule) -> Rule:
    return Rule(f"{word!r} or {number.words}", lambda x: x == word or number.holds(x))


def _is_layers(value: Any) -> bool:
    return isinstance(value, list) and all(_is_whole(width) for width in value)


def _is_architecture(value: Any) -> bool:
    if isinstance(value, Mapping):
        return set(value) <= {"pi", "vf", "qf"} and all(map(_is_layers, value.values()))
    return _is_layers(value)


def _is_rate(value: Any) -> bool:
    rates = value if isinstance(value, list) and len(value) == 2 else [value]
    return all(is_number(rate) and rate > 0.0 for rate in rates)


def _is_frequency(value: Any) -> bool:
    if isinstance(value, list):
        return len(value) == 2 and _is_whole(value[0]) and value[1] in FREQUENCIES
    return _is_whole(value)


SHARE = _number(0.0, 1.0)
FLAG = Rule("true or false", lambda value: isinstance(value, bool))
ALL_OR_WHOLE = Rule("-1 or a whole number from 1 on", lambda value: value == -1 or _is_whole(value))

# Of the classes: https://stable-baselines3.readthedocs.io and sb3-contrib.
ALGORITHM = {
    "learning_rate": Rule("a number above 0, or two: the first and the last", _is_rate),
    "n_steps": _whole(),
    "batch_size": _whole(2),
    "n_epochs": _whole(),
    "gamma": SHARE,
    "gae_lambda": SHARE,
    "clip_range": _positive(),
    "clip_range_vf": _positive(),
    "normalize_advantage": FLAG,
    "ent_coef": _either("auto", _number(0.0)),
    "vf_coef": _number(0.0),
    "max_grad_norm": _positive(),
    "use_sde": FLAG,
    "sde_sample_freq": ALL_OR_WHOLE,
    "target_kl": _positive(),
    "stats_window_size": _whole(),
    "buffer_size": _whole(),
    "learning_starts": _whole(0),
    "tau": SHARE,
    "train_freq": Rule("a whole number from 1 on, or [it, 'step' or 'episode']", _is_frequency),
    "gradient_steps": ALL_OR_WHOLE,
    "optimize_memory_usage": FLAG,
    "target_update_interval": _whole(),
    "target_entropy": _either("auto", _number()),
    "use_sde_at_warmup": FLAG,
    "policy_delay": _whole(),
    "target_policy_noise": _number(0.0),
    "target_noise_clip": _number(0.0),
    "top_quantiles_to_drop_per_net": _whole(0),
}
POLICY = {
    "net_arch": Rule("a list of widths, or one for each of pi and vf or qf", _is_architecture),
    "ortho_init": FLAG,
    "log_std_init": _number(),
    "full_std": FLAG,
    "use_expln": FLAG,
    "share_features_extractor": FLAG,
    "clip_mean": _number(0.0),
    "n_critics": _whole(),
    "n_quantiles": _whole(),
}


def check_settings(
    group: str, values: Mapping[str, Any], rules: Mapping[str, Rule], known: Iterable[str]
) -> None:
    """Refuse a setting that an algorithm doesn't have, or an illegal value.

    Args:
        group: of the settings: "algorithm" or "policy".
        values: by name.
        rules: what each may be.
        known: what the algorithm has, of which what isn't in ``rules`` can't be said in TOML.

    Raises:
        ValueError: naming the setting, its value and what is allowed, or its closest match.
    """
    check_known(f"setting of {group}", values, [name for name in known if name in rules])
    for name, value in values.items():
        if not rules[name].holds(value):
            raise ValueError(f"{group}.{name} is {value!r}: it must be {rules[name].words}")
