"""Pictures of twins, with OpenGL and without; skipped where there is none."""

from __future__ import annotations

import pickle
from collections.abc import Iterator

import mujoco
import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.twin import twin_module
from pkm_gym.twin.camera import Camera, first_pose, movie, picture


@pytest.fixture(scope="module")
def camera(twinned: DesignProblem) -> Iterator[Camera]:
    """One camera for all the tests of a mechanism."""
    with Camera(160, 120) as one:
        try:
            picture(twinned.mechanism(twinned.printed_design()), one)
        except OSError as error:
            pytest.skip(str(error))
        yield one


def orange(pixels):
    """Share of the picture that has the platform's colour."""
    red, _, blue = np.moveaxis(pixels.astype(int), -1, 0)
    return (red - blue > 90).mean()


def test_a_picture_shows_the_machine_and_another_pose_differs(machine, camera):
    poses = machine.sample_poses()
    one, two = (picture(machine, camera, pose) for pose in poses[:2])
    assert one.shape == (120, 160, 3)
    assert one.dtype == np.uint8
    assert orange(one) > 1e-4
    assert one.std() > 10.0
    assert np.abs(one.astype(int) - two).max() > 50
    np.testing.assert_array_equal(one, picture(machine, camera, poses[0]))


def test_one_camera_draws_every_mechanism_as_its_own_would(machine, camera):
    with Camera(160, 120) as own:
        expected = picture(machine, own)
    np.testing.assert_array_equal(picture(machine, camera), expected)


def test_a_movie_goes_there_and_back_or_around(machine, camera):
    frames = list(movie(machine, camera, 6))
    assert len(frames) == 6
    first, last = twin_module(machine).course(machine, 2).poses
    assert np.array_equal(frames[2], frames[4]) == (not np.allclose(first, last))
    assert not np.array_equal(frames[0], frames[2])  # the path may end where it began


def test_the_camera_starts_again_after_it_was_closed_and_pickles(machine, camera):
    before = picture(machine, camera)
    twin = pickle.loads(pickle.dumps(camera))
    camera.close()
    camera.close()
    np.testing.assert_array_equal(picture(machine, camera), before)
    np.testing.assert_array_equal(picture(machine, twin), before)
    twin.close()


def test_without_opengl_a_sentence_names_the_package(machine, monkeypatch):
    def fail(*_):
        raise mujoco.FatalError("an OpenGL platform library has not been loaded")

    monkeypatch.setattr(mujoco, "GLContext", fail)
    with pytest.raises(OSError, match="apt-get install libegl1"):
        picture(machine, Camera())


def test_a_machine_is_drawn_at_a_pose_within_reach(machine):
    assert np.isfinite(machine.inverse_kinematics(first_pose(machine))).all()


def test_a_machine_that_reaches_nothing_is_refused():
    problem = pkm_gym.make_problem("diamond")
    machine = problem.mechanism(np.array([0.6, 2.56, 3.0]))
    with pytest.raises(ValueError, match="reaches no pose"):
        first_pose(machine)
