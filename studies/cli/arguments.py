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
from pkm_gym.core.names import check_known
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.statics import check_load, load_units
from pkm_gym.core.task import Task, TaskVariable
from pkm_gym.core.types import FloatArray
from pkm_gym.core.units import parse, show
from pkm_gym.mechanisms import problem_type, usable_problems
from pkm_gym.studies.cli.design_file import DesignFile, read_design
from pkm_gym.studies.cli.settings import (
    Settings,
    Texts,
    assignments,
    beside,
    interval,
    ratios,
    settings_of,
)


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
        set_, objective = beside(kind, words, set_), objective or known.objectives
    settings = settings_of(kind, set_)
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
        set_ = beside(kind, known.words(design=True), set_)
        objective = objective or known.objectives
    settings = settings_of(kind, set_)
    held = {v.name for v in kind.all_variables if not (v.searched or free)}
    fix = [*(fix or ()), *(f"{k}={x}" for k, x in settings.design.items() if k in held)]
    problem = kind(**_arguments(kind, settings, fix, range_, objective, free, options))
    units = {variable.name: variable.unit for variable in problem.all_variables}
    units |= problem.derived_units
    given = {key: parse(text, units[key], what=key) for key, text in settings.design.items()}
    values, changes = problem.from_dimensions(given, problem.task)
    task = _changed_task(problem, changes, settings.task, ", ".join(given))
    task = task.replace(**ratios(kind, settings.products, vars(task)))
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


def _arguments(
    kind: type[DesignProblem],
    settings: Settings,
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
        "bounds": {key: interval(key, text, units[key]) for key, text in ranges.items()},
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
