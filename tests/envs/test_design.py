"""One design session: proposals, bookkeeping, rewards, infos, and what is refused."""

from __future__ import annotations

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest

from pkm_gym.envs.design import DesignEnv

WORST = 7.0


def step_size(t: int) -> float:
    return max(5e-4, 0.5**t)


def state(env) -> bytes:
    return pickle.dumps((vars(env.session), env.np_random.bit_generator.state))


# Proposals --------------------------------------------------------------------------------------


def test_steps_shrink_around_the_best_design_so_far(env_id, make, rng):
    env = make(env_id, start="random")
    low, span = env.problem.low, env.problem.high - env.problem.low
    _, info = env.reset(seed=1)
    best, best_merit = (
        np.array([info["best_design"][n] for n in env.problem.variable_names]),
        np.inf,
    )
    for t in range(12):
        action = rng.uniform(-1.0, 1.0, len(low))
        wanted = np.clip(best + action * step_size(t) * span, low, env.problem.high)
        *_, info = env.step(action)
        got = np.array([info["design"][name] for name in env.problem.variable_names])
        np.testing.assert_allclose(got, wanted, rtol=1e-14)
        if info["merit"] < best_merit:
            best, best_merit = got, info["merit"]
        assert [info["best_design"][n] for n in env.problem.variable_names] == list(best)


def test_absolute_actions_jump_over_the_whole_box(fixed_id, make):
    env = make(fixed_id, action_mode="absolute")
    low, high = env.problem.low, env.problem.high
    env.reset()
    for action, wanted in (
        (-1.0, low),
        (1.0, high),
        (0.0, (low + high) / 2),
        (-0.5, 0.75 * low + 0.25 * high),
    ):
        *_, info = env.step(np.full(len(low), action))
        tried = [info["design"][name] for name in env.problem.variable_names]
        np.testing.assert_allclose(tried, wanted, rtol=1e-14)


def test_actions_beyond_the_box_are_clipped(fixed_id, make):
    d = len(make(fixed_id).problem.low)
    steps = []
    for action in (np.full(d, 7.5), np.ones(d, dtype=np.float32)):
        env = make(fixed_id)
        env.reset()
        steps.append(env.step(action))
    assert steps[0][1:] == steps[1][1:]


def test_step_schedule_follows_its_arguments(fixed_id, make):
    env = make(fixed_id, step_first=0.2, step_decay=0.1, step_min=0.01, budget=4)
    np.testing.assert_allclose(env.rules.step_sizes, [0.2, 0.02, 0.01, 0.01, 0.01])


# Bookkeeping ------------------------------------------------------------------------------------


def test_budget_counts_every_evaluation_and_ends_the_episode(env_id, make, play, monkeypatch):
    env = make(env_id, budget=7)
    asked = []
    evaluate = env.problem.evaluate
    monkeypatch.setattr(
        env.problem,
        "evaluate",
        lambda designs, tasks: asked.append(len(designs)) or evaluate(designs, tasks),
    )
    steps = play(env, 0)
    assert asked == [1] * 7
    assert [step[2] for step in steps] == [False] * 6 + [True]
    assert not any(step[3] for step in steps)
    assert all(type(step[1]) is float for step in steps)


def test_stepping_before_a_reset_or_after_the_end_is_refused(fixed_id, make, play):
    env = make(fixed_id)
    with pytest.raises(gym.error.ResetNeeded, match="call reset"):
        env.step(env.action_space.sample())
    play(env, 0)
    with pytest.raises(gym.error.ResetNeeded, match="call reset"):
        env.step(env.action_space.sample())


def test_answer_is_that_of_the_problem_over_the_whole_episode(family_id, make, play, usable):
    answered = 0
    for seed in range(12):
        env = make(family_id, start="random")
        options = {"design": usable.designs[seed], "task": usable.tasks[seed]} if seed % 2 else None
        steps = play(env, seed, options=options)
        names = env.problem.variable_names
        designs = np.array([[step[4]["design"][name] for name in names] for step in steps])
        task = env.problem.unpack(env.session.tasks[0])
        for n in range(1, len(steps) + 1):
            evaluation = env.problem.evaluate(designs[:n], task)
            best, answer = evaluation.best(), steps[n - 1][4]["answer"]
            assert [answer["design"][name] for name in names] == list(designs[best])
            assert answer["feasible"] == evaluation.feasible[best]
            assert answer["merit"] == pytest.approx(evaluation.merit[best], rel=1e-12)
            if evaluation.feasible[best]:
                assert answer["objective"] == pytest.approx(
                    evaluation.objectives[best, 0], rel=1e-12
                )
        answered += answer["feasible"]
    assert answered >= 6


