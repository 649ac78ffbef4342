"""Designers: what they evaluate is what the environment would, and their files can't be faked."""

from __future__ import annotations

import json

import gymnasium as gym
import numpy as np
import pytest

import pkm_gym.agents
from pkm_gym.agents.designers.files import read_designer, write_designer
from pkm_gym.agents.designers.library import load_designer, shipped
from pkm_gym.agents.designers.shipping import AT, recorded
from pkm_gym.agents.runs.files import Origin
from pkm_gym.agents.sb3.models import load_model
from pkm_gym.agents.sb3.trainer import make_model
from pkm_gym.benchmark.interpolation import Interpolation
from pkm_gym.benchmark.scoring import FLOOR
from pkm_gym.core.pool import Pool
from pkm_gym.core.solve import solve_tasks

ORIGIN = Origin("PKM/DiamondFamily-v0", "a test", 0, 0.0, {})
ROUNDING = 1e-7  # a smaller median regret depends on it


@pytest.fixture
def written(designer, tmp_path):
    """The file of a designer."""
    path = tmp_path / "mine.json"
    write_designer(designer, path, ORIGIN, {})
    return path


@pytest.fixture(scope="module")
def pool() -> Pool:
    problem = pkm_gym.make_problem("diamond")
    tasks = problem.draw_tasks(60, np.random.default_rng(8))
    solved = solve_tasks(problem, tasks)
    return Pool.from_solutions(solved, solved.designs, problem, "a test")


def played(designer, task) -> tuple[np.ndarray, np.ndarray, dict]:
    """The designs and merits of an episode in the environment, and its last info."""
    env = gym.make("PKM/DiamondFamily-v0", budget=designer.rules.budget)
    observation, _ = env.reset(options={"task": task})
    designs, merits, ended = [], [], False
    while not ended:
        action = designer.policy(observation[None])[0]
        observation, _, ended, _, info = env.step(action)
        designs.append(list(info["design"].values()))
        merits.append(info["merit"])
    return np.array(designs), np.array(merits), info


def test_a_session_is_an_episode_of_the_environment(random_network):
    designer = random_network()
    tasks = designer.problem.draw_tasks(4, np.random.default_rng(0))
    session = designer.design(tasks)
    assert session.designs.shape == (4, 12, 3)
    for i, task in enumerate(tasks):
        designs, merits, info = played(designer, task)
        np.testing.assert_allclose(session.designs[i], designs, atol=1e-6)
        np.testing.assert_allclose(session.merit[i], merits, rtol=1e-5)
        assert session.answer.feasible[i] == info["answer"]["feasible"]
        answered = list(info["answer"]["design"].values())
        np.testing.assert_allclose(session.answer.designs[i], answered, atol=1e-6)


def test_a_plan_is_an_episode_of_the_environment_that_jumps(random_planner):
    problem = random_planner.problem
    env = gym.make("PKM/Diamond-v0", action_mode="absolute")
    env.reset()
    session = random_planner.design({})
    for design, merit in zip(session.designs[0], session.merit[0], strict=True):
        place = (design - problem.low) / (problem.high - problem.low)
        info = env.step((2.0 * place - 1.0).astype(np.float32))[-1]
        np.testing.assert_allclose(list(info["design"].values()), design, atol=1e-6)
        assert info["merit"] == pytest.approx(merit, rel=1e-5)


def test_a_short_budget_is_the_beginning_of_a_long_one(designer):
    whole, part = designer.design({"b": 1.0}), designer.design({"b": 1.0}, budget=5)
    np.testing.assert_array_equal(part.designs, whole.designs[:, :5])


@pytest.mark.parametrize("budget", [0, 13, 2.5])
def test_a_budget_that_it_was_not_trained_for_is_refused(designer, budget):
    with pytest.raises(ValueError, match=r"trained for 12 evaluations"):
        designer.design({}, budget=budget)


def test_regrets_count_feasible_designs_only(random_network):
    designer = random_network()
    session = designer.design(designer.problem.draw_tasks(20, np.random.default_rng(1)))
    regrets = session.regrets(np.zeros(20))
    for i in range(20):
        for k in range(12):
            found = np.log(session.merit[i, : k + 1][session.feasible[i, : k + 1]])
            assert regrets[i, k] == min(found, default=np.inf)


def test_a_file_gives_the_same_designer(designer, written):
    again, origin = read_designer(written)
    assert origin == ORIGIN
    np.testing.assert_array_equal(again.design({}).designs, designer.design({}).designs)


def test_a_file_keeps_the_interpolated_starts(random_network, pool, tmp_path):
    designer = random_network()
    starts = Interpolation(designer.problem, pool)
    made = type(designer)(designer.problem, designer.rules, designer.policy, starts)
    write_designer(made, tmp_path / "a.json", ORIGIN, {})
    again, _ = read_designer(tmp_path / "a.json")
    np.testing.assert_array_equal(again.design(pool.tasks).designs, made.design(pool.tasks).designs)


