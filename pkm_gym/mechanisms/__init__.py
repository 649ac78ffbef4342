"""The registry: name -> declaration -> design problem.

A folder here with a ``declared.py`` is found by itself. A mechanism from outside is an equal:
``register`` it, install it with an entry point of the group ``pkm_gym.mechanisms`` (the problem's
name = "module:Class"), or write "module:Class" wherever a name is taken.
"""

from __future__ import annotations

import sys
import traceback
import warnings
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules
from types import ModuleType
from typing import TYPE_CHECKING, Any

from pkm_gym.core.declaration import Declaration, environment_name
from pkm_gym.core.names import check_known, imported, module_of_yours

if TYPE_CHECKING:
    from pkm_gym.core.problem import DesignProblem

GROUP = "pkm_gym.mechanisms"

ENVIRONMENTS = "pkm_gym.envs.registration:register_problem"  # of a higher room

# Problems from outside that this process knows: name -> "module:Class".
_registered: dict[str, str] = {}


def problems() -> tuple[str, ...]:
    """Return the names of the known design problems: our own, installed ones, registered ones."""
    return tuple(addresses())


def addresses() -> dict[str, str]:
    """Return name -> "module:Class" of the known problems; nothing is imported for it."""
    own = {declaration.name: declaration.problem for declaration in own_declarations()}
    return own | {**_installed(), **_registered, **own}


@cache
def own_declarations() -> tuple[Declaration, ...]:
    """Return the declarations of the folders here, in the order of their names."""
    folders = sorted(item.name for item in iter_modules(__path__) if item.ispkg)
    modules = [import_module(f"{__name__}.{folder}.declared") for folder in folders]
    return tuple(
        item
        for module in modules
        for item in vars(module).values()
        if isinstance(item, Declaration)
    )


def usable_problems() -> tuple[str, ...]:
    """Return the names of the known design problems that can be had, with a warning of the others.

    Those from outside are imported for it.
    """
    own = {declaration.name for declaration in own_declarations()}
    usable = []
    for name in problems():
        try:
            if name not in own:
                problem_type(name)
        except ValueError as error:
            warnings.warn(str(error), stacklevel=2)
        else:
            usable.append(name)
    return tuple(usable)


def problem_type(name: str) -> type[DesignProblem]:
    """Return the class of a design problem, by name or "module:Class".

    Raises:
        ValueError: in one sentence, for an unknown name (with its closest match), a module or class
            that can't be had, or a class that has another problem's name.
    """
    if ":" in name:
        found = _loaded(name)
        _check_alone(found)
        return found
    known_addresses = addresses()
    check_known("mechanism", [name], known_addresses)
    found = _loaded(known_addresses[name])
    if found.name != name:
        raise ValueError(
            f"the entry point {name!r} stands for {known_addresses[name]}, which is called "
            f"{found.name!r}: give both one name"
        )
    return found


def declaration(name: str) -> Declaration:
    """Return what is declared of a problem, by name or "module:Class"; as ``problem_type``."""
    for own in own_declarations():
        if own.name == name:
            return own
    return problem_type(name).declared


def register(problem: type[DesignProblem]) -> None:
    """Make a design problem from outside an equal of ours, with its name and environments.

    Environments keep "module:Class", so that they can be made in child processes too.

    Raises:
        TypeError: for what is no DesignProblem, or one that can't be imported by its name.
        ValueError: for a name that another problem has.
    """
    from pkm_gym.core.problem import DesignProblem

    if not (isinstance(problem, type) and issubclass(problem, DesignProblem)):
        raise TypeError(f"register takes a class of DesignProblem, not {problem!r}")
    where = address(problem)
    module, _, name = where.partition(":")
    if getattr(sys.modules.get(module), name, None) is not problem:
        raise TypeError(f"{where} is not {problem!r}: define it at the top of a module")
    _check_alone(problem)
    _registered[problem.name] = where
    imported(ENVIRONMENTS)(where, problem.declared)


def register_module(module: str) -> dict[str, str]:
    """Import a module and register the design problems that it defines.

    Returns:
        "module:Class" of each -> the id of its Family, or of its one task where it draws none.

    Raises:
        ValueError: for a module that can't be imported, or a name that another problem has.
    """
    from pkm_gym.core.problem import DesignProblem

    found = {}
    for item in list(vars(_module(module, module)).values()):
        own = isinstance(item, type) and item.__module__ == module
        if own and issubclass(item, DesignProblem) and "declared" in vars(item):
            register(item)
            drawn = any(variable.drawn for variable in item.task_type.variables())
            kind = "Family" if drawn else ""
            found[address(item)] = f"PKM/{item.declared.environment}{kind}-v0"
    return found


