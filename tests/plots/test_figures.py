"""``pkm-gym figures``: the paper's figures with our model."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.image import imread
from typer.testing import CliRunner

import pkm_gym
from pkm_gym import plots
from pkm_gym.__main__ import app
from pkm_gym.studies.figures import diamond, pictures_of, write


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return lambda *words: CliRunner().invoke(app, ["figures", *map(str, words)])


@pytest.fixture
def model():
    return pkm_gym.make_problem("diamond")


@pytest.mark.parametrize("name", sorted(set(pictures_of("diamond")) - {"fig7_intervals"}))
def test_each_figure_is_drawn(model, name):
    pixels = plots.figure_to_array(pictures_of("diamond")[name].draw(model))
    assert (pixels < 128).any(axis=2).mean() > 0.01


def test_every_problem_has_figures(problem):
    assert len(pictures_of(problem.name)) > 1


def test_the_intervals_show_the_optima_and_the_active_bound(model, monkeypatch):
    optima = model.reference.optima
    monkeypatch.setattr(diamond, "SCAN", np.array([0.3, 0.6, 0.7]))
    printed = diamond.intervals(model).axes[0]
    curves = {line.get_label(): line.get_ydata() for line in printed.lines}
    assert list(np.isfinite(curves["[0.6, 1.5]"])) == [True, True, False]
    assert curves["[0.6, 1.5]"][1] == pytest.approx(
        optima["tau_G_at_printed_lam_e"].value, rel=1e-7
    )
    feasible = {label for label, y in curves.items() if label[0] == "[" and np.isfinite(y[2])}
    assert feasible == {"[0.7, 1.6]"}
    upper = [line for line in printed.lines if line.get_marker() == "^" and len(line.get_xdata())]
    lower = [line for line in printed.lines if line.get_marker() == "v" and len(line.get_xdata())]
    assert len(upper) == 6
    assert lower == []


def test_the_wedge_marks_the_printed_design_and_the_apex(model):
    axes = diamond.wedge(model).axes[0]
    marked = {line.get_label(): line.get_xydata()[0] for line in axes.lines}
    reference = model.reference
    printed = next(point for name, point in marked.items() if name.startswith("paper"))
    apex = next(point for name, point in marked.items() if name.startswith("polished"))
    assert tuple(printed) == pytest.approx((reference["lam_l"].printed, reference["lam_H"].printed))
    assert tuple(apex) == pytest.approx((reference["lam_l"].ours, reference["lam_H"].ours))
    values = {name.split()[0]: float(name.split()[1]) for name in marked}
    assert values["paper"] > values["grid"] > values["polished"]


def test_the_cycle_shows_the_peak_and_parts_that_add_up(model):
    axes = diamond.cycle(model).axes[0]
    lines = {line.get_label(): line.get_ydata() for line in axes.lines}
    parts = sum(lines[name] for name in ("inertia", "velocity", "gravity"))
    np.testing.assert_allclose(lines["total"], parts, atol=1e-9)
    reference = model.reference
    assert abs(lines["total"]).max() == pytest.approx(reference["tau_peak"].ours, rel=1e-6)
    words = [text.get_text() for text in axes.texts]
    assert words == [
        f"peak {reference['tau_peak'].ours:.2f} N·m", f"rms {reference['tau_rms'].ours:.2f} N·m",
    ]  # fmt: skip


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
    write("diamond", list(pictures_of("diamond")), tmp_path, "png")
    assert {path.stem for path in tmp_path.iterdir()} == set(pictures_of("diamond"))
