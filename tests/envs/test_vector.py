"""n sessions at a time are n environments in a SyncVectorEnv, and other ways to run many."""

from __future__ import annotations

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from stable_baselines3.common.vec_env import SubprocVecEnv

MODES = ("SameStep", "NextStep", "Disabled")
N = 5


def pair(env_id: str, mode: str = "SameStep", *, budget: int = 12, **arguments):
    arguments["budget"] = budget
    native = gym.make_vec(env_id, num_envs=N, autoreset_mode=mode, **arguments)
    sync = SyncVectorEnv(
        [lambda: gym.make(env_id, **arguments) for _ in range(N)], autoreset_mode=mode
    )
    return native, sync


def assert_same_info(one, other, where: str = "info") -> None:
    assert type(one) is type(other), where
    if isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for name in one:
            assert_same_info(one[name], other[name], f"{where}[{name!r}]")
        return
    assert one.dtype == other.dtype, where
    assert one.shape == other.shape, where
    if one.dtype == object:
        for a, b in zip(one, other, strict=True):
            assert type(a) is type(b), where
            np.testing.assert_array_equal(a, b, err_msg=where)
    else:
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12, err_msg=where)


def assert_same(one: tuple, other: tuple) -> None:
    assert one[0].dtype == other[0].dtype == np.float32
    np.testing.assert_allclose(one[0], other[0], rtol=1e-6, atol=1e-7)
    for a, b in zip(one[1:-1], other[1:-1], strict=True):
        assert a.dtype == b.dtype
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=1e-12)
    assert_same_info(one[-1], other[-1])


def run_both(native, sync, rng, steps: int, mode: str) -> int:
    """Step both alike, resetting what is over where nothing else does; count the ends."""
    ends = 0
    for _ in range(steps):
        actions = rng.uniform(-1.3, 1.3, native.action_space.shape).astype(np.float32)
        one, other = native.step(actions), sync.step(actions)
        assert_same(one, other)
        ends += int(one[2].sum())
        if mode == "Disabled" and one[2].any():
            assert_same(*(e.reset(options={"reset_mask": one[2].copy()}) for e in (native, sync)))
    return ends


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("start", ["centre", "random"])
def test_native_is_sync_over_several_episodes(env_id, rng, mode, start):
    native, sync = pair(env_id, mode, start=start)
    assert_same(native.reset(seed=11), sync.reset(seed=11))
    assert run_both(native, sync, rng, 28, mode) >= 2 * N


@pytest.mark.parametrize("mode", MODES)
def test_native_is_sync_when_sessions_end_at_different_steps(env_id, rng, mode):
    native, sync = pair(env_id, mode, start="random", budget=4)
    assert_same(native.reset(seed=3), sync.reset(seed=3))
    for some in ([0], [1, 3], [4]):
        mask = np.isin(np.arange(N), some)
        run_both(native, sync, rng, 2, mode)
        options = {"reset_mask": mask}
        assert_same(*(e.reset(options=dict(options)) for e in (native, sync)))
    assert run_both(native, sync, rng, 16, mode) >= 3 * N


@pytest.mark.parametrize("mode", MODES)
def test_native_is_sync_with_regret_and_a_pool(family_id, rng, mode, pools):
    _, file = pools
    native, sync = pair(family_id, mode, pool=str(file), start="pool", reward="regret")
    assert_same(native.reset(seed=7), sync.reset(seed=7))
    assert run_both(native, sync, rng, 30, mode) >= 2 * N


@pytest.mark.parametrize("reward", ["final", "regret"])
def test_native_is_sync_with_other_rewards_of_the_papers_task(fixed_id, rng, paper_pool, reward):
    native, sync = pair(fixed_id, reward=reward, action_mode="absolute", pool=str(paper_pool[1]))
    assert_same(native.reset(seed=7), sync.reset(seed=7))
    assert run_both(native, sync, rng, 26, "SameStep") == 2 * N


