"""MotionEnv: checkers, what ends a run, what it earns, and that no agent ever sees a NaN."""

from __future__ import annotations

import copy
import json
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.utils.env_checker import check_env
from scipy.spatial.transform import Rotation
from stable_baselines3.common.env_checker import check_env as sb3_check_env

from pkm_gym.core.problem import DesignProblem
from pkm_gym.envs import registration
from pkm_gym.envs.baselines import baseline, computed_torque, idle, run, servo
from pkm_gym.envs.motion import REASONS, MotionEnv
from pkm_gym.twin.check import random_designs

TERMS = ("reward_tracking", "reward_effort", "reward_limit")
FAR = 1e3  # m, an error limit that nothing reaches


@pytest.fixture
def motion_id(twinned: DesignProblem) -> str:
    """Each id of a motion environment."""
    return registration.motion_id(twinned.declared)


@pytest.fixture
def tracker(twinned: DesignProblem) -> Callable[..., Any]:
    """The baseline that tracks best: computed torque, where the mechanism has dynamics."""
    machine = twinned.mechanism(twinned.printed_design())
    return computed_torque if hasattr(machine, "inverse_dynamics") else servo


@pytest.fixture
def move() -> Callable[..., MotionEnv]:
    """A function that makes the bare environment of an id."""

    def made(env_id: str, **arguments: Any) -> MotionEnv:
        return gym.make(env_id, **arguments).unwrapped

    return made


def push(env, value=-1.0, steps=2000):
    """Act the same until the end; return (observation, reward, terminated, truncated, info)."""
    env.reset(seed=0)
    for _ in range(steps):
        last = env.step(np.full(env.action_space.shape, value))
        if last[2]:
            return last
    pytest.fail("the episode does not end")


def assert_sound(env, last):
    observation, reward, _, truncated, info = last
    assert observation in env.observation_space
    assert np.isfinite(observation).all()
    assert isinstance(reward, float)
    assert np.isfinite(reward)
    assert reward == pytest.approx(sum(info[name] for name in TERMS), abs=1e-12)
    assert np.isfinite([info["error"], info["loop_gap"], *info["forces"].values()]).all()
    assert truncated is False


# Checkers and specifications ----------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments", [{}, {"start": "anywhere"}, {"start_offset": 0.02}, {"frame_skip": 1}]
)
def test_both_checkers_accept_it(motion_id, move, arguments):
    env = move(motion_id, **arguments)
    check_env(env, skip_render_check=True)
    sb3_check_env(env)


def test_the_spec_is_strings_and_survives_json(twinned, motion_id):
    design = random_designs(twinned, 1, seed=12)[0]
    env = gym.make(motion_id, design=design.tolist(), force_limit=300.0, start="anywhere")
    assert isinstance(env.spec.entry_point, str)
    assert env.spec.max_episode_steps is None
    again = gym.spec(motion_id).from_json(env.spec.to_json()).make()
    assert json.loads(env.spec.to_json())["kwargs"]["force_limit"] == 300.0
    np.testing.assert_array_equal(env.reset(seed=3)[0], again.reset(seed=3)[0])


def test_make_works_without_an_import(motion_id):
    env = gym.make(f"pkm_gym:{motion_id}")
    assert isinstance(env.unwrapped, MotionEnv)


def test_pictures_come_from_the_twin_s_camera(motion_id, move, monkeypatch):
    from pkm_gym.twin import camera

    shown = []
    monkeypatch.setattr(
        camera.Camera, "shot",
        lambda self, twin: shown.append(twin) or np.zeros((self.height, self.width, 3), np.uint8),
    )  # fmt: skip
    env = move(motion_id, render_mode="rgb_array", width=320, height=240)
    env.reset(seed=0)
    assert env.render().shape == (240, 320, 3)
    assert shown == [env.rig.twin]
    env.close()


def test_the_page_states_ids_spaces_and_layout(motion_id, move):
    env = move(motion_id)
    if env.problem.declared.package.rpartition(".")[0] != "pkm_gym.mechanisms":
        pytest.skip("its page is elsewhere")
    text = (Path(__file__).parents[2] / "docs" / "environments" / "motion.md").read_text()
    assert f"`{motion_id}`" in text
    for space in (env.observation_space, env.action_space):
        assert f"`Box(-1, 1, ({space.shape[0]},), float32)`" in text
    for name, part in env.observation_layout.items():
        row = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
        assert f"{part.start}:{part.stop}" in row.split(" | ")
        assert f"    | {name} |" in MotionEnv.__doc__
    for reason in REASONS:
        assert f"| `{reason}` |" in text
        assert f'"{reason}"' in MotionEnv.__doc__


