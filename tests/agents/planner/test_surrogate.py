"""Surrogates: slopes against differences, PyTorch's networks against NumPy's, what is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from pkm_gym.agents.planner.samples import draw
from pkm_gym.agents.planner.settings import Settings
from pkm_gym.agents.planner.surrogate import Surrogate, outputs
from pkm_gym.agents.planner.training import SurrogateTraining
from pkm_gym.benchmark.splits import load_split
from pkm_gym.core.merit import CAP

RNG = np.random.default_rng(2)


def test_slopes_are_those_of_the_values(surrogate):
    point, places = RNG.uniform(-0.6, 0.6, 7), RNG.random((5, 3))
    slopes = surrogate.pieces(point, places).slopes
    for i, step in enumerate(1e-6 * np.eye(3)):
        above, below = (surrogate.pieces(point, places + s).values for s in (step, -step))
        expected = (above[:, 1:] - below[:, 1:]) / 2e-6
        np.testing.assert_allclose(slopes[:, 1:, :, i], expected, atol=1e-8)


def test_the_merit_has_one_piece(surrogate):
    values = surrogate.pieces(np.zeros(7), np.zeros((1, 3))).values
    assert np.isfinite(values[0, 0, 0])
    assert (values[0, 0, 1:] == -np.inf).all()


def test_errors_are_larger_beyond_the_range(surrogate):
    inside, edge, beyond = np.full(7, 0.3), np.full(7, -0.6), np.r_[0.7, np.zeros(6)]
    for point in (inside, edge):
        np.testing.assert_array_equal(surrogate.errors_at(point), surrogate.errors)
    assert (surrogate.errors_at(beyond) > 2.0 * surrogate.errors).all()


def test_tensors_give_the_same_surrogate(surrogate):
    again = Surrogate.of_tensors(surrogate.problem, surrogate.tensors())
    one, other = (s.pieces(np.zeros(7), np.full((1, 3), 0.4)).values for s in (surrogate, again))
    np.testing.assert_allclose(one, other, rtol=1e-5)
    assert again.names == ("merit", "sigma_max", "sigma_min", "alpha")


def test_what_is_told_is_the_value_without_the_penalty(surrogate):
    problem = surrogate.problem
    designs = problem.low + (problem.high - problem.low) * RNG.random((200, 3))
    evaluation = problem.evaluate(designs)
    whole = outputs(problem, evaluation.log_merit, evaluation.constraints)
    told = surrogate.told(evaluation.log_merit, evaluation.constraints)
    np.testing.assert_array_equal(told, whole[:, [0, 5, 6, 8]])
    capped = evaluation.log_merit >= CAP
    assert 0 < capped.sum() < 200
    assert np.isnan(told[capped]).all()
    values = evaluation.objectives[~capped, 0]
    scale = values / np.exp(told[~capped, 0])
    np.testing.assert_allclose(scale, scale[0], rtol=1e-9)


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("updates", 0, "updates is 0: it must be a whole number from 1 on"),
        ("splits", -1, "splits is -1: it must be a whole number from 0 on"),
        ("width", "abc", "width is 'abc': it must be a whole number from 1 on"),
        ("learning_rate", 0.1, "learning_rate is 0.1: it must be two numbers"),
        ("learning_rate", [1e-5, 1e-3], "learning_rate is .*: it must be two numbers"),
        ("slopes", -1.0, "slopes is -1.0: it must be a number from 0 on"),
        ("tasks", -1, "tasks is -1: it must be a whole number from 0 on"),
        ("farthest", 1e-3, "farthest is 0.001: it must be a number above 0.001, to 1"),
        ("farthest", "far", "farthest is 'far': it must be a number"),
    ],
)
def test_an_illegal_setting_is_refused(name, value, sentence):
    with pytest.raises(ValueError, match=sentence):
        Settings(**{name: value})


@pytest.fixture(scope="module")
def training() -> SurrogateTraining:
    problem, pool = load_split("diamond", "val")
    first, settings = pool.first(40), Settings(updates=200, batch_size=64, width=8, pieces=3)
    steps = 32 * int(first.solvable.sum())
    samples = draw(problem, first, settings, steps, np.random.default_rng(0))
    return SurrogateTraining(problem, samples, settings, seed=0)


def test_samples_show_what_depends_on_what(training):
    fields = [v.name for v in training.problem.task_variables if v.drawn]
    names = ["merit", *(training.problem.constraint_names[j] for j in training.samples.columns)]
    depends = {
        name: {field for field, yes in zip(fields, row, strict=True) if yes}
        for name, row in zip(names, training.samples.depends, strict=True)
    }
    assert depends["merit"] == {"b", "h_ratio", "payload"}
    assert depends["sigma_max"] == {"h_ratio", "sigma_high"}


def test_the_trained_networks_are_the_surrogates(training):
    training.update()
    surrogate, samples = training.surrogate(), training.samples
    with torch.no_grad():
        inputs = np.c_[np.tile(samples.points[3], (32, 1)), samples.places[3]]
        scaled = (inputs - surrogate.middle) / surrogate.spread
        made = training._net(torch.as_tensor(scaled, dtype=torch.float32)).numpy()
    values = surrogate.pieces(samples.points[3], samples.places[3]).values.max(axis=2)
    np.testing.assert_allclose(values, made * surrogate.scale + surrogate.mean, atol=1e-5)


def test_training_lowers_the_errors(training):
    before = training.surrogate().errors
    while training.done < training.settings.updates:
        training.update()
    assert (training.surrogate().errors < 0.8 * before).mean() > 0.5


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_a_piece_does_not_speak_alone_where_there_is_a_kink(training, seed):
    """Without splitting, seed 3 leaves it at one piece."""
    aside = training.samples.places - training.samples.places.mean(axis=(0, 1))
    kinked = aside @ [1.0, -2.0, 0.5] + 0.2 * np.abs(aside @ [2.0, 1.0, 0.0])
    samples = replace(
        training.samples,
        columns=training.samples.columns[:1],
        told=np.stack([training.samples.told[..., 0], kinked], axis=2),
        depends=training.samples.depends[:2],
    )
    settings = Settings(updates=400, batch_size=256, width=8, pieces=3, learning_rate=(1e-2, 1e-4))
    own = SurrogateTraining(training.problem, samples, settings, seed)
    while own.done < settings.updates:
        own.update()
    surrogate = own.surrogate()
    loudest = np.concatenate([
        surrogate.pieces(point, places).values[:, 1].argmax(axis=1)
        for point, places in zip(samples.points, samples.places, strict=True)
    ])  # fmt: skip
    second = np.sort(np.bincount(loudest, minlength=3))[-2]
    assert second > 0.2 * len(loudest)
