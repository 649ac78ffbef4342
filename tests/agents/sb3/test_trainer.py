"""Training with each algorithm: what it writes, that it learns, that it resumes to the bit."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch
from scipy.stats import binomtest

from pkm_gym.agents.designers.files import read_designer
from pkm_gym.agents.runs.recipe import LEARNERS
from pkm_gym.agents.runs.run import BEST, CHECKPOINT, RUN, SCORES
from pkm_gym.agents.runs.trainer import Stopped
from pkm_gym.agents.sb3.network import Network
from pkm_gym.agents.sb3.trainer import PolicyTrainer, make_model

PLAIN = (
    "environment.reward=improvement",
    "environment.step_first=1.0",
    "environment.step_decay=0.5",
)
FAMILY = {"steps": 30_000, "starts": "centre"}
STATES = ("parameters", "variables", "counters", "last_obs", "torch", "numpy", "sessions")


def stop_after(rollouts: int):
    """Answer no so many times, then yes."""
    left = iter([False] * rollouts)
    return lambda: next(left, True)


def assert_same(one, other) -> None:
    assert type(one) is type(other)
    if isinstance(one, dict):
        assert one.keys() == other.keys()
        for name in one:
            assert_same(one[name], other[name])
    elif isinstance(one, list | tuple):
        for a, b in zip(one, other, strict=True):
            assert_same(a, b)
    elif isinstance(one, torch.Tensor):
        assert one.dtype == other.dtype
        assert torch.equal(one.nan_to_num(-9.0), other.nan_to_num(-9.0))
    else:
        assert one == other


@pytest.mark.parametrize("algorithm", LEARNERS)
def test_training_writes_its_folder_and_changes_the_weights(small, algorithm):
    run, course = small(algorithm)
    before = make_model(run, course).get_parameters()["policy"]
    best = PolicyTrainer(run, course).train()
    settings = json.loads((run.folder / RUN).read_text())
    assert settings["recipe"]["envs"] == 8
    assert {"torch", "stable_baselines3"} <= settings["versions"].keys()
    scores = [json.loads(line) for line in (run.folder / SCORES).read_text().splitlines()]
    assert scores[-1]["steps"] == 384
    assert max(line["score"] for line in scores) == best
    after = torch.load(run.folder / CHECKPOINT, weights_only=True)["parameters"]["policy"]
    assert before.keys() == after.keys()
    assert any(not torch.equal(before[name], after[name]) for name in before)
    designer, origin = read_designer(run.folder / BEST)
    assert origin.score == best
    assert origin.pool == 0
    assert designer.design(None or {}).designs.shape == (1, 12, 1)


@pytest.mark.parametrize("algorithm", LEARNERS)
def test_the_network_acts_as_the_model_does(small, algorithm):
    run, course = small(algorithm)
    model = make_model(run, course)
    observations = model.env.reset()
    expected, _ = model.predict(observations, deterministic=True)
    actions = Network.of_model(model)(observations)
    np.testing.assert_allclose(actions, expected, atol=1e-6)


@pytest.mark.parametrize("algorithm", LEARNERS)
@pytest.mark.parametrize("rollouts", [0, 1, 2, 3])
def test_a_resumed_run_is_equal_to_the_bit(small, algorithm, rollouts):
    whole, course = small(algorithm)
    PolicyTrainer(whole, course).train()
    parts, course = small(algorithm)
    with pytest.raises(Stopped):
        PolicyTrainer(parts, course, stop=stop_after(rollouts)).train()
    np.random.default_rng().random()
    torch.manual_seed(99)
    PolicyTrainer(parts, course).train(resume=True)
    one, other = (torch.load(r.folder / CHECKPOINT, weights_only=True) for r in (whole, parts))
    for name in STATES:
        assert_same(one[name], other[name])


def test_a_checkpoint_of_another_recipe_is_refused(small):
    run, course = small()
    PolicyTrainer(run, course).train()
    other, course = small("ppo", "policy.net_arch=[8]")
    (run.folder / CHECKPOINT).rename(other.folder / CHECKPOINT)
    with pytest.raises(ValueError, match="belongs to another recipe"):
        PolicyTrainer(other, course).train(resume=True)


def test_a_damaged_checkpoint_is_refused(small):
    run, course = small()
    (run.folder / CHECKPOINT).write_bytes(b"PK\x03\x04 no zip")
    with pytest.raises(ValueError, match="is no checkpoint, or a damaged one"):
        PolicyTrainer(run, course).train(resume=True)


def test_a_setting_that_sb3_refuses_is_said(small):
    run, course = small("ppo", "algorithm.n_steps=1", "envs=1")
    with pytest.raises(ValueError, match="ppo refuses its settings"):
        make_model(run, course)


@pytest.mark.slow
def test_ppo_beats_random_search_on_one_variable(small):
    few = (*PLAIN, "environment.budget=3", "envs=32", "policy.net_arch=[64,64]")
    run, course = small("ppo", *few, env_id="PKM/DiamondFamily-v0", **FAMILY)
    PolicyTrainer(run, course).train()
    designer, _ = read_designer(run.folder / BEST)
    problem, tasks = course.problem, course.problem.draw_tasks(200, np.random.default_rng(99))
    session = designer.design(tasks)
    own = np.where(session.feasible, session.merit, np.inf).min(axis=1)
    draws = np.random.default_rng(0).random((len(tasks) * 3, 1))
    designs = problem.low + (problem.high - problem.low) * draws
    evaluation = problem.evaluate(designs, np.repeat(tasks, 3, axis=0))
    random = np.where(evaluation.feasible, evaluation.merit, np.inf).reshape(-1, 3).min(axis=1)
    differing = own != random
    wins = int((own < random)[differing].sum())
    assert binomtest(wins, int(differing.sum()), alternative="greater").pvalue < 0.01
