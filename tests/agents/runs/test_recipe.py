"""Recipes: what the files and the command line say, and what they may not."""

from __future__ import annotations

import pytest

from pkm_gym.agents.runs.recipe import LEARNERS, read_recipe


@pytest.mark.parametrize("algorithm", LEARNERS)
def test_every_algorithm_has_defaults(algorithm):
    recipe = read_recipe(algorithm, "PKM/Diamond-v0")
    assert recipe.steps > 0
    assert recipe.starts == "centre"


def test_a_block_of_the_environment_changes_the_defaults():
    default, own = (read_recipe("ppo", f"PKM/{name}-v0") for name in ("Diamond", "DiamondFamily"))
    assert own.environment["reward"] == "regret"
    assert own.algorithm["gamma"] == default.algorithm["gamma"]
    assert own.policy["net_arch"] != default.policy["net_arch"]


def test_the_command_line_changes_the_file(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text("[default]\nsteps = 10\nenvs = 2\n[default.algorithm]\ngamma = 0.5\n")
    settings = ["algorithm.gae_lambda=0.7", "policy.net_arch=[8, 8]", "policy.activation=tanh"]
    recipe = read_recipe("ppo", "PKM/Diamond-v0", file=file, settings=settings, steps=20)
    assert recipe.steps == 20
    assert recipe.algorithm == {"gamma": 0.5, "gae_lambda": 0.7}
    assert recipe.policy == {"net_arch": [8, 8], "activation": "tanh"}


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (["algoritm.gamma=1"], "unknown setting 'algoritm'; did you mean 'algorithm'?"),
        (["algorithm.gama=1"], "unknown setting of ppo 'gama'; did you mean 'gamma'?"),
        (["envs=0"], "envs is 0: it must be a whole number of at least 1"),
        (["starts=center"], "unknown starts 'center'; did you mean 'centre'?"),
        (["policy.activation=rellu"], "unknown activation 'rellu'; did you mean 'relu'?"),
        (["envs"], "--set envs says no value"),
    ],
)
def test_a_bad_setting_is_refused_in_one_sentence(settings, sentence):
    with pytest.raises(ValueError, match="^" + sentence.replace("?", r"\?")):
        read_recipe("ppo", "PKM/Diamond-v0", settings=settings)


def test_an_unknown_algorithm_is_refused():
    with pytest.raises(ValueError, match="unknown algorithm 'poo'; did you mean 'ppo'"):
        read_recipe("poo", "PKM/Diamond-v0")


def test_a_file_that_is_no_toml_is_refused(tmp_path):
    (tmp_path / "mine.toml").write_text("steps = ")
    with pytest.raises(ValueError, match="is no TOML file"):
        read_recipe("ppo", "PKM/Diamond-v0", file=tmp_path / "mine.toml")
