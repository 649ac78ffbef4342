"""Pictures of a session, with and without a window."""

from __future__ import annotations

import gymnasium as gym
import matplotlib
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.backend_bases import CloseEvent

from pkm_gym import plots
from pkm_gym.envs import rendering


def test_rgb_array_is_the_picture_of_the_design_evaluated_last(env_id, make):
    env = make(env_id, render_mode="rgb_array")
    env.reset(seed=0)
    frames = [env.render()]
    for _ in range(2):
        *_, info = env.step(0.3 * env.action_space.sample())
        frames.append(env.render())
    for frame in frames:
        assert frame.dtype == np.uint8
        assert frame.ndim == 3
        assert frame.shape[2] == 3
        assert min(frame.shape[:2]) >= 300
        assert 50 < frame.mean() < 254
    assert not np.array_equal(frames[1], frames[2])
    design = env.problem.design(info["design"])
    figure = plots.design_figure(env.problem, design, env.problem.unpack(env.session.tasks[0]))
    np.testing.assert_array_equal(frames[2], plots.figure_to_array(figure))


def test_every_design_can_be_drawn(family_id, make):
    env = make(family_id, render_mode="rgb_array")
    env.reset(seed=0)
    for corner in (-1.0, 1.0):
        env.step(np.full(env.action_space.shape, corner))
        assert env.render().dtype == np.uint8


def test_vector_environment_renders_each_session(fixed_id, make):
    envs = gym.make_vec(fixed_id, num_envs=2, render_mode="rgb_array", start="random")
    one = make(fixed_id, render_mode="rgb_array", start="random")
    envs.reset(seed=4)
    frames = envs.render()
    for i, frame in enumerate(frames):
        one.reset(seed=4 + i)
        np.testing.assert_array_equal(frame, one.render())


def test_render_without_a_mode_warns_and_draws_nothing(fixed_id, make):
    env, envs = make(fixed_id), gym.make_vec(fixed_id)
    for each in (env, envs):
        each.reset()
        with pytest.warns(UserWarning, match="make the environment"):
            assert each.render() is None


@pytest.mark.parametrize("toolkits", [rendering.TOOLKITS, ()])
@pytest.mark.parametrize("display", ["", ":987"])
@pytest.mark.parametrize("chosen", ["agg", "tkagg", "qtagg"])
def test_human_mode_says_once_that_there_is_no_display(
    make, monkeypatch, chosen, display, toolkits
):
    monkeypatch.setattr(rendering, "TOOLKITS", toolkits)
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setitem(matplotlib.rcParams, "backend", chosen)  # as others may have chosen it
    env = make("PKM/Diamond-v0", render_mode="human")
    with pytest.warns(UserWarning, match="there is no display here, or no toolkit") as said:
        env.reset(seed=0)
    assert len(said) == 1
    env.step(env.action_space.sample())
    assert env.render() is None
    env.close()
    env.close()
    assert pyplot.get_fignums() == []
    assert matplotlib.rcParams["backend"] == chosen


def test_human_mode_shows_each_step_in_one_window(fixed_id, make, window):
    env = make(fixed_id, render_mode="human")
    env.reset(seed=0)
    (shown,) = window
    before = shown.canvas.figure.axes[0].images[0].get_array()
    env.step(env.action_space.sample())
    assert window == [shown]
    picture = shown.canvas.figure.axes[0].images[0].get_array()
    assert not np.array_equal(picture, before)
    twin = make(fixed_id, render_mode="rgb_array")
    twin.session = env.session
    np.testing.assert_array_equal(picture, twin.render())
    env.close()
    assert window == []
    assert pyplot.get_fignums() == []


def test_a_window_that_somebody_closes_stays_closed(make, window):
    env = make("PKM/Diamond-v0", render_mode="human")
    env.reset(seed=0)
    (shown,) = window
    CloseEvent("close_event", shown.canvas)._process()
    shown.destroy()
    env.step(env.action_space.sample())
    assert window == []
    env.close()


@pytest.fixture
def photographed(monkeypatch):
    """The machines that the camera was shown; each picture is grey."""
    from pkm_gym.twin import camera

    machines = []

    def shot(self, twin, *_):
        machines.append(twin.mechanism)
        return np.full((self.height, self.width, 3), 128, dtype=np.uint8)

    monkeypatch.setattr(camera.Camera, "shot", shot)
    return machines


def test_mujoco_draws_the_machine_of_the_design_evaluated_last(
    family_problem, env_id, make, usable, photographed
):
    if not family_problem.mechanism(usable.designs[0]).twin_module:
        pytest.skip("its mechanism has no twin")
    env = make(env_id, render_mode="rgb_array", renderer="mujoco")
    start = env.problem.reduced(family_problem.complete(usable.designs[:1]))[0]
    start = np.clip(start, env.problem.low, env.problem.high)
    env.reset(seed=0, options={"design": start, "task": usable.tasks[0]})
    *_, info = env.step(np.zeros(env.action_space.shape))
    assert env.render().shape == (960, 1280, 3)
    design, task = env.problem.design(info["design"]), env.session.tasks[0]
    assert photographed == [env.problem.mechanism(design, env.problem.unpack(task)).real()]
    env.close()


def test_mujoco_leaves_the_picture_blank_where_there_is_no_machine(make, photographed):
    env = make("PKM/Diamond-v0", render_mode="rgb_array", renderer="mujoco", bounds={"gap": (3, 4)})
    env.reset(seed=0)
    assert np.unique(env.render()).size == 1
    assert photographed == []


def test_the_vector_environment_takes_the_renderer_too(photographed):
    envs = gym.make_vec("PKM/SPR3-v0", num_envs=2, render_mode="rgb_array", renderer="mujoco")
    envs.reset(seed=0)
    assert len(envs.render()) == len(photographed) == 2
    envs.close()


def test_an_unknown_renderer_is_refused_with_its_closest_match(make):
    with pytest.raises(ValueError, match="unknown renderer 'mujco'; did you mean 'mujoco'"):
        make("PKM/Diamond-v0", renderer="mujco")
