"""What a designer sees, against the definition, written out point by point."""

from __future__ import annotations

import math

import gymnasium as gym
import numpy as np
import pytest

from pkm_gym.envs.observation import observe

PARTS = (
    "task",
    "best_design",
    "best_merit",
    "best_constraints",
    "zoom_constraints",
    "other_design",
    "other_merit",
    "other_constraints",
    "evaluated",
    "budget_left",
    "step_size",
)


def task_share(field, value: float) -> float:
    if not field.drawn:
        return 0.0
    if value < field.low:
        return -1.0 + 0.4 * (value - field.legal_low) / (field.low - field.legal_low)
    if value > field.high:
        return 0.6 + 0.4 * (value - field.high) / (field.legal_high - field.high)
    return -0.6 + 1.2 * (value - field.low) / (field.high - field.low)


def expected(env, task: dict, start: np.ndarray, history: list) -> list[float]:
    """The observation after a history of (design, log merit, constraints)."""
    problem, t = env.problem, len(history)
    step = max(env.rules.step_min, env.rules.step_first * env.rules.step_decay**t)
    zeros = np.zeros(len(problem.constraint_names))
    best, other = (start, 7.0, zeros), None
    for k, point in enumerate(history):
        if k == 0:
            best = point
        elif point[1] < best[1]:
            best, other = point, best
        else:
            other = point
    seen = [task_share(field, task[field.name]) for field in problem.task_variables]
    span = problem.high - problem.low
    seen += [
        2 * (x - low) / (high - low) - 1
        for x, low, high in zip(best[0], problem.low, problem.high, strict=True)
    ]
    seen += [math.tanh(best[1] / 3), *np.tanh(best[2]), *np.tanh(best[2] / (2 * step))]
    if other is None:
        seen += [0.0] * (len(start) + 1 + len(zeros))
    else:
        seen += [*np.clip((other[0] - best[0]) / span / (4 * step), -1, 1)]
        seen += [math.tanh((other[1] - best[1]) / step), *np.tanh(other[2] / (2 * step))]
    seen += [float(t >= 1), float(t >= 2), 1 - t / env.rules.budget]
    return [*seen, max(-1.0, 1 + math.log10(step) / 2)]


@pytest.mark.parametrize(
    "rules", [{}, {"budget": 5, "step_first": 0.3, "step_min": 0.1, "action_mode": "absolute"}]
)
def test_observation_is_as_defined(env_id, make, rng, rules):
    env = make(env_id, start="random", **rules)
    names = env.problem.variable_names
    for seed in range(5):
        seen, info = env.reset(seed=seed)
        task, history = info["task"], []
        start = np.array([info["best_design"][name] for name in names])
        np.testing.assert_allclose(seen, expected(env, task, start, history), atol=1e-6)
        for _ in range(env.rules.budget):
            seen, *_, info = env.step(rng.uniform(-1.0, 1.0, len(names)))
            design = np.array([info["design"][name] for name in names])
            history.append(
                (design, math.log(info["merit"]), np.array(list(info["constraints"].values())))
            )
            np.testing.assert_allclose(seen, expected(env, task, start, history), atol=2e-6)


def test_layout_covers_the_observation_in_order(env_id, make):
    env = make(env_id)
    layout = env.observation_layout
    assert tuple(layout) == PARTS
    ends = [0] + [part.stop for part in layout.values()]
    assert [part.start for part in layout.values()] == ends[:-1]
    assert env.observation_space.shape == (ends[-1],)
    assert env.observation_space.dtype == np.float32


def test_fixed_and_family_ids_share_their_spaces(family_id):
    fixed, family = gym.make(family_id.replace("Family", "")), gym.make(family_id)
    alike = fixed.unwrapped.problem.variables == family.unwrapped.problem.variables
    assert alike or family.unwrapped.problem.declared.family
    assert (fixed.observation_space == family.observation_space) == alike
    assert (fixed.action_space == family.action_space) == alike
    layouts = (env.unwrapped.observation_layout for env in (fixed, family))
    assert (next(layouts) == next(layouts)) == alike


def test_layout_follows_the_free_variables(fixed_id, make):
    whole = make(fixed_id)
    name = whole.problem.variable_names[0]
    value = float(whole.problem.printed_design()[0])
    env = make(fixed_id, fixed={name: value})
    assert env.observation_space.shape[0] == whole.observation_space.shape[0] - 2
    seen, info = env.reset()
    assert seen in env.observation_space
    assert info["best_design"][name] == value


def test_whole_legal_range_of_a_task_is_seen(family_id, make):
    env = make(family_id)
    part = env.observation_layout["task"]
    for k, field in enumerate(env.problem.task_variables):
        values = [
            field.legal_low,
            field.low,
            0.5 * (field.low + field.high),
            field.high,
            field.legal_high,
        ]
        seen = [env.reset(options={"task": {field.name: value}})[0][part][k] for value in values]
        wanted = [task_share(field, value) for value in values]
        np.testing.assert_allclose(seen, wanted, atol=1e-6)
        assert seen == sorted(seen)


def test_observing_changes_nothing_and_shares_nothing(fixed_id, make):
    env = make(fixed_id)
    env.reset()
    env.step(env.action_space.sample())
    tasks = env.session.tasks.copy()
    one, other = (observe(env.problem, tasks, env.session) for _ in range(2))
    np.testing.assert_array_equal(one, other)
    assert not np.shares_memory(one, other)
    one[:] = 5.0
    np.testing.assert_array_equal(observe(env.problem, tasks, env.session), other)