def test_render_without_a_mode_warns(motion_id, move):
    env = move(motion_id)
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="make the environment with a render_mode"):
        assert env.render() is None


# Tracking -----------------------------------------------------------------------------------------


def test_the_baseline_keeps_within_a_millimetre_at_the_printed_design_and_at_others(
    motion_id, move, tracker
):
    """Or, where a design magnifies joints more, within what that makes of the printed one's error.

    A servo's deflection grows with the force at it, which is magnified too: hence the square.
    """
    env = move(motion_id)
    printed = tracked(env, tracker, env.problem.printed_design())
    assert printed.errors.max() < 1e-3
    before = magnified(env.rig)
    for design in drivable(env, 3):
        done = tracked(env, tracker, design)
        more = magnified(env.rig) / before
        assert done.errors.max() < max(1e-3, 1.2 * more**2 * printed.errors.max())


def tracked(env, tracker, design):
    done = run(env, tracker, seed=0, options={"design": design})
    assert done.reason == "finished"
    assert len(done.errors) == env.rig.path.steps
    assert np.abs(done.shares).max() < 1.0
    assert (0.9 if done.errors.max() < 1e-3 else 0.0) < done.mean_reward < 1.0
    return done


def drivable(env, count):
    """The first random designs whose path takes less than 0.6 of the motors' force at a servo."""
    found = []
    for design in random_designs(env.problem, 16, seed=11):
        env.reset(options={"design": design})
        if env.rig.peak_force() < 0.6 * env.force_limit:
            found.append(design)
        if len(found) == count:
            return found
    pytest.fail(f"only {len(found)} of 16 designs can be driven")


def magnified(rig):
    """The most that a unit of the joints' motion becomes on the path, turns at a lever of 0.1 m."""
    jacobians = rig.levers[:, None] * rig.twin.mechanism.jacobian(rig.path.poses[::4])
    return np.linalg.norm(jacobians, ord=2, axis=(1, 2)).max()


def test_the_baseline_comes_back_from_a_start_beside_the_path(motion_id, move, tracker):
    env = move(motion_id, start_offset=0.02)
    done = run(env, tracker, seed=1)
    assert done.reason == "finished"
    assert done.errors[0] > 1e-4
    assert done.errors[-50:].max() < 1e-3


def test_a_faster_path_takes_less_time_and_more_force(motion_id, move):
    slow, fast = (
        move(motion_id, speed=gym.spec(motion_id).kwargs.get("speed", 1.0) * k) for k in (0.5, 1)
    )
    assert slow.rig.path.steps == pytest.approx(2 * fast.rig.path.steps, abs=1)
    assert slow.force_limit < fast.force_limit


def test_the_diamond_follows_the_task_s_own_cycle(move):
    env = move("PKM/DiamondMotion-v0", task={"cycle_width_ratio": 0.5, "cycle_time_ratio": 2.0})
    assert env.rig.path.steps == 600
    across = env.rig.path.positions[[0, -1], 0]
    np.testing.assert_allclose(across, [-0.2, 0.2], atol=1e-12)
    assert run(env, computed_torque, seed=0).errors.max() < 1e-3


def test_computed_torque_needs_dynamics(move):
    env = move("PKM/SPR3Motion-v0")
    env.reset(seed=0)
    with pytest.raises(ValueError, match="Spr3 has no dynamics"):
        computed_torque(env)


def test_an_unknown_baseline_is_refused_with_its_closest_match():
    with pytest.raises(ValueError, match="unknown baseline 'servos'; did you mean 'servo'"):
        baseline("servos")


# What ends a run ----------------------------------------------------------------------------------


def test_motors_that_are_off_leave_the_path(motion_id, move):
    env = move(motion_id)
    last = push(env, 0.0)
    assert last[4]["reason"] == "off the path"
    assert last[4]["error"] > 0.05
    assert_sound(env, last)


def test_steady_force_takes_the_machine_out_of_its_assembly_mode(motion_id, move):
    env = move(motion_id, error_limit=FAR)
    last = push(env)
    assert last[4]["reason"] == "assembly mode"
    assert last[4]["loop_gap"] < 1e-3
    assert_sound(env, last)


def test_too_much_force_opens_the_loops(motion_id, move):
    env = move(motion_id, error_limit=FAR, force_limit=1e5)
    last = push(env)
    assert last[4]["reason"] == "loop open"
    assert last[4]["loop_gap"] > 1e-3
    assert_sound(env, last)


