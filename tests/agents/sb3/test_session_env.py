"""SessionVecEnv: SB3's protocol, the same sessions as DesignVectorEnv."""

from __future__ import annotations

from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from stable_baselines3.common.vec_env import DummyVecEnv

from pkm_gym.agents.sb3.session_env import SessionVecEnv
from pkm_gym.envs.vector import DesignVectorEnv

N = 6


def made(**arguments) -> SessionVecEnv:
    return SessionVecEnv(DesignVectorEnv("diamond", N, family=True, infos=False, **arguments))


def test_it_steps_as_the_vector_environment_does(rng):
    env, plain = made(), DesignVectorEnv("diamond", N, family=True)
    env.seed(4)
    first, _ = plain.reset(seed=4)
    np.testing.assert_array_equal(env.reset(), first)
    returns = np.zeros(N)
    for step in range(1, 31):
        actions = rng.uniform(-1.0, 1.0, (N, 3)).astype(np.float32)
        observations, rewards, ended, said = env.step(actions)
        expected, own_rewards, own_ended, _, infos = plain.step(actions)
        np.testing.assert_array_equal(observations, expected)
        np.testing.assert_allclose(rewards, own_rewards, rtol=1e-6)
        np.testing.assert_array_equal(ended, own_ended)
        returns += own_rewards
        assert ended.all() == (step % 12 == 0)
        for row in range(N):
            assert bool(said[row]) == ended[row]
            if ended[row]:
                last = said[row]["terminal_observation"]
                np.testing.assert_array_equal(last, infos["final_obs"][row])
                assert said[row]["episode"]["r"] == pytest.approx(returns[row])
                returns[row] = 0.0


def test_without_infos_only_the_last_observations_are_said():
    env = DesignVectorEnv("diamond", N, family=True, infos=False)
    assert env.reset(seed=0)[1] == {}
    for step in range(1, 13):
        infos = env.step(np.zeros((N, 3)))[4]
        assert infos.keys() == (set() if step < 12 else {"final_obs", "_final_obs"})


def test_a_restored_state_goes_on_alike(rng):
    env, other = made(), made()
    env.seed(1)
    env.reset()
    actions = rng.uniform(-1.0, 1.0, (20, N, 3)).astype(np.float32)
    for action in actions[:7]:
        env.step(action)
    other.restore(env.state())
    for action in actions[7:]:
        for one, two in zip(env.step(action)[:3], other.step(action)[:3], strict=True):
            np.testing.assert_array_equal(one, two)


def test_other_reset_modes_are_refused():
    with pytest.raises(ValueError, match="autoreset_mode is 'NextStep': SB3 needs 'SameStep'"):
        SessionVecEnv(DesignVectorEnv("diamond", N, autoreset_mode="NextStep"))


def test_attributes_belong_to_all_sessions():
    env = made()
    assert env.get_attr("num_envs", [0, 2]) == [N, N]
    assert env.env_is_wrapped(object) == [False] * N
    env.set_attr("render_mode", "rgb_array")
    assert env.get_attr("render_mode") == ["rgb_array"] * N
    with pytest.raises(ValueError, match="belongs to all sessions"):
        env.set_attr("render_mode", None, [1])


def both(**arguments):
    """The same sessions in our environment, and in SB3's own."""
    one = SessionVecEnv(DesignVectorEnv("diamond", 3, family=True, **arguments))
    make = partial(gym.make, "PKM/DiamondFamily-v0", **arguments)
    return one, DummyVecEnv([make] * 3)


def said_alike(one, other):
    """Whether two infos are equal."""
    assert one.keys() == other.keys()
    for name, value in other.items():
        if isinstance(value, dict):
            said_alike(one[name], value)
        else:
            np.testing.assert_array_equal(one[name], value, err_msg=name)


@pytest.mark.parametrize(
    "options",
    [
        {"task": {"payload": 1.0}},
        [{"task": {"payload": 0.6}}, {}, {"task": {"b": 0.9}}],
        [{"design": [0.5, 2.0, 0.3]}, {"task": {"payload": 1.0}}, {}],
    ],
)
def test_options_hold_for_the_next_reset_as_in_stable_baselines(options):
    envs = both()
    for env in envs:
        env.seed(5)
        env.set_options(options)
    np.testing.assert_allclose(*(env.reset() for env in envs), atol=1e-6)
    for one, other in zip(*(env.reset_infos for env in envs), strict=True):
        said_alike(one, other)
    for env in envs:
        env.seed(6)
    np.testing.assert_allclose(*(env.reset() for env in envs), atol=1e-6)


def test_a_misspelt_option_is_refused():
    env = made()
    env.set_options({"tusk": {"payload": 1.0}})
    with pytest.raises(ValueError, match="'tusk'; did you mean 'task'"):
        env.reset()
    env.set_options([{}] * 2)
    with pytest.raises(ValueError, match=f"set_options got 2 dictionaries.* each of the {N}"):
        env.reset()


def test_it_draws_what_its_sessions_evaluated(rng):
    envs = both(render_mode="rgb_array")
    actions = rng.uniform(-1.0, 1.0, (3, 3)).astype(np.float32)
    for env in envs:
        env.seed(5)
        env.reset()
        env.step(actions)
    one, other = (env.get_images() for env in envs)
    np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(*(env.render() for env in envs))
    with pytest.warns(UserWarning, match="make the environments with a render_mode"):
        assert made().get_images() == [None] * N
