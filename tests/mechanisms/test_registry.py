"""The registry: names, "module:Class", and problems from outside."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium as gym
import pytest

import pkm_gym
from pkm_gym import mechanisms
from pkm_gym.envs.registration import environment_ids
from pkm_gym.mechanisms import (
    addresses,
    called,
    declaration,
    family_problem,
    problem_type,
    register,
)

OUTSIDE = """
from dataclasses import replace

from {module} import {parent}


class Outside({parent}):
    declared = replace({parent}.declared, name="{name}", problem=__name__ + ":Outside",
                       environment="")


class Plain:
    declared = None


number = 3
"""


@pytest.fixture
def outside(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: Any
) -> Iterator[Callable[[str], str]]:
    """A function that writes a module with a problem of that name, and returns the module's name.

    What it registers is forgotten after the test.
    """
    monkeypatch.setattr(mechanisms, "_registered", {})
    monkeypatch.syspath_prepend(str(tmp_path))
    parent = problem_type(mechanisms.own_declarations()[0].name)
    written: list[str] = []
    before = set(gym.registry)

    def write(name: str) -> str:
        module = f"outside_{abs(hash((request.node.name, name)))}"
        source = OUTSIDE.format(module=parent.__module__, parent=parent.__name__, name=name)
        (tmp_path / f"{module}.py").write_text(source, encoding="utf-8")
        written.append(module)
        return module

    yield write
    for module in written:
        sys.modules.pop(module, None)
    for env_id in set(gym.registry) - before:
        del gym.registry[env_id]


def class_of(module: str) -> Any:
    return problem_type(f"{module}:Outside")


def test_each_problem_is_found_by_its_name_and_by_its_address() -> None:
    for name in pkm_gym.problems():
        found = problem_type(name)
        assert found.name == name
        assert problem_type(addresses()[name]) is found
        assert declaration(name) is found.declared
        assert problem_type(called(found())) is found
        ids = environment_ids(found.declared)
        assert f"PKM/{found.declared.environment}-v0" in ids
        assert f"PKM/{found.declared.environment}Family-v0" in ids


def test_names_of_problems_and_of_their_environments_are_different() -> None:
    made = [declaration(name) for name in pkm_gym.problems()]
    assert len({item.environment for item in made}) == len(made)


def test_a_problem_from_outside_needs_no_registration(outside: Callable[[str], str]) -> None:
    module = outside("visitor")
    problem = pkm_gym.make_problem(f"{module}:Outside")
    assert problem.name == "visitor"
    assert "visitor" not in pkm_gym.problems()
    assert called(problem) == f"{module}:Outside"
    assert declaration(f"{module}:Outside").environment == "Visitor"


def test_a_registered_problem_is_an_equal(outside: Callable[[str], str]) -> None:
    module = outside("new_tenant")
    register(class_of(module))
    register(class_of(module))  # again: nothing happens
    assert pkm_gym.problems().count("new_tenant") == 1
    problem = pkm_gym.make_problem("new_tenant")
    assert called(problem) == f"{module}:Outside"  # where it isn't registered, too
    assert gym.spec("PKM/NewTenantFamily-v0").kwargs["problem"] == f"{module}:Outside"
    env = gym.make("PKM/NewTenant-v0")
    assert env.unwrapped.problem.name == "new_tenant"


@pytest.mark.parametrize("thing", [3, "diamond", object, len, None])
def test_what_is_no_problem_is_not_registered(thing: Any) -> None:
    with pytest.raises(TypeError, match="register takes a class of DesignProblem, not"):
        register(thing)


def test_a_class_that_cannot_be_imported_is_not_registered(outside: Callable[[str], str]) -> None:
    parent = class_of(outside("cellar"))

    class Inside(parent):  # type: ignore[misc,valid-type]  # made at run time
        pass

    with pytest.raises(TypeError, match="Inside"):
        register(Inside)


def test_a_taken_name_is_refused(outside: Callable[[str], str], tmp_path: Path) -> None:
    first, second = outside("twins"), outside("other")
    source = tmp_path / f"{second}.py"
    source.write_text(source.read_text().replace('"other"', '"twins"'))
    two = class_of(second)
    register(class_of(first))
    with pytest.raises(ValueError, match=rf"{second}:Outside is called 'twins', as {first}"):
        register(two)
    with pytest.raises(ValueError, match="rename one of them"):
        problem_type(f"{second}:Outside")
    taken = mechanisms.own_declarations()[0].name
    third = outside(taken)
    with pytest.raises(ValueError, match=f"is called {taken!r}, as .* is: rename one of them"):
        problem_type(f"{third}:Outside")


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("no_such_module_at_all:It", "there is no module 'no_such_module_at_all'"),
        ("pkm_gym.no_such_part:It", "there is no module 'pkm_gym.no_such_part'"),
        ("{module}:Outsider", "the module '{module}' has no 'Outsider'"),
        ("{module}:", "the module '{module}' has no ''"),
        ("{module}:Plain", "{module}:Plain is no DesignProblem"),
        ("{module}:number", "{module}:number is no DesignProblem"),
        ("pkm_gym.core.problem:DesignProblem", "DesignProblem declares nothing"),
    ],
)
def test_an_address_that_leads_nowhere_is_answered_in_one_sentence(
    outside: Callable[[str], str], name: str, sentence: str
) -> None:
    module = outside("somebody")
    wanted = re.escape(sentence.format(module=module))
    with pytest.raises(ValueError, match=wanted) as refused:
        pkm_gym.make_problem(name.format(module=module))
    assert "\n" not in str(refused.value)


def test_a_module_that_is_broken_says_so_itself(
    outside: Callable[[str], str], tmp_path: Path
) -> None:
    module = outside("broken")
    (tmp_path / f"{module}.py").write_text("import no_such_library\n")
    with pytest.raises(ValueError, match="needs no_such_library: install it"):
        pkm_gym.make_problem(f"{module}:Outside")


def test_an_entry_point_of_another_name_is_refused(
    outside: Callable[[str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    module = outside("guest")
    monkeypatch.setattr(mechanisms, "_installed", lambda: {"host": f"{module}:Outside"})
    assert "host" in pkm_gym.problems()
    with pytest.raises(ValueError, match=r"the entry point 'host' stands for .* called 'guest'"):
        pkm_gym.make_problem("host")


def test_an_unknown_name_is_answered_with_the_closest() -> None:
    known = pkm_gym.problems()[0]
    with pytest.raises(ValueError, match=f"unknown mechanism '{known}x'; did you mean '{known}'"):
        pkm_gym.make_problem(f"{known}x")


def test_the_problem_of_a_family_is_made_as_its_declaration_says(
    outside: Callable[[str], str],
) -> None:
    module = outside("spacious")
    kind = class_of(module)
    one, other, *_ = (variable.name for variable in kind.all_variables)
    low, high = kind.all_variables[0].low, kind.all_variables[0].high
    box = (low, 0.5 * (low + high))
    kind.declared = replace(kind.declared, family={"free": (one, other), "bounds": {one: box}})
    where = f"{module}:Outside"
    plain, wide = pkm_gym.make_problem(where), family_problem(where)
    assert wide.variable_names == (one, other)
    assert (wide.low[0], wide.high[0]) == box
    assert wide.hash() != plain.hash()
    assert wide.with_task({}).hash() == wide.hash()
    same = family_problem(where, free=None, fixed={}, bounds={}, task=wide.task)
    assert same.hash() == wide.hash()
    assert family_problem(where, bounds={one: (low, high)}).high[0] == high
    held = family_problem(where, fixed={one: box[0]})
    assert held.variable_names == (other,)
    assert held.fixed[one] == box[0]
    assert family_problem(where, free=(other,)).variable_names == (other,)
    with pytest.raises(ValueError, match="every variable is fixed"):
        family_problem(where, fixed={one: low, other: wide.low[1]})


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_a_family_that_declares_nothing_is_of_the_problem_as_it_comes(name: str) -> None:
    declared = declaration(name)
    assert (family_problem(name).hash() == pkm_gym.make_problem(name).hash()) == (
        not declared.family
    )
    if not declared.family:
        assert declared.family_words == ""
        assert declared.family_arguments({"free": None}) == {"free": None}