def test_native_takes_seeds_and_options_as_sync_does(env_id, rng):
    native, sync = pair(env_id, start="random")
    problem = native.problem
    seeds = [5, None, 5, 1, 2]
    native.reset(seed=0), sync.reset(seed=0)
    assert_same(native.reset(seed=seeds), sync.reset(seed=seeds))
    assert native.np_random_seed[0] == native.np_random_seed[2] == 5
    given = {
        "task": problem.draw_tasks(1, rng)[0],
        "design": 0.7 * problem.low + 0.3 * problem.high,
    }
    for options in (given, {"task": {}}, {"design": problem.named(given["design"])}, {}):
        assert_same(native.reset(options=dict(options)), sync.reset(options=dict(options)))
    assert_same(native.reset(), sync.reset())
    assert [g.bit_generator.state for g in native.np_random] == [
        g.bit_generator.state for g in sync.np_random
    ]


def test_a_row_of_task_and_design_may_be_given_for_each_session(family_id, rng):
    envs = gym.make_vec(family_id, num_envs=N)
    tasks = envs.problem.draw_tasks(N, rng)
    designs = envs.problem.low + (envs.problem.high - envs.problem.low) * rng.random(
        (N, len(envs.problem.low))
    )
    envs.reset(options={"task": tasks, "design": designs})
    np.testing.assert_array_equal(envs.session.tasks, tasks)
    np.testing.assert_array_equal(envs.session.best.designs, designs)


def test_one_call_evaluates_all_sessions(env_id, monkeypatch):
    envs = gym.make_vec(env_id, num_envs=N)
    calls = []
    evaluate = envs.problem.evaluate
    monkeypatch.setattr(
        envs.problem, "evaluate", lambda *given: calls.append(len(given[0])) or evaluate(*given)
    )
    envs.reset()
    for _ in range(12):
        envs.step(envs.action_space.sample())
    assert calls == [N] * 12


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda envs: pickle.loads(pickle.dumps(envs))])
def test_a_copy_goes_on_with_the_sessions(env_id, copied):
    envs = gym.make_vec(env_id, num_envs=2, start="random")
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    other = copied(envs)
    for _ in range(14):
        actions = envs.action_space.sample()
        assert_same(envs.step(actions), other.step(actions))


def test_what_is_returned_belongs_to_the_caller(env_id):
    envs = gym.make_vec(env_id, num_envs=2, start="random")
    twin = gym.make_vec(env_id, num_envs=2, start="random")
    envs.reset(seed=0), twin.reset(seed=0)
    for _ in range(14):
        actions = envs.action_space.sample()
        one, other = envs.step(actions), twin.step(actions)
        assert_same(one, other)
        for array in (*one[:4], *one[4]["best_design"].values()):
            array[:] = 1


@pytest.mark.parametrize("mode", MODES)
def test_metadata_holds_the_autoreset_mode(fixed_id, mode):
    envs = gym.make_vec(fixed_id, num_envs=2, autoreset_mode=mode)
    assert envs.metadata["autoreset_mode"] is AutoresetMode(mode)
    assert gym.make_vec(fixed_id).metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


def test_sessions_that_are_over_are_not_stepped(fixed_id):
    envs = gym.make_vec(fixed_id, num_envs=2, autoreset_mode="Disabled", budget=1)
    with pytest.raises(gym.error.ResetNeeded, match="call reset"):
        envs.step(envs.action_space.sample())
    envs.reset()
    envs.step(envs.action_space.sample())
    envs.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(gym.error.ResetNeeded, match="call reset"):
        envs.step(envs.action_space.sample())