def test_interpolation_goes_through_the_optima(pool):
    problem = pkm_gym.make_problem("diamond")
    interpolation = Interpolation(problem, pool)
    span = problem.high - problem.low
    designs = np.array([part.designs(part.designs.points) for part in interpolation.parts[:1]])
    known = (pool.designs[pool.solvable] - problem.low) / span
    nearest = np.abs(designs[0][:, None] - known).max(axis=2).min(axis=1)
    assert nearest.max() < 1e-9
    found = interpolation.designs(pool.tasks)
    assert ((found >= problem.low) & (found <= problem.high)).all()


@pytest.mark.parametrize("damage", ["cut", "edit"])
def test_damaged_weights_are_refused(written, damage):
    weights = written.with_suffix(".safetensors")
    content = bytearray(weights.read_bytes())
    if damage == "cut":
        content = content[:-100]
    else:
        content[-1] ^= 1
    weights.write_bytes(content)
    with pytest.raises(ValueError, match="is damaged or was edited"):
        read_designer(written)


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("hash", "0" * 64, "another version of diamond"),
        ("layout", "0" * 64, "another observation layout"),
        ("format", 99, "has format 99"),
    ],
)
def test_a_designer_of_another_version_is_refused_by_name(written, key, value, sentence):
    config = json.loads(written.read_text())
    written.write_text(json.dumps(config | {key: value}))
    with pytest.raises(ValueError, match=sentence):
        read_designer(written)


def test_a_config_that_is_none_is_refused(written):
    written.write_text('{"format": 1')
    with pytest.raises(ValueError, match="no JSON file"):
        read_designer(written)
    written.write_text("[]")
    with pytest.raises(ValueError, match=r"is no designer: it is .*a table"):
        read_designer(written)


def test_an_unknown_designer_is_refused():
    with pytest.raises(ValueError, match="unknown designer 'DaimondFamily'"):
        load_designer("DaimondFamily")


def test_an_sb3_model_is_not_unpickled_without_trust(tmp_path):
    with pytest.raises(ValueError, match=r"unpickles.*--trust"):
        load_model(str(tmp_path / "a.zip"), trust=False, env_id=None)


def test_an_sb3_model_that_is_trusted_acts_as_itself(small, tmp_path):
    run, course = small("ppo", "environment.free=['lam_e','lam_l','gap']")
    model = make_model(run, course)
    path = str(tmp_path / "a.zip")
    model.num_timesteps = 96
    model.save(path)
    designer, steps = load_model(path, trust=True, env_id="PKM/Diamond-v0")
    assert steps == 96
    observations = model.env.reset()
    expected, _ = model.predict(observations, deterministic=True)
    np.testing.assert_allclose(designer.policy(observations), expected, atol=1e-6)
    with pytest.raises(ValueError, match="environment of other observations"):
        load_model(path, trust=True, env_id="PKM/SPR3-v0")
    with pytest.raises(ValueError, match="give --env"):
        load_model(path, trust=True, env_id=None)
    with pytest.raises(ValueError, match="is no model of sac, or a damaged one"):
        load_model(path, trust=True, env_id="PKM/Diamond-v0", algorithm="sac")


@pytest.mark.parametrize("name", shipped())
def test_shipped_designers_begin_as_they_recorded(name):
    designer, origin = read_designer(shipped()[name])
    known = origin.recorded
    designs = designer.design(np.array(known["tasks"]), budget=1).designs[:, 0]
    span = designer.problem.high - designer.problem.low
    np.testing.assert_allclose((designs - known["designs"]) / span, 0.0, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_shipped_designers_reproduce_the_regrets_that_they_recorded(name):
    """Rounding differs between machines, and each design is planned on what was measured before.

    What that makes of a median after many designs: the gait's after 24 is 0.118 % of one machine
    and 0.091 % of another, with the same code; those after 4, 8 and 12 agree to 2e-6. The Diamond's
    after 8 is 1.7e-8 with one thread of the linear algebra, 1.4e-8 with two.
    """
    designer, origin = read_designer(shipped()[name])
    known, now = origin.recorded["regrets"], recorded(designer)["regrets"]
    for k in AT[: len(known)]:
        before, after = (max(FLOOR, regrets[str(k)]) for regrets in (known, now))
        near = k <= 12 and before > ROUNDING
        assert after == pytest.approx(before, rel=0.1 if near else 0.4)


@pytest.mark.parametrize("name", shipped())
def test_shipped_designers_are_small(name):
    path = shipped()[name]
    assert sum(path.with_suffix(s).stat().st_size for s in (".json", ".safetensors")) <= 2**20


def test_public_names_are_there():
    assert pkm_gym.agents.load_designer is load_designer
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = pkm_gym.agents.nothing
