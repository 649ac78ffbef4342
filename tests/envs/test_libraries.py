"""What other libraries do with the environments, run by themselves."""

from __future__ import annotations

import os
import subprocess
import sys

import gymnasium as gym
import imageio.v2 as imageio
import mo_gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode
from mo_gymnasium import wrappers
from mo_gymnasium.wrappers import vector

from pkm_gym.core.trial import trial_values
from pkm_gym.mechanisms import problem_type

# MO-Gymnasium -------------------------------------------------------------------------------------


def vector_env(env_id: str) -> gym.Env:
    """An environment that is rewarded with the vector of all its objectives."""
    names = [o.name for o in problem_type(gym.spec(env_id).kwargs["problem"]).all_objectives]
    return mo_gymnasium.make(env_id, objective=names, reward="objectives", start="random")


def test_the_reward_is_the_vector_of_objectives(problem, fixed_id, design, play):
    env, feasible = vector_env(fixed_id), 0
    names = [objective.name for objective in problem.all_objectives]
    signs = np.where([o.direction == "maximise" for o in problem.all_objectives], 1.0, -1.0)
    own, space = env.unwrapped.problem, env.unwrapped.reward_space
    assert space.shape == (env.unwrapped.reward_dim,) == (len(names),)
    for seed in range(3):
        for _, reward, _, _, info in play(env, seed, options={"design": design}):
            tried = own.design({name: info["design"][name] for name in own.variable_names})
            expected = trial_values(own.evaluate(tried[None]))[0]
            np.testing.assert_allclose(reward, signs * expected, rtol=1e-6)
            assert space.contains(reward)
            if info["feasible"]:
                feasible += 1
                indices = [info["indices"][name] for name in names]
                np.testing.assert_allclose(reward, signs * indices, rtol=1e-6)
    assert feasible


@pytest.fixture(params=["PKM/DiamondFamily-v0", "PKM/StrokeLeg-v0", "PKM/SPR3-v0"])
def several(request):
    """A function that makes an environment that is rewarded with a vector."""
    return lambda: vector_env(request.param)


def test_its_wrappers_take_a_vector(several, play):
    env = several()
    weight = np.arange(1.0, 1.0 + env.unwrapped.reward_dim)
    linear = wrappers.LinearReward(env, weight)
    for _, reward, _, _, info in play(linear, 0):
        assert reward == pytest.approx(weight @ info["vector_reward"])
    counted = wrappers.MORecordEpisodeStatistics(several(), gamma=0.9)
    steps = play(counted, 0)
    rewards = np.array([step[1] for step in steps])
    said = steps[-1][4]["episode"]
    np.testing.assert_allclose(said["r"], rewards.sum(axis=0), rtol=1e-5)
    discounts = 0.9 ** np.arange(len(rewards))
    np.testing.assert_allclose(said["dr"], discounts @ rewards, rtol=1e-5)
    assert np.isfinite(
        [step[1] for step in play(wrappers.MONormalizeReward(several(), 0), 0)]
    ).all()
    clipped = wrappers.MOClipReward(several(), 0, -0.5, 0.5)
    assert all(-0.5 <= step[1][0] <= 0.5 for step in play(clipped, 0))
    skipping = wrappers.MOMaxAndSkipObservation(several(), skip=3)
    assert len(play(skipping, 0)) == len(steps) // 3


def test_its_vector_environment_is_the_native_one(several, rng):
    spec = several().spec
    arguments = {**spec.kwargs, "autoreset_mode": AutoresetMode.NEXT_STEP}
    native = gym.make_vec(spec.id, num_envs=3, **arguments)
    sync = vector.MOSyncVectorEnv([several] * 3)
    assert native.reward_space == sync.reward_space
    counted = [vector.MORecordEpisodeStatistics(envs) for envs in (native, sync)]
    for envs in counted:
        envs.reset(seed=5)
    ends = 0
    for _ in range(2 * native.rules.budget):
        actions = rng.uniform(-1.0, 1.0, native.action_space.shape).astype(np.float32)
        one, other = (envs.step(actions) for envs in counted)
        for a, b in zip(one[:4], other[:4], strict=True):
            assert a.dtype == b.dtype
            np.testing.assert_allclose(a, b, rtol=1e-6, atol=1e-7)
        if one[2].any():
            ends += 1
            np.testing.assert_allclose(one[4]["episode"]["r"], other[4]["episode"]["r"], rtol=1e-5)
    assert ends


def test_a_reward_that_is_a_number_has_no_reward_space(fixed_id, make):
    for env in (make(fixed_id), gym.make_vec(fixed_id)):
        assert not hasattr(env, "reward_dim")
        with pytest.raises(AttributeError, match="reward is 'improvement', a number"):
            _ = env.reward_space


# Gymnasium's RecordVideo --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("env_id", "arguments"),
    [
        ("PKM/Diamond-v0", {"budget": 2}),
        ("PKM/Diamond-v0", {"budget": 2, "renderer": "mujoco"}),
        ("PKM/DiamondMotion-v0", {"error_limit": 0.002, "width": 320, "height": 240}),
    ],
)
def test_record_video_writes_an_episode(env_id, arguments, tmp_path):
    env = gym.make(env_id, render_mode="rgb_array", **arguments)
    env.reset(seed=0)
    try:
        height, width, _ = env.render().shape
    except OSError as error:
        pytest.skip(f"MuJoCo draws nothing on this machine: {error}")
    film, frames, ended = gym.wrappers.RecordVideo(env, str(tmp_path / "films")), 1, False
    film.reset(seed=0)
    while not ended:
        _, _, ended, _, _ = film.step(np.zeros(env.action_space.shape))
        frames += 1
    film.close()
    (file,) = tmp_path.glob("films/*.mp4")
    video = imageio.get_reader(file)
    assert video.get_meta_data()["size"] == (width, height)
    assert abs(video.count_frames() - frames) <= 1
    video.close()


# Minari -------------------------------------------------------------------------------------------

# In a process of its own: JAX, which Minari needs, would rather not be forked.
COLLECT = """
import sys, gymnasium as gym, minari, numpy as np, pkm_gym
collector = minari.DataCollector(gym.make(sys.argv[1]), record_infos=True)
collector.action_space.seed(0)
said = []
for episode in range(3):
    said.append([collector.reset(seed=episode)[1]])
    ended = False
    while not ended:
        *_, ended, _, info = collector.step(0.1 * collector.action_space.sample())
        said[-1].append(info)
dataset = collector.create_dataset("pkm/test-v0")

def equal(kept, given):
    if isinstance(kept, dict):
        assert kept.keys() == given[0].keys()
        return all(equal(kept[name], [info[name] for info in given]) for name in kept)
    words = isinstance(given[0], str)
    return [x.decode() for x in kept] == given if words else np.array_equal(kept, given)

for episode, given in zip(dataset.iterate_episodes(), said, strict=True):
    assert equal(episode.infos, given)
print(len(dataset))
"""


def minari(env_id, folder):
    done = subprocess.run(
        [sys.executable, "-c", COLLECT, env_id],
        capture_output=True, text=True, check=False,
        env={**os.environ, "MINARI_DATASETS_PATH": str(folder), "JAX_PLATFORMS": "cpu"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("env_id", ["PKM/DiamondFamily-v0", "PKM/SPR3-v0", "PKM/DiamondMotion-v0"])
def test_minari_keeps_every_info(env_id, tmp_path):
    assert minari(env_id, tmp_path).strip() == "3"