def test_a_simulation_that_breaks_down_leaves_neither_nan_nor_a_file(
    motion_id, move, tmp_path, monkeypatch, capfd
):
    monkeypatch.chdir(tmp_path)
    env = move(motion_id, error_limit=FAR, force_limit=1e9)
    first, _ = env.reset(seed=0)
    last = env.step(-np.ones(env.action_space.shape))
    assert last[4]["reason"] == "unstable"
    assert last[4]["reward_tracking"] == 0.0
    assert_sound(env, last)
    assert list(Path.cwd().iterdir()) == []
    assert "WARNING" not in "".join(capfd.readouterr())
    again, _ = env.reset(seed=0)
    np.testing.assert_array_equal(first, again)


def test_the_end_of_the_path_ends_the_run_and_only_the_end_has_a_reason(motion_id, move, tracker):
    env = move(motion_id)
    _, first = env.reset(seed=0)
    assert not any(first["forces"].values())
    ended, steps = False, 0
    while not ended:
        *_, ended, _, info = env.step(tracker(env))
        steps += 1
        assert bool(info["reason"]) == ended
        assert {k: type(v) for k, v in info.items()} == {k: type(v) for k, v in first.items()}
        assert first["task"] == info["task"]
        info["task"].clear()
    assert info["reason"] == "finished"
    assert steps == env.rig.path.steps
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(env.action_space.shape))


@pytest.mark.parametrize("limit", [None, 1e4, 1e7])
def test_wild_steps_with_extreme_designs_stay_finite(motion_id, move, limit):
    env = move(motion_id, error_limit=FAR, force_limit=limit, start="anywhere", start_offset=0.1)
    rng = np.random.default_rng(7)
    problem, steps, refusals = env.problem, 0, []
    while steps < 300:
        corner = np.where(rng.random(len(problem.low)) < 0.5, problem.low, problem.high)
        design = corner if rng.random() < 0.5 else rng.uniform(problem.low, problem.high)
        try:
            observation, _ = env.reset(options={"design": design})
        except ValueError as error:
            refusals.append(str(error))
            continue
        assert observation in env.observation_space
        for _ in range(60):
            last = env.step(rng.uniform(-3.0, 3.0, env.action_space.shape))
            assert_sound(env, last)
            steps += 1
            if last[2]:
                assert last[4]["reason"] in REASONS
                break
    assert all("can't be driven" in sentence for sentence in refusals)


# What it earns, and what is seen ------------------------------------------------------------------


def test_the_terms_of_the_reward_are_what_the_page_says(motion_id, move):
    env = move(motion_id, effort_weight=0.3, limit_weight=0.7)
    env.reset(seed=0)
    action = np.linspace(0.5, 0.98, env.action_space.shape[0])
    _, reward, _, _, info = env.step(action)
    error = info["error"]
    assert info["reward_tracking"] == pytest.approx(1 - np.log(1 + error / 1e-3) / np.log(51))
    assert info["reward_effort"] == pytest.approx(-0.3 * np.mean(action**2))
    beyond = np.maximum(0, (action - 0.9) / 0.1)
    assert beyond.max() > 0.5
    assert info["reward_limit"] == pytest.approx(-0.7 * beyond.mean())
    assert reward == pytest.approx(sum(info[name] for name in TERMS))
    assert list(info["forces"].values()) == pytest.approx(env.force_limit * action)


def test_the_limit_is_three_times_what_the_printed_design_needs(motion_id, move, tracker):
    env = move(motion_id)
    done = run(env, tracker, seed=0)
    assert np.abs(done.shares).max() == pytest.approx(1 / 3, rel=0.05)
    other = random_designs(env.problem, 1, seed=2)[0]
    _, info = env.reset(options={"design": other})
    assert info["force_limit"] == env.force_limit == move(motion_id).force_limit