def test_hostile_actions_are_refused_before_anything_changes(env_id):
    envs = gym.make_vec(env_id, num_envs=3)
    envs.reset(seed=0)
    envs.step(envs.action_space.sample())
    good = np.zeros(envs.action_space.shape)
    before = pickle.dumps(vars(envs.session))
    for value in (np.nan, np.inf, -np.inf):
        actions = good.copy()
        actions[2, 0] = value
        with pytest.raises(ValueError, match=r"actions must be finite: .* stands at \(2, 0\)"):
            envs.step(actions)
    for actions in (good[0], good[:2], good[..., None], None, [["x"] * good.shape[1]] * 3):
        with pytest.raises(ValueError, match="actions must be numbers of shape"):
            envs.step(actions)
    assert pickle.dumps(vars(envs.session)) == before


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"num_envs": 0}, "num_envs is 0: it must be a whole number of at least 1"),
        ({"autoreset_mode": "samestep"}, "did you mean 'SameStep'"),
        ({"render_mode": "human"}, "unknown render_mode 'human'"),
        ({"budget": 0}, "budget is 0"),
        ({"num_env": 2}, "unknown argument 'num_env'; did you mean 'num_envs'"),
        ({"start_": "pool"}, "unknown argument 'start_'; did you mean 'start'"),
    ],
)
def test_bad_arguments_are_refused(fixed_id, arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        gym.make_vec(fixed_id, **arguments)


def test_bad_seeds_and_masks_are_refused(fixed_id):
    envs = gym.make_vec(fixed_id, num_envs=3)
    with pytest.raises(ValueError, match="seed has 2 entries: it must have 3"):
        envs.reset(seed=[1, 2])
    for mask in ([True], np.zeros(3, dtype=bool), np.ones(3)):
        with pytest.raises(ValueError, match="option reset_mask"):
            envs.reset(options={"reset_mask": mask})


WRAPPERS = {
    "RecordEpisodeStatistics": ((), MODES),
    "NormalizeReward": ((), MODES),
    "RescaleAction": ((np.float32(-2), np.float32(2)), MODES),
    "DictInfoToList": ((), MODES),
    "FlattenObservation": ((), ("NextStep", "Disabled")),
    "NormalizeObservation": ((), ("NextStep",)),
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", WRAPPERS)
def test_gymnasiums_vector_wrappers_take_the_modes_that_the_docs_say(fixed_id, name, mode):
    arguments, modes = WRAPPERS[name]
    envs = gym.make_vec(fixed_id, num_envs=3, autoreset_mode=mode)
    if mode not in modes:
        with pytest.raises(ValueError, match="autoreset_mode"):
            getattr(gym.wrappers.vector, name)(envs, *arguments)
        return
    wrapped = getattr(gym.wrappers.vector, name)(envs, *arguments)
    wrapped.reset(seed=0)
    for _ in range(12):
        wrapped.step(wrapped.action_space.sample())
    wrapped.reset()
    wrapped.step(wrapped.action_space.sample())


def test_episode_statistics_count_the_budget_and_the_return(fixed_id):
    envs = gym.wrappers.vector.RecordEpisodeStatistics(
        gym.make_vec(fixed_id, num_envs=3, budget=12)
    )
    envs.reset(seed=0)
    total = np.zeros(3)
    for _ in range(12):
        _, rewards, _, _, infos = envs.step(envs.action_space.sample())
        total += rewards
    assert infos["episode"]["l"].tolist() == [12] * 3
    np.testing.assert_allclose(infos["episode"]["r"], total)


@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
@pytest.mark.parametrize("context", ["fork", "spawn"])
def test_async_processes_run_the_compiled_kernels(family_id, context):
    warm = gym.make_vec(family_id, num_envs=512)
    warm.reset(seed=0)
    warm.step(warm.action_space.sample())  # enough work to start the threads before the fork
    spec = gym.spec(family_id)  # a child may not know the id of a problem from outside
    made = [lambda: gym.make(spec)] * 2
    apart = AsyncVectorEnv(made, context=context, autoreset_mode=AutoresetMode.SAME_STEP)
    together = SyncVectorEnv(made, autoreset_mode=AutoresetMode.SAME_STEP)
    together.action_space.seed(0)
    try:
        assert_same(apart.reset(seed=0), together.reset(seed=0))
        for _ in range(15):
            actions = together.action_space.sample()
            assert_same(apart.step(actions), together.step(actions))
    finally:
        apart.close()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_subprocesses_of_stable_baselines3_run_the_compiled_kernels(family_id, make):
    apart = SubprocVecEnv([lambda: gym.make("pkm_gym:" + family_id)] * 2)
    try:
        apart.seed(21)
        alone = [make(family_id) for _ in range(2)]
        seen = apart.reset()
        for i, env in enumerate(alone):
            np.testing.assert_allclose(seen[i], env.reset(seed=21 + i)[0], atol=1e-6)
        for _ in range(11):
            actions = np.stack([env.action_space.sample() for env in alone])
            seen, rewards, _, _ = apart.step(actions)
            for i, env in enumerate(alone):
                one = env.step(actions[i])
                np.testing.assert_allclose(seen[i], one[0], atol=1e-6)
                assert rewards[i] == pytest.approx(one[1], abs=1e-6)
    finally:
        apart.close()
