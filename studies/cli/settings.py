"""What ``--set`` says of a problem: task fields, products of them, options and the design."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pkm_gym.core.names import unknown
from pkm_gym.core.options import Option
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.units import parse, show

NONE = "none"
TRUE, FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")

Texts = Iterable[str] | None


@dataclass(frozen=True)
class Settings:
    """What --set holds: task fields in SI, options of their type, the design as text.

    Beside them products of task fields, SI, which settle others once the design is known.
    """

    task: dict[str, float]
    options: dict[str, Any]
    design: dict[str, str]
    products: dict[str, float]


def beside(kind: type[DesignProblem], words: Mapping[str, str], set_: Texts) -> list[str]:
    """Return settings: those of a file, and over them what the user says."""
    own = assignments("--set", set_)
    products = kind.declared.products.items()
    settled = {f"task.{p.ratio}" for name, p in products if f"task.{name}" in own}
    said = {key: text for key, text in words.items() if key not in settled} | own
    return [f"{key}={text}" for key, text in said.items()]


def settings_of(kind: type[DesignProblem], set_: Texts) -> Settings:
    """Return what KEY=VALUE texts say of a problem.

    Raises:
        ValueError: in one sentence, for an unknown key, one that is said twice, or no such value.
    """
    task_units = {f"task.{item.name}": item.unit for item in kind.task_type.variables()}
    options = {item.name: item for item in kind.options_type.table()}
    of_design = {variable.name for variable in kind.all_variables} | set(kind.declared.dimensions)
    products = {f"task.{name}": item for name, item in kind.declared.products.items()}
    settings, given = Settings({}, {}, {}, {}), assignments("--set", set_)
    for key, text in given.items():
        if key in task_units:
            value = parse(text, task_units[key], what=key)
            settings.task[key.removeprefix("task.")] = value
        elif key in options:
            settings.options[key] = _option(options[key], text)
        elif key in of_design:
            settings.design[key] = text
        elif key in products:
            item = products[key]
            if f"task.{item.ratio}" in given:
                raise ValueError(f"{key} and task.{item.ratio} say the same thing: leave one out")
            value = parse(text, item.unit, what=key)
            settings.products[key.removeprefix("task.")] = value
        else:
            raise ValueError(_unknown(key, {*task_units, *products}, {*options, *of_design}))
    sized = settings.design.keys() & set(kind.declared.dimensions)  # these may settle task fields
    if settings.products and not sized:
        fields = vars(kind.task_type.of(settings.task))
        settings.task.update(ratios(kind, settings.products, fields))
        settings.products.clear()
    return settings


def _unknown(key: str, of_task: set[str], others: set[str]) -> str:
    """Return the sentence that refuses a setting, with what comes closest of its kind."""
    if f"task.{key}" in of_task:
        return f"unknown setting {key!r}; did you mean 'task.{key}'?"
    if key.startswith("task."):
        fields = {name.removeprefix("task.") for name in of_task}
        return unknown("task field", key.removeprefix("task."), fields)
    return unknown("setting", key, {*of_task, *others})


def ratios(
    kind: type[DesignProblem], given: Mapping[str, float], fields: Mapping[str, float]
) -> dict[str, float]:
    """Return the task fields that products settle beside the other fields, each legal."""
    settled: dict[str, float] = {}
    for name, item in kind.declared.products.items():
        if name in given:
            settled[item.ratio] = _ratio(kind, name, given[name], {**fields, **settled})
    return settled


def _ratio(
    kind: type[DesignProblem], name: str, value: float, fields: Mapping[str, float]
) -> float:
    """Return the task field that a product settles, within its legal range."""
    product = kind.declared.products[name]
    units = {item.name: item for item in kind.task_type.variables()}
    item, base, share = units[product.ratio], product.base(fields), product.share(value, fields)
    for bound in (item.legal_low, item.legal_high):
        if math.isclose(share, bound, rel_tol=1e-12):
            return bound  # as typed, it is the bound itself
    if not item.legal_low <= share <= item.legal_high:
        others = " and ".join(
            f"task.{key} = {show(fields[key], units[key].unit)}" for key in product.powers
        )
        least, most = (show(x * base, product.unit) for x in (item.legal_low, item.legal_high))
        raise ValueError(
            f"task.{name} is {show(value, product.unit)}: with {others} it must be from {least} to "
            f"{most}, since {product.ratio} ({item.doc}) is from {item.legal_low:g} to "
            f"{item.legal_high:g}"
        )
    return share


def assignments(flag: str, texts: Texts) -> dict[str, str]:
    """Return the KEY=VALUE texts after a flag as a mapping, each key once."""
    values: dict[str, str] = {}
    for text in texts or ():
        key, equals, value = (part.strip() for part in text.partition("="))
        if not (key and equals and value):
            raise ValueError(f"{flag} {text} says no value: write {flag} {key or 'NAME'}=VALUE")
        if key in values:
            raise ValueError(f"{flag} gives {key} twice: {values[key]} and {value}")
        values[key] = value
    return values


def interval(name: str, text: str, unit: str) -> tuple[float, float]:
    """Return the bounds that LOW:HIGH says of a variable, in SI."""
    low, colon, high = text.partition(":")
    if not colon:
        raise ValueError(f"--range {name}={text} is no range: write {name}=LOW:HIGH")
    return parse(low, unit, what=f"low {name}"), parse(high, unit, what=f"high {name}")


def _option(item: Option, text: str) -> Any:
    """Return an option's text as the type of its default; what needn't be given may be "none"."""
    name, default = item.name, item.default
    if default is None:
        return None if text.lower() == NONE else parse(text, item.unit, what=name)
    if isinstance(default, bool):
        if text.lower() not in TRUE + FALSE:
            raise ValueError(f"{name} is {text!r}: it must be true or false")
        return text.lower() in TRUE
    try:
        if isinstance(default, tuple):
            return tuple(type(default[0])(part) for part in text.lower().split("x"))
        return type(default)(text)
    except ValueError:
        example = "x".join(map(str, default)) if isinstance(default, tuple) else default
        raise ValueError(f"{name} is {text!r}: write it like {name}={example}") from None
