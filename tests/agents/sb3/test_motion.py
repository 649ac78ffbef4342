"""Agents that drive twins: training, files, scores."""

from __future__ import annotations

import json

import gymnasium as gym
import numpy as np
import pytest
import torch

from pkm_gym.agents.runs.environments import find_spec, is_motion
from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.agents.runs.run import BEST, CHECKPOINT, Run
from pkm_gym.agents.runs.trainer import Stopped
from pkm_gym.agents.sb3.motion import load_driver, motion_course
from pkm_gym.agents.sb3.network import Network
from pkm_gym.agents.sb3.trainer import PolicyTrainer, make_model
from pkm_gym.envs.baselines import random, run

MOTIONS = [env_id for env_id, spec in gym.registry.items() if is_motion(spec)]

DIAMOND = "PKM/DiamondMotion-v0"
SMALL = ("envs=2", "checkpoints=2", "policy.net_arch=[8]", "algorithm.n_steps=64",
         "algorithm.batch_size=64")  # fmt: skip


@pytest.fixture
def small(tmp_path):
    """A function that prepares a short run on the Diamond's path."""

    def prepared(*settings, env_id=DIAMOND, steps=512, **files):
        recipe = read_recipe("ppo", env_id, settings=[*SMALL, *settings], steps=steps)
        folder = tmp_path / f"run-{len(list(tmp_path.iterdir()))}"
        made = Run(env_id, "ppo", 3, recipe, None, None, folder, "a test")
        made.write()
        return made, motion_course(find_spec(env_id, motion=True), recipe, **files)

    return prepared


NO_FILES = {"pool": None, "validation": None}


@pytest.mark.parametrize("env_id", MOTIONS)
def test_training_writes_a_driver_that_acts_as_the_model_does(small, env_id):
    made, course = small(env_id=env_id, steps=256, **NO_FILES)
    best = PolicyTrainer(made, course).train()
    driver = load_driver(made.folder)
    assert driver.origin.score == best
    env = gym.make(env_id).unwrapped
    assert run(env, driver, seed=0).mean_reward == best
    model = make_model(made, course)
    seen = model.env.reset()
    expected, _ = model.predict(seen, deterministic=True)
    np.testing.assert_allclose(Network.of_model(model)(seen), expected, atol=1e-6)


@pytest.mark.parametrize("rollouts", [1, 2])
def test_a_resumed_run_is_equal_to_the_bit(small, rollouts):
    torch.set_num_threads(1)
    whole, course = small(**NO_FILES)
    PolicyTrainer(whole, course).train()
    broken, course = small(**NO_FILES)
    left = iter([False] * rollouts)
    with pytest.raises(Stopped):
        PolicyTrainer(broken, course, stop=lambda: next(left, True)).train()
    _, course = small(**NO_FILES)
    PolicyTrainer(broken, course).train(resume=True)
    one, other = (torch.load(r.folder / CHECKPOINT, weights_only=True) for r in (whole, broken))
    assert one["counters"] == other["counters"]
    for name, weights in one["parameters"]["policy"].items():
        assert torch.equal(weights, other["parameters"]["policy"][name])
    assert torch.equal(one["sessions"]["machines"], other["sessions"]["machines"])


def test_what_it_learns_from_starts_anywhere_and_what_it_is_scored_on_at_the_beginning(small):
    _, course = small("environment.speed=0.5", **NO_FILES)
    learner = course.vec_env(1).machines[0]
    assert (learner.rules.start, course.env.rules.start) == ("anywhere", "beginning")
    assert learner.rules.speed == course.env.rules.speed == 0.5


def test_files_of_tasks_and_starts_of_sessions_are_refused(small, tmp_path):
    with pytest.raises(ValueError, match="has no use for --pool"):
        small(pool=tmp_path / "pool.npz", validation=None)
    with pytest.raises(ValueError, match="starts must stay 'centre'"):
        small("starts=interpolated", **NO_FILES)


def test_a_driver_of_another_layout_is_refused(small):
    made, course = small(steps=128, **NO_FILES)
    PolicyTrainer(made, course).train()
    driver = load_driver(made.folder / BEST)
    with pytest.raises(ValueError, match="sees other observations"):
        run(gym.make("PKM/SPR3Motion-v0").unwrapped, driver, seed=0)


def test_damaged_files_are_refused(small):
    made, course = small(steps=128, **NO_FILES)
    PolicyTrainer(made, course).train()
    file = made.folder / BEST
    content = json.loads(file.read_text())
    file.with_suffix(".safetensors").write_bytes(b"other")
    with pytest.raises(ValueError, match="is damaged or was edited"):
        load_driver(made.folder)
    del content["layout"]
    file.write_text(json.dumps(content))
    with pytest.raises(ValueError, match="is no driver: it lacks layout"):
        load_driver(made.folder)
    with pytest.raises(ValueError, match="can't read the driver"):
        load_driver(made.folder / "other.json")


@pytest.mark.slow
@pytest.mark.parametrize("env_id", MOTIONS)
def test_a_short_training_beats_random_actions_by_far(small, env_id):
    recipe = read_recipe("ppo", env_id, steps=120_000)
    made, course = small(env_id=env_id, **NO_FILES)
    made = Run(env_id, "ppo", 0, recipe, None, None, made.folder.with_name("learns"), "a test")
    made.write()
    best = PolicyTrainer(
        made, motion_course(find_spec(env_id, motion=True), recipe, **NO_FILES)
    ).train()
    assert best > 0.6
    assert best > 5.0 * run(course.env, random, seed=0).mean_reward
