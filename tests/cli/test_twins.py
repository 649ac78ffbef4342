"""``pkm-gym twin-check``, ``export``, ``picture`` and ``movie``."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from PIL import Image

import pkm_gym
from pkm_gym.studies.verbs.twin_check import machines
from pkm_gym.twin import camera


@pytest.fixture
def grey(monkeypatch):
    """Cameras that need no OpenGL: all their pictures are grey."""
    monkeypatch.setattr(
        camera.Camera,
        "shot",
        lambda self, *_: np.full((self.height, self.width, 3), 128, dtype=np.uint8),
    )


def test_json_holds_the_rows(run):
    result = run("twin-check", "diamond", "--designs", 0, "--json")
    assert result.exit_code == 0, result.output
    rows = json.loads(result.stdout)["rows"]
    assert len(rows) == 6
    for row in rows:
        assert {"mechanism", "quantity", "worst", "limit", "unit", "holds"} <= set(row)
        assert row["mechanism"] == "diamond"
        assert row["holds"] is True
        assert row["limit"] is None or row["worst"] <= row["limit"]


def test_the_table_names_each_quantity_and_the_solver(run):
    text = run("twin-check", "diamond", "--designs", 1, "--seed", 5).stdout
    for words in ("loop closure", "Jacobian", "settled position", "1e-06", "timestep 0.0002 s"):
        assert words in text


def test_a_broken_limit_is_shown_and_exits_with_1(run, monkeypatch):
    from pkm_gym.mechanisms.diamond import twin

    monkeypatch.setattr(twin, "LIGHT_ROD", 1e-3)
    result = run("twin-check", "diamond", "--designs", 0)
    assert result.exit_code == 1
    assert "broken" in result.stdout


def test_all_means_each_mechanism_once():
    assert machines() == ("diamond", "pss5_upu_skew", "pus6", "spr3", "stroke_leg")


def test_unknown_mechanisms_are_refused(refused):
    assert refused("twin-check", "diamnd") == "unknown mechanism 'diamnd'; did you mean 'diamond'?"


@pytest.mark.parametrize("name", ["diamond", "pss5_upu_skew", "pus6", "spr3", "stroke_leg"])
def test_the_exported_model_opens_in_mujoco_and_stands_still(run, tmp_path, name):
    assert run("export", name, "-o", "twin.xml").exit_code == 0
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "twin.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 2000)
    problem = pkm_gym.make_problem(name)
    machine = problem.mechanism(problem.printed_design())
    pose = camera.first_pose(machine)
    joints = [data.joint(joint).qpos[0] for joint in machine.joint_names]
    np.testing.assert_allclose(joints, machine.inverse_kinematics(pose), atol=3e-3)
    for one, two in zip(model.eq_obj1id, model.eq_obj2id, strict=True):
        assert np.abs(data.site_xpos[one] - data.site_xpos[two]).max() < 1e-5
    assert [path.name for path in tmp_path.iterdir()] == ["twin.xml"]


def test_the_exported_model_has_the_dimensions_given(run, tmp_path):
    words = ("--set", "e=140mm", "l1=260mm", "l2=640mm", "H=480mm")
    result = run("export", "diamond", *words)
    assert "task.delta" in result.stdout
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "runs/diamond/twin.xml"))
    np.testing.assert_allclose(model.body("rod_1").pos, [0.26, 0.0, 0.0])
    np.testing.assert_allclose(model.site("tip_1").pos, [0.64, 0.0, 0.0])


@pytest.mark.usefixtures("grey")
def test_a_picture_has_the_size_asked_for(run, tmp_path):
    words = ("--width", 320, "--height", 200, "--pose", 1, "-o", "sub/one.png")
    assert run("picture", "spr3", *words).exit_code == 0
    with Image.open(tmp_path / "sub/one.png") as image:
        assert image.size == (320, 200)


@pytest.mark.usefixtures("grey")
@pytest.mark.parametrize("form", ["mp4", "gif"])
def test_a_movie_has_the_frames_asked_for(run, tmp_path, form):
    imageio = pytest.importorskip("imageio.v2")
    words = ("--seconds", 0.4, "--fps", 10, "--width", 160, "--height", 120, "-o", f"m.{form}")
    result = run("movie", "diamond", *words)
    assert result.exit_code == 0, result.output
    with imageio.get_reader(tmp_path / f"m.{form}") as reader:
        count = reader.count_frames() if form == "mp4" else len(reader)
        assert reader.get_data(0).shape[:2] == (120, 160)
    assert count == (4 if form == "mp4" else 1)  # a gif keeps equal frames as one
    assert [path.name for path in tmp_path.iterdir()] == [f"m.{form}"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("picture", "diamond", "-o", "a.jpg"), "can't write 'a.jpg': its name must end in .png"),
        (
            ("movie", "diamond", "-o", "a.avi"),
            "can't write 'a.avi': its name must end in .mp4 or .gif",
        ),
        (("export", "diamond", "-o", "a"), "can't write 'a': its name must end in .xml"),
        (("picture", "spr3", "--pose", "3"), "--pose 3 is none of the 3 poses: 0 to 2"),
        (
            ("export", "diamond", "--set", "gap=3"),
            "there is nothing to draw: the machine reaches no pose of its workspace",
        ),
    ],
)
def test_mistakes_are_answered_in_one_sentence(refused, words, sentence):
    assert refused(*words) == sentence


def test_a_missing_movie_library_is_named_with_its_extra(refused, monkeypatch):
    for name in ("imageio", "imageio.v2"):
        monkeypatch.setitem(sys.modules, name, None)
    assert 'needs the extra "movies"' in refused("movie", "diamond")


def test_a_failed_movie_leaves_no_file(run, monkeypatch, tmp_path):
    pytest.importorskip("imageio")

    def fail(*_):
        raise OSError(camera.NO_GL)

    monkeypatch.setattr(camera.Camera, "shot", fail)
    result = run("movie", "diamond", "-o", "m.gif")
    assert result.exit_code == 2
    assert "libegl1" in result.stderr
    assert list(tmp_path.iterdir()) == []


def test_an_unknown_way_to_draw_is_refused_in_one_sentence():
    environment = {**os.environ, "MUJOCO_GL": "ogl"}
    words = [sys.executable, "-m", "pkm_gym", "picture", "diamond"]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "pkm-gym: MuJoCo does not start: invalid value for environment" in done.stderr
    assert "Traceback" not in done.stderr
