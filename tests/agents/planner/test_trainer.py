"""Training a model: its folder, its resumption to the bit, what it makes of its course."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch

from pkm_gym.agents.designers.files import read_designer
from pkm_gym.agents.planner.nearby import Nearby
from pkm_gym.agents.planner.planner import Planner
from pkm_gym.agents.planner.trainer import SurrogateTrainer
from pkm_gym.agents.runs.course import design_course
from pkm_gym.agents.runs.recipe import read_recipe
from pkm_gym.agents.runs.run import BEST, CHECKPOINT, SCORES, Run
from pkm_gym.agents.runs.trainer import Stopped
from pkm_gym.benchmark.interpolation import task_points
from pkm_gym.benchmark.splits import load_split

FAMILY = "PKM/DiamondFamily-v0"
SMALL = ["algorithm.updates=60", "algorithm.batch_size=64", "algorithm.width=8"]


@pytest.fixture(scope="module")
def pools(tmp_path_factory):
    """Files of 120 tasks to train on and of four to be scored on."""
    folder = tmp_path_factory.mktemp("pools")
    _, val = load_split("diamond", "val")
    files = folder / "pool.npz", folder / "validation.npz"
    for file, n in zip(files, (120, 4), strict=True):
        val.first(n).save(file)
    return files


@pytest.fixture
def prepared(pools, tmp_path):
    def made(*settings, folder="a", env_id=FAMILY, steps=2000, seed=3):
        recipe = read_recipe("model", env_id, settings=[*SMALL, *settings], steps=steps)
        run = Run(env_id, "model", seed, recipe, *pools, tmp_path / folder, "a test")
        run.write()
        course = design_course(env_id, recipe, run.folder, pool=pools[0], validation=pools[1])
        return run, course

    return made


def kept(course):
    """Return the solvable tasks of its pool."""
    return course.pool.tasks[course.pool.solvable]


def test_training_writes_its_folder(prepared):
    run, course = prepared("checkpoints=2")
    best = SurrogateTrainer(run, course).train()
    scores = [json.loads(line) for line in (run.folder / SCORES).read_text().splitlines()]
    assert [line["steps"] for line in scores] == [1000, 2000]
    assert max(line["score"] for line in scores) == best
    designer, origin = read_designer(run.folder / BEST)
    assert isinstance(designer.policy, Planner)
    assert origin.score == best
    assert origin.pool == len(course.pool)
    assert designer.rules.budget == 12


def test_with_tasks_drawn_it_learns_around_optima_nearby_and_begins_there(prepared):
    run, course = prepared("algorithm.tasks=200", "algorithm.farthest=0.2", "starts=centre")
    trainer = SurrogateTrainer(run, course)
    samples = trainer.begin().samples
    assert samples.places.shape == (200, 10, 3)
    optima = Nearby.of_pool(course.problem, course.pool).of(samples.points)
    apart = np.linalg.norm(samples.places[:, None] - optima[:, :, None], axis=3).min(axis=1)
    assert (apart <= samples.distances + 1e-12).all()  # clipped to the box they are nearer
    assert 0.1 < samples.distances.max() <= 0.2
    trainer.train()
    designer, _ = read_designer(run.folder / BEST)
    np.testing.assert_array_equal(
        designer.policy.nearby.points, task_points(course.problem, kept(course))
    )


@pytest.mark.parametrize("updates", [100, 200])
def test_a_resumed_run_is_equal_to_the_bit(prepared, updates):
    longer = "algorithm.updates=250"
    whole, course = prepared(longer)
    SurrogateTrainer(whole, course).train()
    parts, course = prepared(longer, folder="b")
    stop = iter([False] * (updates // 100 - 1))
    with pytest.raises(Stopped):
        SurrogateTrainer(parts, course, stop=lambda: next(stop, True)).train()
    torch.manual_seed(99)
    SurrogateTrainer(parts, course).train(resume=True)
    one, other = (torch.load(r.folder / CHECKPOINT, weights_only=True) for r in (whole, parts))
    for name, weights in one["net"].items():
        assert torch.equal(weights, other["net"][name])
    assert one["best"] == other["best"]


def test_seeds_differ(prepared):
    trainings = []
    for seed in (0, 1):
        run, course = prepared(folder=f"seed-{seed}", seed=seed)
        trainings.append(SurrogateTrainer(run, course).begin())
    one, other = (training.surrogate() for training in trainings)
    assert not np.allclose(one.straight, other.straight)
    assert not np.allclose(trainings[0].samples.places, trainings[1].samples.places)


def test_without_solved_tasks_it_is_refused(tmp_path):
    recipe = read_recipe("model", "PKM/Diamond-v0", settings=["starts=centre"])
    run = Run("PKM/Diamond-v0", "model", 0, recipe, None, None, tmp_path, "a test")
    course = design_course(run.env_id, recipe, tmp_path, pool=None, validation=None)
    with pytest.raises(ValueError, match="a model is trained on solved tasks: give --pool"):
        SurrogateTrainer(run, course).train()


def test_too_few_steps_are_refused(prepared):
    run, course = prepared(steps=100)
    with pytest.raises(ValueError, match="steps is 100: 120 solved tasks need at least 240"):
        SurrogateTrainer(run, course).train()


def test_a_checkpoint_of_another_recipe_is_refused(prepared):
    run, course = prepared()
    SurrogateTrainer(run, course).train()
    other, course = prepared("algorithm.width=12", folder="b")
    (run.folder / CHECKPOINT).rename(other.folder / CHECKPOINT)
    with pytest.raises(ValueError, match="belongs to another recipe"):
        SurrogateTrainer(other, course).train(resume=True)
