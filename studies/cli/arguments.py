"""A problem, a design or a machine made from the arguments of a verb."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pkm_gym.core.mechanism import Mechanism
from pkm_gym.core.names import check_known, unknown
from pkm_gym.core.options import Option
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.statics import check_load, load_units
from pkm_gym.core.task import Task, TaskVariable
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import parse, show
from pkm_gym.mechanisms import problem_type, usable_problems
from pkm_gym.studies.cli.design_file import DesignFile, read_design

NONE = "none"
TRUE, FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")

Texts = Iterable[str] | None


@dataclass(frozen=True)
class GivenDesign:
    """A design as the user gave it.

    Attributes:
        problem: whose design it is.
        design: array (d,).
        task: the problem's task, with the fields that the dimensions settle.
        notes: sentences that say what was settled or filled in.
        names: what the user gave of it; without any it is the printed design.
        file: where it was read, if it was.
    """

    problem: DesignProblem
    design: FloatArray
    task: Task
    notes: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    file: DesignFile | None = None


def problem_from(
    name: str,
    set_: Texts = None,
    fix: Texts = None,
    range_: Texts = None,
    objective: Sequence[str] | None = None,
    free: Sequence[str] | None = None,
    *,
    file: Path | None = None,
    family: bool = False,
    **options: Any,
) -> DesignProblem:
    """Make the problem of a verb's arguments.

    Args:
        name: the mechanism.
        set_: ``task.FIELD=VALUE`` and ``OPTION=VALUE``.
        fix: ``VARIABLE=VALUE``.
        range_: ``VARIABLE=LOW:HIGH``.
        objective: names of objectives, the default one if empty.
        free: names of the variables that are searched, or "all"; the usual ones if empty.
        file: of a design, whose task, options and objectives hold where nothing else is said.
        family: whether it is the Family's problem, as ``family_problem`` makes it.
        options: options of the mechanism that ``set_`` overrides.

    Raises:
        ValueError: in one sentence, for an unknown name (with its closest match), a number that is
            none, a wrong unit, or a value that is not allowed.
    """
    kind = problem_type(name)
    if file is not None:
        known = read_design(file, kind)
        words = known.words(design=False)
        words = {k: x for k, x in words.items() if k not in kind.declared.reporting}
        set_, objective = _beside(kind, words, set_), objective or known.objectives
    settings = _settings(kind, set_)
    for key, text in settings.design.items():
        raise ValueError(
            f"--set {key}={text} is part of a design, and this verb takes none: keep a variable at "
            "a value with --fix"
        )
    arguments = _arguments(kind, settings, fix, range_, objective, free, options)
    return kind(**(kind.declared.family_arguments(arguments) if family else arguments))


def design_from(
    name: str,
    set_: Texts = None,
    fix: Texts = None,
    range_: Texts = None,
    objective: Sequence[str] | None = None,
    free: Sequence[str] | None = None,
    *,
    file: Path | None = None,
    **options: Any,
) -> GivenDesign:
    """Return the design in ``set_``, and its problem: what isn't given is as printed or by default.

    The arguments are those of ``problem_from``; ``set_`` may hold variables or dimensions too, and
    so may the file.

    Raises:
        ValueError: in one sentence, as ``problem_from`` does, for numbers that make no design, or
            dimensions that disagree with a task field given beside them.
    """
    kind = problem_type(name)
    known = read_design(file, kind) if file is not None else None
    if known is not None:
        set_ = _beside(kind, known.words(design=True), set_)
        objective = objective or known.objectives
    settings = _settings(kind, set_)
    held = {v.name for v in kind.all_variables if not (v.searched or free)}
    fix = [*(fix or ()), *(f"{k}={x}" for k, x in settings.design.items() if k in held)]
    problem = kind(**_arguments(kind, settings, fix, range_, objective, free, options))
    units = {variable.name: variable.unit for variable in problem.all_variables}
    units |= problem.derived_units
    given = {key: parse(text, units[key], what=key) for key, text in settings.design.items()}
    values, changes = problem.from_dimensions(given, problem.task)
    task = _changed_task(problem, changes, settings.task, ", ".join(given))
    task = task.replace(**_ratios(kind, settings.products, vars(task)))
    default = dict(zip(problem.variable_names, problem.printed_design().tolist(), strict=True))
    notes = [*(known.notes if known else ())]
    notes += [
        f"{', '.join(given)} set task.{item.name} = {show(value, item.unit)} ({item.doc})"
        for item, value in _fields(problem, changes)
    ]
    kept = [key for key in problem.variable_names if key not in values]
    if values and kept:
        origin = "as printed in the paper" if problem.reference else "as in the default design"
        notes.append(f"{', '.join(kept)} {origin}")
    design = problem.design({**default, **values})
    return GivenDesign(problem, design, task, tuple(notes), tuple(given), known)


@dataclass(frozen=True)
class _Settings:
    """What --set holds: task fields in SI, options of their type, the design as text.

    Beside them products of task fields, SI, which settle others once the design is known.
    """

    task: dict[str, float]
    options: dict[str, Any]
    design: dict[str, str]
    products: dict[str, float]


def _beside(kind: type[DesignProblem], words: Mapping[str, str], set_: Texts) -> list[str]:
    """Return settings: those of a file, and over them what the user says."""
    own = assignments("--set", set_)
    products = kind.declared.products.items()
    settled = {f"task.{p.ratio}" for name, p in products if f"task.{name}" in own}
    said = {key: text for key, text in words.items() if key not in settled} | own
    return [f"{key}={text}" for key, text in said.items()]


def _settings(kind: type[DesignProblem], set_: Texts) -> _Settings:
    task_units = {f"task.{item.name}": item.unit for item in kind.task_type.variables()}
    options = {item.name: item for item in kind.options_type.table()}
    of_design = {variable.name for variable in kind.all_variables} | set(kind.declared.dimensions)
    products = {f"task.{name}": item for name, item in kind.declared.products.items()}
    settings, given = _Settings({}, {}, {}, {}), assignments("--set", set_)
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
        beside = vars(kind.task_type.of(settings.task))
        settings.task.update(_ratios(kind, settings.products, beside))
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


def _ratios(
    kind: type[DesignProblem], given: Mapping[str, float], fields: Mapping[str, float]
) -> dict[str, float]:
    """Return the task fields that products settle beside the other fields, each legal."""
    ratios: dict[str, float] = {}
    for name, item in kind.declared.products.items():
        if name in given:
            ratios[item.ratio] = _ratio(kind, name, given[name], {**fields, **ratios})
    return ratios


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
        beside = " and ".join(
            f"task.{key} = {show(fields[key], units[key].unit)}" for key in product.powers
        )
        least, most = (show(x * base, product.unit) for x in (item.legal_low, item.legal_high))
        raise ValueError(
            f"task.{name} is {show(value, product.unit)}: with {beside} it must be from {least} to "
            f"{most}, since {product.ratio} ({item.doc}) is from {item.legal_low:g} to "
            f"{item.legal_high:g}"
        )
    return share


def _arguments(
    kind: type[DesignProblem],
    settings: _Settings,
    fix: Texts,
    range_: Texts,
    objective: Sequence[str] | None,
    free: Sequence[str] | None,
    options: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the arguments of the problem."""
    units = {variable.name: variable.unit for variable in kind.all_variables}
    fixed, ranges = assignments("--fix", fix), assignments("--range", range_)
    check_known("variable", (*fixed, *ranges), units)
    for key in fixed.keys() & ranges.keys():
        raise ValueError(f"{key} has both --fix {fixed[key]} and --range {ranges[key]}: choose one")
    held = {key: parse(text, units[key], what=key) for key, text in fixed.items()}
    _check_within(kind, held)
    return {
        "task": settings.task,
        "objective": objective or None,
        "free": free or None,
        "fixed": held,
        "bounds": {key: _interval(key, text, units[key]) for key, text in ranges.items()},
        **options,
        **settings.options,
    }


