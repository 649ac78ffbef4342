"""Recipes: what the files and the command line say, and what they may not."""

from __future__ import annotations

import inspect
import re

import pytest

from pkm_gym.agents.runs.recipe import LEARNERS, algorithm_class, read_recipe
from pkm_gym.agents.runs.schema import ALGORITHM, POLICY

# Set by a run, of other spaces, or what the algorithm tells its policy.
GIVEN = ("verbose", "_init_setup_model", "normalize_images", "squash_output")


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
        (["algorithm.gama=1"], "unknown setting of algorithm 'gama'; did you mean 'gamma'?"),
        (["envs=0"], "envs is 0: it must be a whole number of at least 1"),
        (["starts=center"], "unknown starts 'center'; did you mean 'centre'?"),
        (["policy.activation=rellu"], "unknown activation 'rellu'; did you mean 'relu'?"),
        (["envs"], "--set envs says no value"),
        (["algorithm=5"], "algorithm is 5: write algorithm.KEY=VALUE"),
        (["algorithm.gamma=5"], "algorithm.gamma is 5: it must be a number from 0 to 1"),
        (["algorithm.gamma=nan"], "algorithm.gamma is nan: it must be a number"),
        (["algorithm.gamma=abc"], "algorithm.gamma is 'abc': it must be a number"),
        (["algorithm.batch_size=0"], "algorithm.batch_size is 0: it must be a whole number from 2"),
        (
            ["algorithm.learning_rate=0"],
            "algorithm.learning_rate is 0: it must be a number above 0",
        ),
        (["algorithm.n_steps=true"], "algorithm.n_steps is True: it must be a whole number"),
        (["algorithm.policy_kwargs=1"], "unknown setting of algorithm 'policy_kwargs'"),
        (["algorithm.tau=0.1"], "unknown setting of algorithm 'tau'"),
        (["policy.net_arch=[-1]"], "policy.net_arch is [-1]: it must be a list of widths"),
        (["policy.net_arch=8"], "policy.net_arch is 8: it must be a list of widths"),
        (["policy.n_quantiles=8"], "unknown setting of policy 'n_quantiles'"),
        (["policy.optimizer_class=8"], "unknown setting of policy 'optimizer_class'"),
    ],
)
def test_a_bad_setting_is_refused_in_one_sentence(settings, sentence):
    with pytest.raises(ValueError, match="^" + re.escape(sentence)):
        read_recipe("ppo", "PKM/Diamond-v0", settings=settings)


def test_three_learning_rates_are_refused():
    with pytest.raises(ValueError, match=r"\[1, 2, 3\]: it must be a number above 0, or two"):
        read_recipe("sac", "PKM/Diamond-v0", settings=["algorithm.learning_rate=[1,2,3]"])


@pytest.mark.parametrize(
    ("algorithm", "setting"),
    [
        ("ppo", "policy.net_arch={pi=[8],vf=[16,8]}"),
        ("ppo", "algorithm.ent_coef=0.01"),
        ("sac", "algorithm.ent_coef=auto"),
        ("sac", "algorithm.train_freq=[1,'episode']"),
        ("td3", "algorithm.gradient_steps=-1"),
        ("tqc", "policy.n_quantiles=12"),
    ],
)
def test_what_stable_baselines_takes_is_taken(algorithm, setting):
    recipe = read_recipe(algorithm, "PKM/Diamond-v0", settings=[setting])
    group, key = setting.partition("=")[0].split(".")
    assert key in getattr(recipe, group)


@pytest.mark.parametrize("algorithm", LEARNERS)
def test_every_setting_that_can_be_said_has_a_rule(algorithm):
    """What has none is no number, word or list: classes, functions, and what the run sets."""
    made = algorithm_class(algorithm)
    kinds = bool | int | float
    for rules, kind in ((ALGORITHM, made), (POLICY, made.policy_aliases["MlpPolicy"])):
        for name, parameter in inspect.signature(kind).parameters.items():
            if isinstance(parameter.default, kinds) and name not in GIVEN:
                rule = (
                    rules.get(name) or ALGORITHM[name]
                )  # an algorithm's, which it tells its policy
                assert rule.holds(parameter.default), name


def test_an_unknown_algorithm_is_refused():
    with pytest.raises(ValueError, match="unknown algorithm 'poo'; did you mean 'ppo'"):
        read_recipe("poo", "PKM/Diamond-v0")


def test_a_file_that_is_no_toml_is_refused(tmp_path):
    (tmp_path / "mine.toml").write_text("steps = ")
    with pytest.raises(ValueError, match="is no recipe: it is no TOML, see its end"):
        read_recipe("ppo", "PKM/Diamond-v0", file=tmp_path / "mine.toml")