def test_the_layout_covers_the_observation_and_shows_what_it_says(motion_id, move, tracker):
    env = move(motion_id)
    observation, _ = env.reset(seed=0)
    parts = list(env.observation_layout.values())
    assert [part.start for part in parts] == [0, *(part.stop for part in parts[:-1])]
    assert parts[-1].stop == len(observation)
    seen = {name: observation[part] for name, part in env.observation_layout.items()}
    for name in ("rates", "velocity", "error", "error_rate"):
        np.testing.assert_allclose(seen[name], 0.0, atol=1e-3)
    assert seen["time_left"] == 1.0
    assert np.abs(seen["joints"]).max() <= 0.5
    for _ in range(100):
        observation, *_ = env.step(tracker(env))
    seen = {name: observation[part] for name, part in env.observation_layout.items()}
    assert seen["time_left"] == pytest.approx(1.0 - 100 / env.rig.path.steps)
    path, state, turning = env.rig.path, env.rig.state, env.rig.twin.mechanism.turning
    levers = np.where(np.arange(path.velocities.shape[1]) < turning, 0.1, 1.0)
    now, then = ((path.axes[k], path.positions[k]) for k in (200, 232))
    fastest = np.linalg.norm(levers * path.velocities, axis=1).max()
    np.testing.assert_allclose(
        seen["path"][-len(levers) :],
        way(turning, now, then) / (16 * env.rig.dt * fastest),
        atol=1e-6,
    )
    off = way(turning, (state.axes, state.position), now)
    np.testing.assert_allclose(np.arctanh(seen["error"]) * 5e-3, off, atol=1e-7)
    assert env.error == pytest.approx(np.linalg.norm(off), rel=1e-9)


def way(turning, one, other):
    """The way from axes and a position to others, turns at a lever of 0.1 m before it."""
    turn = Rotation.from_matrix(other[0] @ one[0].T).as_rotvec()[:turning]
    return np.concatenate([0.1 * turn, other[1] - one[1]])


def test_design_and_task_are_in_the_observation(motion_id, move):
    env = move(motion_id)
    name, field = env.problem.variable_names[0], env.problem.task_variables[0]
    part = env.observation_layout["design"].start
    values = {}
    for value in (env.problem.low[0], env.problem.printed_design()[0]):
        named = env.problem.named(env.problem.printed_design()) | {name: float(value)}
        try:
            values[value] = env.reset(options={"design": named})[0][part]
        except ValueError:
            continue
    for value, seen in values.items():
        low, high = env.problem.low[0], env.problem.high[0]
        assert seen == pytest.approx(2 * (value - low) / (high - low) - 1, abs=1e-6)
    assert field.name in env.reset()[1]["task"]


# Designs and seeds --------------------------------------------------------------------------------


def test_a_reset_s_design_holds_for_its_episode(motion_id, move):
    env = move(motion_id)
    printed = env.problem.printed_design()
    other = random_designs(env.problem, 1, seed=4)[0]
    machine = env.rig.twin.mechanism
    _, info = env.reset(seed=0, options={"design": other})
    assert info["design"] == env.problem.named(other)
    assert env.rig.twin.mechanism == env.problem.mechanism(other) != machine
    _, info = env.reset(seed=0)
    assert info["design"] == env.problem.named(printed)
    assert env.rig.twin.mechanism == machine
    known = env.rig
    env.reset(seed=1)
    assert env.rig is known


def test_the_design_of_make_is_driven(motion_id, move):
    other = random_designs(move(motion_id).problem, 1, seed=5)[0]
    env = move(motion_id, design=other)
    named = move(motion_id, design=env.problem.named(other))
    one, info = env.reset(seed=0)
    assert info["design"] == env.problem.named(other)
    np.testing.assert_array_equal(one, named.reset(seed=0)[0])


def test_equal_seeds_give_equal_runs_whatever_was_driven_before(motion_id, move):
    arguments = {"start": "anywhere", "start_offset": 0.05}
    one, other = (move(motion_id, **arguments) for _ in range(2))
    other.reset(seed=9, options={"design": random_designs(one.problem, 1, seed=6)[0]})
    other.step(np.full(other.action_space.shape, 0.4))
    runs = []
    for env in (one, other):
        rng = np.random.default_rng(0)
        seen = [env.reset(seed=5)[0]]
        seen += [env.step(rng.uniform(-0.3, 0.3, env.action_space.shape))[0] for _ in range(10)]
        runs.append(np.array(seen))
    np.testing.assert_array_equal(*runs)


def test_a_run_goes_on_from_what_was_saved(motion_id, move, tracker):
    env = move(motion_id)
    env.reset(seed=0)
    for _ in range(20):
        env.step(tracker(env))
    saved = env.save()
    ahead = [env.step(tracker(env)) for _ in range(10)]
    other = move(motion_id)
    other.reset(seed=3)
    other.load(saved)
    for observation, reward, *_, info in ahead:
        again = other.step(tracker(other))
        np.testing.assert_array_equal(again[0], observation)
        assert (again[1], again[4]) == (reward, info)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_with_the_episode_and_the_next(motion_id, copied):
    env = gym.make(motion_id, start="anywhere", start_offset=0.02)
    env.reset(seed=8)
    assert not env.step(np.zeros(env.action_space.shape))[2]
    other = copied(env)
    actions = np.random.default_rng(3).uniform(-0.1, 0.1, (5, *env.action_space.shape))
    runs = []
    for each in (env, other):
        steps = [each.step(action) for action in actions]
        runs.append([*steps, each.reset(), each.step(actions[0])])
    for one, two in zip(*runs, strict=True):
        np.testing.assert_array_equal(one[0], two[0])
        assert one[1:] == two[1:]