def _check_within(kind: type[DesignProblem], held: Mapping[str, float]) -> None:
    """Refuse to search at a value that no search of the variable would try."""
    for variable in kind.all_variables:
        value = held.get(variable.name)
        if value is None or not variable.searched:
            continue
        wide = kind.declared.family.get("bounds", {}).get(variable.name, (variable.low,))
        low, high = min(variable.low, *wide), max(variable.high, *wide)
        if not low <= value <= high:
            least, most = (show(x, variable.unit) for x in (low, high))
            raise ValueError(
                f"--fix {variable.name}={show(value, variable.unit)} lies outside its range, "
                f"{least} to {most}"
            )


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


def _interval(name: str, text: str, unit: str) -> tuple[float, float]:
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


def _changed_task(
    problem: DesignProblem, changes: dict[str, float], given: dict[str, float], source: str
) -> Task:
    """Return the task with what the dimensions settle, unless the user said otherwise."""
    for item, value in _fields(problem, changes):
        own = given.get(item.name, value)
        if not math.isclose(own, value, rel_tol=1e-6):
            raise ValueError(
                f"task.{item.name} = {show(own, item.unit)} disagrees with {source}, which set it "
                f"to {show(value, item.unit)} ({item.doc}): leave one out"
            )
    try:
        return problem.task.replace(**changes)
    except ValueError as error:
        raise ValueError(f"{error}; {source} set it (without a unit they are in m)") from None


def _fields(
    problem: DesignProblem, changes: dict[str, float]
) -> Iterable[tuple[TaskVariable, float]]:
    items = {item.name: item for item in problem.task_variables}
    return ((items[name], value) for name, value in changes.items())


def known_problems() -> tuple[str, ...]:
    """Return the names of the problems that can be had, with a line on stderr for each other."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        names = usable_problems()
    for warning in caught:
        print(f"pkm-gym: {warning.message}", file=sys.stderr)
    return names


def load_from(machine: Mechanism, texts: Texts) -> dict[str, float]:
    """Return the load of ``--load``, component or size -> N or N m; {} without texts.

    Raises:
        ValueError: in one sentence, for what is no load on the machine's platform.
    """
    given, units = assignments("--load", texts), load_units(machine)
    check_known("load", given, units)
    load = {name: parse(text, units[name], what=name) for name, text in given.items()}
    if load:
        check_load(machine, load)
    return load


def machine_from(
    name: str, set_: list[str] | None, file: Path | None = None
) -> tuple[Mechanism, tuple[str, ...]]:
    """Return the machine of a design, how the design was completed, and what it breaks."""
    given = design_from(name, set_, file=file)
    evaluation = given.problem.evaluate(given.design[None], given.task)
    broken = () if evaluation.feasible[0] else tuple(evaluation.explain(0).splitlines())
    return given.problem.mechanism(given.design, given.task), given.notes + broken