def test_info_tells_what_the_problem_tells(env_id, make, play):
    env = make(env_id, start="random")
    for seed in range(10):
        for *_, info in play(env, seed):
            names = env.problem.variable_names
            design = np.array([info["design"][name] for name in names])
            evaluation = env.problem.evaluate(design[None], env.session.tasks)
            assert info["constraints"] == dict(
                zip(env.problem.constraint_names, evaluation.constraints[0], strict=True)
            )
            for name, (value,) in evaluation.indices.items():
                assert info["defined"][name] is not bool(np.isnan(value))
                assert info["indices"][name] == (value if info["defined"][name] else np.inf)
            assert info["feasible"] is bool(evaluation.feasible[0])
            assert info["merit"] == pytest.approx(evaluation.merit[0], rel=1e-14)
            named = (info["task"], info["design"], info["indices"])
            assert set(info["units"]) == set().union(*named)


def kinds(info) -> dict:
    return {k: kinds(v) if isinstance(v, dict) else type(v) for k, v in info.items()}


def test_info_has_the_same_keys_and_types_from_the_reset_on_and_no_nan(env_id, make, play):
    env = make(env_id, start="random")
    _, first = env.reset(seed=0)
    assert not first["feasible"]
    assert not any(first["defined"].values())
    assert first["design"] == first["best_design"] == first["answer"]["design"]
    undefined = 0
    for seed in range(10):
        for *_, info in play(env, seed):
            assert kinds(info) == kinds(first)
            assert info == copy.deepcopy(info), "NaN equals nothing"
            undefined += not all(info["defined"].values())
    assert undefined or env.problem.evaluate(env.problem.low[None]).defined.all()


def test_info_belongs_to_the_caller(fixed_id, make):
    env = make(fixed_id)
    _, info = env.reset()
    before = state(env)
    info["best_design"].clear()
    info["task"].clear()
    *_, info = env.step(env.action_space.sample())
    after = state(env)
    for part in ("task", "design", "best_design", "constraints", "indices", "defined", "units"):
        info[part].clear()
    assert after == state(env)
    assert before != after


def test_same_seed_gives_the_same_episodes(env_id, make, play):
    one, other, third = (play(make(env_id, start="random"), seed, episodes=3) for seed in (4, 4, 5))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a[0], b[0])
        assert a[1:] == b[1:]
    assert any((a[0] != b[0]).any() for a, b in zip(one, third, strict=True))


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copied_environment_goes_on_where_it_stood(env_id, make, copied):
    env = make(env_id, start="random")
    env.reset(seed=2)
    env.step(env.action_space.sample())
    again = copied(env)
    for _ in range(11):
        action = env.action_space.sample()
        one, other = env.step(action), again.step(action)
        np.testing.assert_array_equal(one[0], other[0])
        assert one[1:] == other[1:]
    np.testing.assert_array_equal(env.reset()[0], again.reset()[0])


# Rewards ----------------------------------------------------------------------------------------


def best_so_far(steps: list) -> np.ndarray:
    return np.minimum.accumulate([np.log(step[4]["merit"]) for step in steps])


def test_return_is_seven_less_the_best_log_merit(env_id, make, play):
    for seed in range(10):
        steps = play(make(env_id, start="random"), seed)
        rewards = [step[1] for step in steps]
        best = best_so_far(steps)
        np.testing.assert_allclose(rewards, -np.diff([WORST, *best]), atol=1e-12)
        assert sum(rewards) == pytest.approx(WORST - best[-1], abs=1e-12)


def test_final_reward_comes_at_the_end(env_id, make, play):
    steps = play(make(env_id, reward="final"), 1)
    best = best_so_far(steps)
    np.testing.assert_allclose(
        [step[1] for step in steps], [0.0] * (len(steps) - 1) + [-best[-1]], atol=1e-12
    )


def regrets(steps: list, optimum: float) -> np.ndarray:
    return np.maximum(0.0, np.array([WORST, *best_so_far(steps)]) - optimum)


def test_regret_of_the_papers_task_is_measured_from_its_verified_optimum(fixed_id, make, play):
    problem = make(fixed_id).problem
    optimum = problem.reference.optima.get(problem.objectives[0].name)
    if optimum is None:
        with pytest.raises(ValueError, match=r"give pool='FILE.npz' for another"):
            make(fixed_id, reward="regret")
        return
    env = make(fixed_id, reward="regret", regret_floor=1e-3)
    evaluation = problem.evaluate(problem.design(optimum.design)[None])
    assert evaluation.feasible[0]
    check_regrets(play(env, 3), evaluation.log_merit[0], 1e-3)
    env.reset(options={"design": optimum.design})
    _, reward, *_ = env.step(np.zeros(len(problem.low)))
    assert reward == pytest.approx(0.3 * np.log((WORST - evaluation.log_merit[0]) / 1e-3 + 1.0))


def test_regret_of_the_papers_task_may_be_measured_from_a_pools_optimum(
    fixed_id, make, play, paper_pool
):
    pool, file = paper_pool
    env = make(fixed_id, reward="regret", pool=str(file))
    optimum = env.problem.evaluate(pool.designs[:1]).log_merit[0]
    check_regrets(play(env, 3), optimum, 1e-5)