# Bad input ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"speed": 0.0}, "speed is 0.0: it must be greater than 0"),
        ({"frame_skip": 2.5}, "frame_skip is 2.5: it must be a whole number"),
        ({"force_limit": -1.0}, "force_limit is -1.0: it must be greater than 0"),
        ({"error_limit": float("nan")}, "error_limit is nan: it must be greater than 0"),
        ({"effort_weight": -0.1}, "effort_weight is -0.1: it must be at least 0"),
        ({"start_offset": 0.2}, "start_offset is 0.2: it must be at least 0 and at most 0.1"),
        ({"start": "anywere"}, "unknown start 'anywere'; did you mean 'anywhere'"),
        ({"render_mode": "rgb"}, "unknown render_mode 'rgb'; did you mean 'rgb_array'"),
        ({"width": 0}, "width is 0: it must be a whole number of at least 1"),
        ({"design": [1.0]}, "option design must be numbers of shape"),
        ({"budget": 3}, "unknown argument 'budget'"),
        ({"frame_skips": 3}, "unknown argument 'frame_skips'; did you mean 'frame_skip'"),
        ({"bound": {}}, "unknown argument 'bound'; did you mean 'bounds'"),
    ],
)
def test_bad_arguments_are_refused_in_one_sentence(motion_id, arguments, sentence):
    with pytest.raises(ValueError, match=sentence):
        MotionEnv(**{**gym.spec(motion_id).kwargs, **arguments})


def test_bad_actions_change_nothing(motion_id, move):
    env = move(motion_id)
    env.reset(seed=0)
    before = env.save()
    for bad in (
        np.full(env.action_space.shape, np.nan),
        np.zeros(env.action_space.shape[0] + 1),
        "up",
    ):
        with pytest.raises(ValueError, match="action must be"):
            env.step(bad)
    np.testing.assert_array_equal(env.save(), before)


def test_a_step_before_the_first_reset_is_refused(motion_id, move):
    with pytest.raises(ResetNeeded):
        move(motion_id).step(np.zeros(move(motion_id).action_space.shape))


def test_bad_options_are_refused_and_the_machine_stays(motion_id, move):
    env = move(motion_id)
    env.reset(seed=0)
    known = env.rig
    name = env.problem.variable_names[0]
    for options, sentence in (
        ({"desing": {}}, "unknown reset option 'desing'; did you mean 'design'"),
        ({"design": {name: float(env.problem.low[0])}}, "the design lacks"),
        ({"design": env.problem.high * 2.0}, f"option design: {name} is"),
        ({"task": {"no_field": 1.0}}, "unknown"),
    ):
        with pytest.raises(ValueError, match=sentence):
            env.reset(options=options)
    assert env.rig is known


@pytest.mark.parametrize(
    ("env_id", "design", "sentence"),
    [
        (
            "PKM/DiamondMotion-v0",
            {"lam_e": 0.75, "lam_l": 1.2, "gap": 0.7},
            r"the design lam_e = 0.75, lam_l = 1.2, gap = 0.7 can't be driven: its path leaves",
        ),
        (
            "PKM/SPR3Motion-v0",
            {"r1": 0.15, "r3": 1.1},
            r"the design r1 = 0.15, r3 = 1.1 can't be driven: no cylinder fits",
        ),
    ],
)
def test_a_design_that_can_t_follow_its_path_is_refused(move, env_id, design, sentence):
    with pytest.raises(ValueError, match=sentence):
        move(env_id, design=design)


def test_a_task_that_the_printed_design_can_t_run_asks_for_a_limit(move):
    arguments = {"task": {"delta": 1.2}, "design": [0.57, 2.92, 0.2]}
    with pytest.raises(
        ValueError, match="give force_limit: it follows from the printed design, but"
    ):
        move("PKM/DiamondMotion-v0", **arguments)
    env = move("PKM/DiamondMotion-v0", **arguments, force_limit=100.0)
    assert env.reset(seed=0)[1]["force_limit"] == 100.0


def test_idle_is_the_zero_action(motion_id, move):
    env = move(motion_id)
    assert not idle(env).any()
