"""Figures become pixels and files."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.image import imread

from pkm_gym import plots


@pytest.fixture
def figure():
    figure = plots.new_figure(2.0, 1.0)
    axes = plots.panel(figure, (0.2, 0.3, 0.7, 0.6), x="x (mm)", y="y (mm)")
    axes.plot([0, 1], [0, 1])
    return figure


@pytest.mark.parametrize(
    ("form", "start"), [("png", b"\x89PNG"), ("pdf", b"%PDF"), ("svg", b"<?xml")]
)
def test_each_format_is_written(figure, tmp_path, form, start):
    path = plots.save(figure, tmp_path / f"picture.{form}")
    assert path.read_bytes().startswith(start)
    assert list(tmp_path.iterdir()) == [path]


def test_pixels_are_those_of_the_file(figure, tmp_path):
    pixels = plots.figure_to_array(figure)
    assert pixels.shape == (100, 200, 3)
    saved = imread(plots.save(figure, tmp_path / "picture.png"))[..., :3]
    np.testing.assert_array_equal(np.round(255 * saved), pixels)
    assert imread(plots.save(figure, tmp_path / "fine.png", dpi=200)).shape[:2] == (200, 400)


def test_pixels_are_the_callers_own(figure):
    first = plots.figure_to_array(figure)
    kept = first.copy()
    assert first.flags.owndata
    assert first.flags.writeable
    figure.set_facecolor("black")
    assert plots.figure_to_array(figure).mean() < kept.mean()
    np.testing.assert_array_equal(first, kept)


@pytest.mark.parametrize("form", ["png", "pdf", "svg"])
def test_files_carry_no_date_and_no_version(figure, tmp_path, form):
    content = plots.save(figure, tmp_path / f"picture.{form}").read_bytes()
    for word in (b"CreationDate", b"dc:date", b"matplotlib.org"):
        assert word not in content


@pytest.mark.parametrize("form", ["png", "pdf"])
def test_the_same_figure_makes_the_same_file(figure, tmp_path, form):
    one, two = (plots.save(figure, tmp_path / f"{k}.{form}").read_bytes() for k in range(2))
    assert one == two


def test_a_file_is_replaced_not_written_over(figure, tmp_path):
    path = plots.save(figure, tmp_path / "picture.png")
    reader = tmp_path / "reader.png"
    reader.hardlink_to(path)
    before = reader.read_bytes()
    figure.set_facecolor("black")
    plots.save(figure, path)
    assert path.read_bytes() != before
    assert reader.read_bytes() == before


@pytest.mark.parametrize("name", ["picture.bmp", "picture", "picture.png.txt"])
def test_another_extension_is_refused(figure, tmp_path, name):
    with pytest.raises(ValueError, match=r"\.png, \.svg or \.pdf$"):
        plots.save(figure, tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_failure_leaves_the_old_file_and_nothing_else(figure, tmp_path, monkeypatch):
    path = plots.save(figure, tmp_path / "picture.png")
    before = path.read_bytes()

    def broken(part, **_):
        part.write_bytes(b"half")
        raise RuntimeError("disk full")

    monkeypatch.setattr(figure, "savefig", broken)
    with pytest.raises(RuntimeError, match="disk full"):
        plots.save(figure, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_a_missing_folder_is_made(figure, tmp_path):
    assert plots.save(figure, tmp_path / "missing" / "picture.png").is_file()


def test_a_folder_that_is_a_file_is_an_os_error(figure, tmp_path):
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(OSError, match="taken"):
        plots.save(figure, tmp_path / "taken" / "picture.png")