def check_regrets(steps: list, optimum: float, floor: float) -> None:
    r = regrets(steps, optimum)
    wanted = 0.3 * np.log((r[:-1] + floor) / (r[1:] + floor))
    np.testing.assert_allclose([step[1] for step in steps], wanted, atol=1e-7)


def test_regret_of_a_family_is_measured_from_the_pools_optima(family_id, make, play, pools):
    pool, file = pools
    env = make(family_id, reward="regret", pool=str(file))
    for seed in range(5):
        steps = play(env, seed)
        row = int(np.flatnonzero((pool.tasks == env.session.tasks[0]).all(axis=1))[0])
        assert pool.solvable[row]
        optimum = env.problem.evaluate(pool.designs[row][None], env.session.tasks)
        assert optimum.feasible[0]
        assert optimum.objectives[0, 0] == pytest.approx(pool.optima[row], rel=1e-12)
        check_regrets(steps, optimum.log_merit[0], 1e-5)


def test_regret_without_a_known_optimum_is_refused(fixed_id, make, paper_pool, other_task):
    problem = make(fixed_id).problem
    variable = problem.variables[0]
    for changed in (
        {"fixed": {variable.name: variable.low}},
        {"task": other_task(problem)},
        {"bounds": {variable.name: (variable.low, 0.5 * (variable.low + variable.high))}},
    ):
        with pytest.raises(ValueError, match="optimum of the paper's"):
            make(fixed_id, reward="regret", **changed)
    env = make(fixed_id, reward="regret", pool=str(paper_pool[1]))
    with pytest.raises(ValueError, match="has no stored optimum"):
        env.reset(options={"task": other_task(problem)})


def test_regret_of_a_family_without_its_optima_is_refused(family_id, make, pools, other_task):
    with pytest.raises(ValueError, match=r"needs solved tasks: give pool='FILE.npz'"):
        make(family_id, reward="regret")
    env = make(family_id, reward="regret", pool=str(pools[1]))
    with pytest.raises(ValueError, match="has no stored optimum"):
        env.reset(options={"task": other_task(env.problem)})


# What is refused --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "hostile",
    [np.nan, np.inf, -np.inf, "shape", "words", "none", "ragged", "complex"],
)
def test_hostile_actions_are_refused_before_anything_changes(env_id, make, hostile):
    env = make(env_id)
    env.reset(seed=0)
    env.step(env.action_space.sample())
    d = len(env.problem.low)
    action = {
        "shape": np.zeros(d + 1),
        "words": ["a"] * d,
        "none": None,
        "ragged": [[0.0], [0.0, 1.0]],
        "complex": np.zeros(d, dtype=complex),
    }.get(hostile)
    if isinstance(hostile, float):
        action = np.zeros(d)
        action[-1] = hostile
    before = state(env)
    with pytest.raises(ValueError, match="action must be"):
        env.step(action)
    assert before == state(env)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"budget": 0}, "budget is 0: it must be a whole number of at least 1"),
        ({"budget": 2.5}, "budget is 2.5"),
        ({"budget": True}, "budget is True"),
        ({"step_first": 1.5}, "step_first is 1.5: it must be greater than 0 and at most 1"),
        ({"step_decay": 0.0}, "step_decay is 0.0"),
        ({"step_min": float("nan")}, "step_min is nan"),
        ({"step_min": 0.5, "step_first": 0.2}, "step_min is 0.5: it must be at most step_first"),
        ({"regret_floor": "small"}, "regret_floor is 'small'"),
        ({"reward": "improvment"}, "did you mean 'improvement'"),
        ({"action_mode": "absolut"}, "did you mean 'absolute'"),
        ({"start": "center"}, "did you mean 'centre'"),
        ({"start": "pool"}, "start='pool' needs solved tasks"),
        ({"family": "yes"}, "family is 'yes'"),
        ({"render_mode": "ansi"}, "unknown render_mode 'ansi'"),
        ({"objectve": "tau_G"}, "unknown argument 'objectve'; did you mean 'objective'"),
        ({"buget": 3}, "unknown argument 'buget'; did you mean 'budget'"),
        ({"pool": "nowhere.npz"}, "'nowhere.npz' does not exist"),
    ],
)
def test_bad_arguments_are_refused_in_one_sentence(fixed_id, arguments, sentence):
    with pytest.raises(ValueError, match=sentence) as refusal:
        DesignEnv(**gym.spec(fixed_id).kwargs | arguments)
    assert "\n" not in str(refusal.value)


def test_unknown_problem_is_answered_with_the_closest_match(problem):
    with pytest.raises(ValueError, match=f"did you mean '{problem.name}'"):
        DesignEnv(f"{problem.name}x")
