"""Tuning: a study of trainings that is resumed, and whose winner is trained afresh."""

from __future__ import annotations

import inspect

import pytest

from pkm_gym.agents.runs.recipe import ALGORITHMS, algorithm_class, read_recipe
from pkm_gym.agents.runs.run import SCORES
from pkm_gym.agents.runs.tuning import FRESH, SPACES, changed
from pkm_gym.agents.verbs.tune import command

SMALL = ["envs=8", "checkpoints=2", "policy.net_arch=[8]", "environment.free=['gap']",
         "algorithm.n_steps=12", "algorithm.batch_size=48"]  # fmt: skip


@pytest.mark.parametrize("algorithm", ALGORITHMS)
def test_what_is_searched_exists(algorithm):
    names = set(inspect.signature(algorithm_class(algorithm)).parameters)
    for key, (low, high) in SPACES[algorithm].items():
        assert low < high
        group, _, name = key.partition(".")
        assert group == "policy" or name in names


def test_a_changed_recipe_keeps_the_rest():
    recipe = read_recipe("ppo", "PKM/Diamond-v0")
    other = changed(recipe, {"algorithm.gamma": 0.5, "algorithm.learning_rate": 1e-3})
    assert other.algorithm == {**recipe.algorithm, "gamma": 0.5, "learning_rate": [1e-3, 1e-5]}
    assert other.policy == recipe.policy


@pytest.mark.slow
def test_a_study_is_resumed_and_its_winner_trained_afresh(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for trials in (1, 2):
        command("PKM/Diamond-v0", trials=trials, steps=192, set_=SMALL)
    said = capsys.readouterr().out
    assert "The best of 2 trials" in said
    folder = tmp_path / "runs/agents/tune-Diamond-v0-ppo"
    assert len(list(folder.glob("trial-*"))) == 4
    for seed in FRESH:
        assert any((path / SCORES).exists() for path in folder.glob(f"winner-*-{seed}"))
    with pytest.raises(ValueError, match="tunes another recipe"):
        command("PKM/Diamond-v0", trials=2, steps=384, set_=SMALL)
