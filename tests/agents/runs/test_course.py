"""What an agent is trained on can be had from ``gym.make_vec`` as well."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from pkm_gym.agents.runs.course import design_course
from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.benchmark.interpolation import Interpolation
from pkm_gym.benchmark.splits import load_split, split_path

ENV = "PKM/DiamondFamily-v0"


def test_the_shipped_recipe_is_made_of_the_environments_own_arguments(tmp_path):
    file = split_path("diamond", "val")
    recipe = read_recipe("ppo", ENV)
    course = design_course(ENV, recipe, tmp_path, pool=file, validation=file)
    assert course.arguments["start"] == recipe.starts == "interpolated"
    own = gym.make_vec(ENV, num_envs=3, start="interpolated", pool="val", **recipe.environment)
    sessions = course.sessions(3)
    for envs in (own, sessions):
        envs.reset(seed=2)
        envs.step(np.full((3, 3), 0.1))
    for name in ("tasks", "optima", "last"):
        one, other = (getattr(envs.session, name) for envs in (own, sessions))
        np.testing.assert_array_equal(one, other)
    assert isinstance(course.starts, Interpolation)
    assert list(tmp_path.iterdir()) == []


def test_without_a_pool_it_is_the_split_train(tmp_path, monkeypatch):
    monkeypatch.setattr("pkm_gym.benchmark.splits.load_split", lambda *_: load_split("spr3", "val"))
    recipe = read_recipe("ppo", "PKM/SPR3Family-v0")
    course = design_course("PKM/SPR3Family-v0", recipe, tmp_path, pool=None, validation=None)
    assert course.arguments["pool"] == "train"
    assert len(course.pool) == 256


@pytest.mark.parametrize(
    ("env_id", "setting", "sentence"),
    [
        (ENV, "environment.reward=objectives", "reward is 'objectives', a vector"),
        ("PKM/Diamond-v0", "starts=interpolated", "start='interpolated' needs solved tasks"),
    ],
)
def test_what_cannot_be_trained_on_is_refused(tmp_path, env_id, setting, sentence):
    recipe = read_recipe("ppo", env_id, settings=[setting])
    with pytest.raises(ValueError, match=sentence):
        design_course(env_id, recipe, tmp_path, pool=None, validation=None)