def make_problem(name: str, **arguments: Any) -> DesignProblem:
    """Make a design problem.

    Args:
        name: one of ``problems()``, or "module:Class" of a problem from outside.
        arguments: ``task``, ``objective``, ``free``, ``fixed``, ``bounds`` and the mechanism's
            options; see ``DesignProblem`` and the mechanism's page.

    Raises:
        ValueError: for an unknown name, with its closest match, or an illegal value.

    Example:
        >>> problem = make_problem("diamond", task={"payload": 1.0})
        >>> evaluation = problem.evaluate(np.array([[0.6, 2.56, 0.41]]))
        >>> evaluation.indices["tau_G"]
    """
    return problem_type(name)(**arguments)


def family_problem(name: str, **arguments: Any) -> DesignProblem:
    """Make the design problem of a Family, which splits, pools and designers are of.

    It is ``make_problem``'s with the arguments that the declaration's ``family`` gives; what is
    given here goes before them.

    Raises:
        ValueError: as ``make_problem``.
    """
    return make_problem(name, **declaration(name).family_arguments(arguments))


def address(problem: type[DesignProblem]) -> str:
    """Return "module:Class" of a problem."""
    return f"{problem.__module__}:{problem.__qualname__}"


def called(problem: DesignProblem) -> str:
    """Return what a command calls a problem: its name, or "module:Class" if it isn't installed."""
    return problem.name if problem.name in _installed() else lasting(problem)


def lasting(problem: DesignProblem) -> str:
    """Return what a file or another process calls a problem: "module:Class" of one from outside.

    A process that has not registered it, or where it isn't installed, finds it by that too.
    """
    own = {declaration.name for declaration in own_declarations()}
    return problem.name if problem.name in own else address(type(problem))


def installed_environments() -> Iterator[tuple[str, str, str]]:
    """Yield (problem, "module:Class", environment's name) of the installed ones from outside."""
    for name, where in _installed().items():
        yield name, where, environment_name(name)


@cache
def _installed() -> dict[str, str]:
    found: dict[str, str] = {}
    for point in entry_points(group=GROUP):
        if found.setdefault(point.name, point.value) != point.value:
            warnings.warn(
                f"two installed packages have a mechanism {point.name!r}: {found[point.name]} "
                f"is taken, {point.value} is not",
                stacklevel=2,
            )
    return found


def _check_alone(problem: type[DesignProblem]) -> None:
    """Refuse a problem whose name another one has."""
    where = address(problem)
    known = addresses().get(problem.name, where)
    if known != where and _loaded(known) is not problem:
        raise ValueError(f"{where} is called {problem.name!r}, as {known} is: rename one of them")


def _loaded(where: str) -> type[DesignProblem]:
    from pkm_gym.core.problem import DesignProblem

    found = _imported(where)
    if not (isinstance(found, type) and issubclass(found, DesignProblem)):
        raise ValueError(f"{where} is no DesignProblem")  # noqa: TRY004  # a wrong name, said in words
    if "declared" not in dir(found):
        raise ValueError(f"{where} declares nothing: give it a Declaration as `declared`")
    return found


def _imported(where: str) -> Any:
    """Import "module:Class"; the current folder is the last place that is looked at."""
    module, _, attribute = where.partition(":")
    found = _module(module, where)
    if not hasattr(found, attribute):
        raise ValueError(f"the module {module!r} has no {attribute!r}: wanted {where!r}")
    return getattr(found, attribute)


def _module(module: str, where: str) -> ModuleType:
    try:
        return module_of_yours(module)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{module}.".startswith(f"{error.name}."):
            raise ValueError(f"the mechanism {where!r} needs {error.name}: install it") from error
        raise ValueError(f"there is no module {error.name!r} for the mechanism {where!r}") from None
    except Exception as error:  # whatever somebody's module does
        raise ValueError(f"the mechanism {where!r} can't be imported: {_cause(error)}") from error


def _cause(error: Exception) -> str:
    """Say in one line what an import ended with, and where."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    file, line = (
        (error.filename, error.lineno)
        if isinstance(error, SyntaxError)
        else (last.filename, last.lineno)
    )
    said = (str(error.msg) if isinstance(error, SyntaxError) else str(error)).splitlines()
    return f"{type(error).__name__}: {said[0] if said else 'no reason'} ({file}, line {line})"
