"""``pkm-gym figures``: the paper's figures, written to files."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
import trimesh
from matplotlib.image import imread
from PIL import Image, ImageSequence
from typer.testing import CliRunner

import pkm_gym
from pkm_gym.__main__ import app
from pkm_gym.mechanisms.spr3.workspace import volume_by_surfaces
from pkm_gym.studies.cli.design_file import write_design
from pkm_gym.studies.verbs.figures import figures_of, write


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(app, ["figures", *map(str, words)])


def test_a_problem_without_figures_is_answered_in_one_sentence(run, monkeypatch):
    monkeypatch.setattr("pkm_gym.mechanisms.spr3.figures.PICTURES", {})
    done = run("spr3_cylinder")
    assert done.exit_code == 2
    assert done.stderr == "pkm-gym: spr3_cylinder has no figures\n"


def test_the_envelope_is_watertight_and_holds_the_volume(run, tmp_path):
    spr3 = pkm_gym.make_problem("spr3")
    done = run("spr3", "--only", "envelope", "--out", "there")
    assert done.exit_code == 0, done.output
    assert [path.name for path in (tmp_path / "there").iterdir()] == ["envelope.stl"]
    mesh = trimesh.load(tmp_path / "there" / "envelope.stl")
    assert mesh.is_watertight
    machine = spr3.mechanism(spr3.printed_design())
    assert mesh.volume == pytest.approx(volume_by_surfaces(machine), rel=1e-6)
    assert figures_of("diamond")[1] == {}


def test_a_trot_moves_for_a_period(run, tmp_path):
    done = run("stroke_leg", "--only", "trot", "--out", "there")
    assert done.exit_code == 0, done.output
    with Image.open(tmp_path / "there" / "trot.gif") as movie:
        assert movie.n_frames == 40
        assert movie.info["duration"] == 50
        frames = [np.asarray(frame.convert("L")) for frame in ImageSequence.Iterator(movie)]
    assert all((one != other).any() for one, other in pairwise(frames))


@pytest.mark.slow
def test_a_push_swings_both_layouts(run, tmp_path):
    done = run("pss5_upu", "--only", "pushed", "--out", "there")
    assert done.exit_code == 0, done.output
    with Image.open(tmp_path / "there" / "pushed.gif") as movie:
        assert movie.n_frames > 30  # pictures alike are one
        assert movie.info["loop"] == 0


def test_the_verb_writes_what_it_says(run, tmp_path):
    done = run("diamond", "--only", "cycle", "--only", "printed")
    assert done.exit_code == 0, done.output
    lines = done.stdout.splitlines()
    folder = tmp_path / "runs" / "diamond" / "figures"
    assert sorted(path.name for path in folder.iterdir()) == ["cycle.png", "printed.png"]
    assert [line.split()[0] for line in lines] == [
        str(folder.relative_to(tmp_path) / f"{stem}.png") for stem in ("cycle", "printed")
    ]
    assert imread(folder / "cycle.png").std() > 0.05


@pytest.mark.parametrize(
    ("name", "only", "files"),
    [
        ("diamond", "cycle", ["cycle.png"]),
        ("diamond", "design", ["design.png"]),
        ("spr3", "envelope", ["envelope.stl"]),
        ("stroke_leg_gait", "design_maps", ["design_maps.png"]),
        ("stroke_leg", "trot", ["trot.gif"]),
    ],
)
def test_what_any_design_has_is_drawn_of_a_file_s(run, tmp_path, name, only, files):
    problem = pkm_gym.make_problem(name)
    best = problem.evaluate(problem.printed_design()[None])
    write_design(tmp_path / "mine.toml", best, "a test")
    done = run(name, "--design", "mine.toml", "--only", only)
    assert done.exit_code == 0, done.output
    folder = tmp_path / "runs" / name / "figures-mine"
    assert [path.name for path in folder.iterdir()] == files


def test_what_is_drawn_goes_with_the_design(run, tmp_path):
    problem = pkm_gym.make_problem("spr3")
    volumes = []
    for scale in (1.0, 0.9):
        best = problem.evaluate(problem.printed_design()[None] * scale)
        write_design(tmp_path / f"{scale}.toml", best, "a test")
        out = tmp_path / f"{scale}"
        done = run("spr3", "--design", f"{scale}.toml", "--only", "envelope", "--out", out)
        assert done.exit_code == 0, done.output
        volumes.append(trimesh.load(out / "envelope.stl").volume)
    assert volumes[1] < 0.99 * volumes[0]


def test_what_is_of_the_paper_is_refused_with_a_design(run, tmp_path):
    problem = pkm_gym.make_problem("diamond")
    best = problem.evaluate(problem.printed_design()[None])
    write_design(tmp_path / "mine.toml", best, "a test")
    done = run("diamond", "--design", "mine.toml", "--only", "fig8_wedge")
    assert done.exit_code == 2
    said = "fig8_wedge is of the paper, not of a design: leave --design out, or take one of design"
    assert said in done.stderr
    assert run("spr3", "--design", "mine.toml").exit_code == 2
    assert not (tmp_path / "runs").exists()


def test_vector_formats_are_written(run, tmp_path):
    assert run("diamond", "--only", "cycle", "--format", "pdf", "--out", "there").exit_code == 0
    assert (tmp_path / "there" / "cycle.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["dimond"], "unknown mechanism 'dimond'; did you mean 'diamond'?"),
        (["diamond", "--only", "cycel"], "unknown figure 'cycel'; did you mean 'cycle'?"),
        (["diamond", "--format", "pgn"], "unknown format 'pgn'; did you mean 'png'?"),
    ],
)
def test_a_wrong_name_is_refused_in_one_sentence(run, tmp_path, words, sentence):
    done = run(*words)
    assert done.exit_code == 2
    assert done.stderr == f"pkm-gym: {sentence}\n"
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_folder_is_refused_in_one_sentence(run, tmp_path):
    (tmp_path / "taken").write_text("a file")
    done = run("diamond", "--out", "taken")
    assert done.exit_code == 2
    assert done.stderr.startswith("pkm-gym: taken: ")
    assert done.stderr.count("\n") == 1


@pytest.mark.slow
def test_all_figures_are_written(tmp_path):
    write("diamond", list(figures_of("diamond")[0]), tmp_path, "png")
    assert {path.stem for path in tmp_path.iterdir()} == set(figures_of("diamond")[0])
