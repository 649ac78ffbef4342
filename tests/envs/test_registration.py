"""Ids, entry points, and what importing the package costs."""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import nullcontext
from dataclasses import replace
from enum import Enum

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import pkm_gym
from pkm_gym.benchmark.splits import load_split, split_path
from pkm_gym.envs.design import DesignEnv
from pkm_gym.envs.registration import (
    environment_ids,
    motion_id,
    register_environments,
    register_problem,
)
from pkm_gym.mechanisms import address, declaration, own_declarations, problem_type
from pkm_gym.mechanisms.diamond.declared import DiamondTask

OWN = {item.name for item in own_declarations()}


def run(code: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_specs_are_strings_and_json_without_a_time_limit(env_id):
    spec = gym.spec(env_id)
    assert isinstance(spec.entry_point, str)
    assert isinstance(spec.vector_entry_point, str)
    assert spec.max_episode_steps is None
    assert json.loads(json.dumps(spec.kwargs)) == spec.kwargs


def test_every_problem_has_a_fixed_id_and_an_id_says_whether_it_is_a_family():
    made = {
        env_id: spec.kwargs
        for env_id, spec in gym.registry.items()
        if env_id.startswith("PKM/") and "Motion" not in env_id
    }
    fixed = [kwargs["problem"] for kwargs in made.values() if not kwargs["family"]]
    assert sorted(map(problem_type, fixed), key=str) == sorted(
        map(problem_type, pkm_gym.problems()), key=str
    )
    for env_id, kwargs in made.items():
        assert ("Family" in env_id) == kwargs["family"]


def test_every_id_is_declared_and_every_declared_id_is_there():
    made = {env_id for env_id in gym.registry if env_id.startswith("PKM/")}
    declared = [declaration(name) for name in pkm_gym.problems()]
    assert made == {env_id for item in declared for env_id in environment_ids(item)}
    for item in declared:
        if item.motion is not None:
            assert motion_id(item) in made
            assert item.motion.items() <= gym.spec(motion_id(item)).kwargs.items()


def test_a_motion_s_id_names_the_machine_that_moves():
    driven = gym.spec("PKM/PSS5UPUMotion-v0").kwargs["problem"]
    assert driven == "pss5_upu_skew"
    assert declaration("pss5_upu").motion is None
    assert environment_ids(declaration("pss5_upu")) == ("PKM/PSS5UPU-v0", "PKM/PSS5UPUFamily-v0")
    assert "PKM/PSS5UPUSkewMotion-v0" not in gym.registry


def test_registering_again_changes_nothing_and_says_nothing():
    before = dict(gym.registry)
    register_environments()
    assert dict(gym.registry) == before


def test_make_works_without_an_import(env_id):
    if gym.spec(env_id).kwargs["problem"] not in OWN:
        pytest.skip("it was registered in this process alone")
    code = f"import gymnasium; print(gymnasium.make('pkm_gym:{env_id}').reset(seed=0)[0].shape)"
    assert run(code).startswith("(")


def test_importing_the_package_loads_no_heavy_library():
    heavy = ("numba", "scipy", "matplotlib", "optuna", "torch", "pandas")
    code = f"import sys, pkm_gym; print([name for name in {heavy} if name in sys.modules])"
    assert run(code).strip() == "[]"


def test_public_names_exist_and_others_do_not():
    assert set(pkm_gym.__all__) <= set(dir(pkm_gym))
    for name in pkm_gym.__all__:
        assert getattr(pkm_gym, name).__name__ == name
    with pytest.raises(AttributeError, match="no attribute 'make_robot'"):
        _ = pkm_gym.make_robot


def test_what_a_family_declares_stands_in_its_id_and_is_looked_up_where_it_does_not(
    problem, monkeypatch, play
):
    kind = type(problem)
    first, half = problem.variables[0], 0.5 * (problem.low[0] + problem.high[0])
    family = {"free": [first.name], "bounds": {first.name: [first.low, float(half)]}}
    declared = replace(kind.declared, family=family, environment="Wide")
    monkeypatch.setattr(kind, "declared", declared)
    where = address(kind)
    register_problem(where, declared)
    try:
        spec = gym.spec("PKM/WideFamily-v0")
        assert spec.kwargs == {"problem": where, "family": True, **family}
        assert gym.spec("PKM/Wide-v0").kwargs == {"problem": where, "family": False}
        env = gym.spec("PKM/Wide-v0").from_json(spec.make().spec.to_json()).make()
        known_by_name = DesignEnv(where, family=True)  # as of an installed one, not imported yet
        for made in (env.unwrapped, known_by_name, gym.make_vec(spec, 2).unwrapped):
            assert made.problem.variable_names == (first.name,)
            assert made.problem.high[0] == half
        assert DesignEnv(where).problem.hash() == problem.hash() != env.unwrapped.problem.hash()
        assert len(play(env, 0)[0][4]["design"]) == len(problem.all_variables)
        held = gym.make(spec, bounds={first.name: [first.low, first.high]}).unwrapped.problem
        assert held.high[0] == first.high
    finally:
        for env_id in [name for name in gym.registry if name.startswith("PKM/Wide")]:
            del gym.registry[env_id]


@pytest.mark.parametrize(
    ("make", "kind", "more"),
    [
        (gym.make, "", {"budget", "reward", "start", "pool", "render_mode", "step_decay"}),
        (gym.make_vec, "", {"num_envs", "autoreset_mode", "infos", "budget", "reward", "pool"}),
        (gym.make, "Motion", {"design", "speed", "force_limit", "start_offset", "width"}),
    ],
)
def test_an_unknown_argument_is_answered_with_all_that_are_known(make, kind, more, problem):
    if kind and problem.declared.motion is None:
        pytest.skip("it has no twin")
    env_id = motion_id(problem.declared) if kind else f"PKM/{problem.declared.environment}-v0"
    with pytest.raises(ValueError, match="unknown argument 'zzzzzz'; known: ") as refusal:
        make(env_id, zzzzzz=1)
    known = set(str(refusal.value).partition("known: ")[2].split(", "))
    options = {item.name for item in problem.options_type.table()}
    assert known >= more | options | {"task", "objective", "free", "fixed", "bounds"}
    assert not known & {"self", "problem", "arguments", "options"}


def test_spec_survives_json_with_every_kind_of_plain_argument(fixed_id, play, other_task):
    first = gym.spec(fixed_id).make().unwrapped.problem
    (name, *_, last), design = first.variable_names, first.printed_design()
    env = gym.make(
        fixed_id,
        budget=5,
        action_mode="absolute",
        start="random",
        task=other_task(first),
        fixed={name: float(design[0])},
        bounds={last: [float(first.low[-1]), float(0.5 * (first.low + first.high)[-1])]},
        objective=first.objectives[0].name,
    )
    again = gym.spec(fixed_id).from_json(env.spec.to_json()).make()
    assert again.unwrapped.problem.hash() == env.unwrapped.problem.hash() != first.hash()
    assert again.unwrapped.problem.task == env.unwrapped.problem.task
    for one, other in zip(play(env, 3), play(again, 3), strict=True):
        assert (one[0] == other[0]).all()
        assert one[1:] == other[1:]


PLAIN = [
    ("PKM/Diamond-v0", {"budget": 3, "step_min": 1e-3, "pool": None, "family": True}),
    ("PKM/Diamond-v0", {"free": ["gap"], "fixed": {"lam_e": 0.6}, "bounds": {"gap": [0.3, 0.5]}}),
    ("PKM/Diamond-v0", {"free": ("gap",), "bounds": {"gap": (0.3, 0.5)}, "sampling": (9, 5)}),
    ("PKM/Diamond-v0", {"task": {"payload": 1.5}, "objective": ["tau_G", "condition"]}),
    ("PKM/Diamond-v0", {"task": DiamondTask(payload=1.5)}),
    ("PKM/DiamondFamily-v0", {"pool": "val", "start": "pool", "reward": "regret"}),
    ("PKM/DiamondMotion-v0", {"design": [0.6, 2.56, 0.41], "speed": 0.5, "task": {"payload": 1.5}}),
    ("PKM/DiamondMotion-v0", {"design": {"lam_e": 0.6, "lam_l": 2.56, "gap": 0.41}}),
]


@pytest.mark.parametrize(("env_id", "arguments"), PLAIN)
def test_plain_arguments_survive_json(env_id, arguments):
    env = gym.make(env_id, **arguments)
    again = gym.spec(env_id).from_json(env.spec.to_json()).make()
    one, other = (each.reset(seed=1) for each in (env, again))
    assert (one[0] == other[0]).all()
    assert one[1] == other[1]
    assert env.unwrapped.problem.hash() == again.unwrapped.problem.hash()
    assert env.unwrapped.problem.task == again.unwrapped.problem.task


class Start(Enum):
    """Where sessions start."""

    CENTRE = "centre"


@pytest.mark.parametrize(
    ("env_id", "arguments"),
    [
        ("PKM/DiamondMotion-v0", {"design": np.array([0.6, 2.56, 0.41])}),
        ("PKM/Diamond-v0", {"bounds": {"gap": np.array([0.3, 0.5])}}),
        ("PKM/DiamondFamily-v0", {"pool": split_path("diamond", "val")}),
        ("PKM/DiamondFamily-v0", {"pool": load_split("diamond", "val")[1]}),
        ("PKM/Diamond-v0", {"free": {"gap"}}),
    ],
)
def test_what_json_doesn_t_hold_makes_an_environment_but_no_json(env_id, arguments):
    spec = gym.make(env_id, **arguments).spec
    with pytest.raises(TypeError, match="not JSON serializable"):
        spec.to_json()


def test_an_enum_is_no_name_and_no_json():
    with pytest.raises(ValueError, match="unknown start"):
        gym.make("PKM/Diamond-v0", start=Start.CENTRE)
    for mode, written in ((AutoresetMode.NEXT_STEP, False), ("NextStep", True)):
        spec = gym.make_vec("PKM/Diamond-v0", autoreset_mode=mode).spec
        with nullcontext() if written else pytest.raises(TypeError, match="not JSON serializable"):
            spec.to_json()
