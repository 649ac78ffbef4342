"""The 6-PUS's figures: what they mark, count and say."""

from __future__ import annotations

import re

import numpy as np
import pytest

import pkm_gym
from pkm_gym import plots
from pkm_gym.mechanisms.pus6.atlas import LENGTHS, RADII, lattice_atlas
from pkm_gym.mechanisms.pus6.mechanism import NAMES
from pkm_gym.studies.verbs.figures import figures_of


@pytest.fixture(scope="module")
def problem():
    return pkm_gym.make_problem("pus6")


@pytest.fixture(scope="module")
def atlas():
    return lattice_atlas()


def draw(name, problem):
    return figures_of("pus6")[0][name].draw(problem)


def words(figure):
    """Everything that is written in a figure and its axes."""
    texts = [*figure.texts, *(text for axes in figure.axes for text in axes.texts)]
    return "\n".join(text.get_text() for text in texts)


def marked(axes, begins):
    """Where the line whose label begins so is, the only one."""
    (line,) = (line for line in axes.lines if str(line.get_label()).startswith(begins))
    return line.get_xydata()


def panel(figure, begins):
    (axes,) = (a for a in figure.axes if a.get_title(loc="left").startswith(begins))
    return axes


def test_there_is_a_figure_for_each_of_the_papers():
    names = set(figures_of("pus6")[0])
    for number in range(2, 9):
        assert f"fig{number}" in names
    ours = "pareto", "search", "convention", "units", "trend", "layout", "sections"
    assert {"atlas", "table1", "table2", *ours} <= names


@pytest.mark.parametrize("name", NAMES)
def test_a_map_marks_the_largest_and_the_printed_design(problem, atlas, name):
    figure = draw(f"fig{3 + NAMES.index(name)}", problem)
    values = atlas[name].reshape(11, 11)
    row, column = np.unravel_index(values.argmax(), values.shape)
    best = 100.0 * np.array([LENGTHS[row], RADII[column]])
    for begins in ("over the paper's lattice", "over one box"):
        np.testing.assert_allclose(marked(panel(figure, begins), "printed"), [(46.0, 19.0)])
    np.testing.assert_allclose(
        marked(panel(figure, "over the paper's lattice"), "largest"), [best], atol=1e-9
    )
    box = problem.evaluate(problem.grid()).indices[name]
    other = 100.0 * problem.grid()[box.argmax()]
    np.testing.assert_allclose(marked(panel(figure, "over one box"), "largest"), [other], atol=1e-9)


def test_the_atlas_has_every_map_twice(problem):
    titles = [axes.get_title(loc="left") for axes in draw("atlas", problem).axes]
    for name in NAMES:
        assert sum(title.startswith(plots.symbol(name)) for title in titles) == 2


def test_fig_8_says_that_its_statement_is_contradicted(problem):
    assert "contradicted, by Table 2 too" in words(draw("fig8", problem))


def test_the_tables_show_every_number(problem, atlas):
    said = words(draw("table1", problem))
    assert "4,138,504 poses in all, printed 4,138,306; error rms 0.51 %, worst −2.0 %" in said
    assert len(re.findall(r"^[+−]?\d\.\d$", said, re.MULTILINE)) == 121
    said = words(draw("table2", problem))
    assert len(re.findall(r"^[+−]?\d\.\d %$", said, re.MULTILINE)) == 60
    for at in (0, 3, 58, 60, 118, 120):
        for value in atlas.means[at]:
            assert f"{value:.5f}" in said


def test_the_pareto_set_is_ringed_and_the_printed_design_in_it(problem, atlas):
    figure = draw("pareto", problem)
    rings = marked(figure.axes[0], "not dominated")
    assert len(rings) == 11
    assert [46.0, 19.0] in np.round(rings).tolist()
    assert "0.8584" in words(figure)
    axes = panel(figure, "what they trade")
    printed = marked(axes, "(46, 19)")[:5, 1]
    assert printed.min() == pytest.approx(atlas.balanced.max(), rel=1e-12)
    for line in axes.lines:
        shown = np.asarray(line.get_ydata())
        if len(shown) == 6:
            assert shown[:5].min() <= printed.min()


def test_the_search_finds_more_than_the_grid(problem):
    axes = panel(draw("search", problem), "balanced, one box")
    labels = [str(line.get_label()) for line in axes.lines]
    (inner,) = (float(text.split()[-1]) for text in labels if "grid's range" in text)
    (outer,) = (float(text.split()[-1]) for text in labels if "best in ours" in text)
    assert inner == pytest.approx(1.052, abs=0.002)
    assert outer == pytest.approx(1.086, abs=0.002)
    np.testing.assert_allclose(marked(axes, "best in ours"), [(42.51, 14.8)], atol=0.15)
    np.testing.assert_allclose(marked(axes, "best in the grid"), [(45.0, 14.65)], atol=0.1)


def test_the_convention_decides_how_table_2_fits_and_alpha_makes_the_gains(problem):
    figure = draw("convention", problem)
    labels = [str(line.get_label()) for line in figure.axes[0].lines]
    assert {"influence, within 2.9 %", "symmetric, within 14.1 %"} <= set(labels)
    gains = re.findall(r"×(\d\.\d\d), (\d\d) %", words(figure))
    factors, shares = zip(*((float(gain), float(share)) for gain, share in gains), strict=True)
    np.testing.assert_allclose(factors, (2.22, 2.68, 3.10), atol=0.03)
    np.testing.assert_allclose(shares, (80, 76, 72), atol=1.5)


def test_the_rank_by_force_rises_with_the_unit_of_length(problem):
    figure = draw("units", problem)
    length, rank = figure.axes[-1].lines[0].get_xydata().T
    ranks = dict(zip(length.round(2).tolist(), rank.astype(int).tolist(), strict=True))
    assert ranks[1.0] > 60
    assert ranks[10.0] == 5
    assert ranks[20.0] == 11


def test_the_trends_turn_over_one_box(problem):
    figure = draw("trend", problem)
    for title in (r"$\eta_{v}$", r"$\eta_{I}$"):
        axes = panel(figure, title)
        assert (np.diff(marked(axes, "lattice")[:, 1]) > 0.0).all()
        assert (np.diff(marked(axes, "one box")[:, 1]) < 0.0).all()


def test_the_layouts_say_how_far_pairs_are_apart(problem):
    printed, best = (words_of_axes(axes) for axes in draw("layout", problem).axes[:3:2])
    assert printed == {"98 mm", "99 mm"}
    assert best == {"40 mm", "107 mm"}


def words_of_axes(axes):
    return {text.get_text() for text in axes.texts}


def test_the_frames_are_those_of_the_paper(problem):
    axes = draw("fig2", problem).axes[0]
    places = {text.get_text(): np.array(text.xy) for text in axes.texts}
    screws, joints = (
        [np.degrees(np.arctan2(*places[f"${letter}_{leg}$"][::-1])) % 360.0 for leg in range(1, 7)]
        for letter in "AC"
    )
    np.testing.assert_allclose(screws, [82.5, 97.5, 202.5, 217.5, 322.5, 337.5])
    np.testing.assert_allclose(joints, [45.0, 135.0, 165.0, 255.0, 285.0, 15.0])


def test_the_sections_hatch_what_is_beyond_the_singularity(problem):
    figure = draw("sections", problem)

    def hatched(begins):
        areas = [c for c in panel(figure, begins).collections if "/////" in (c.hatches or ())]
        return sum(len(path.vertices) for area in areas for path in area.get_paths())

    assert hatched("(46, 19), printed: level") == 0
    assert hatched("(46, 19), printed: at home") == 0
    assert hatched("(46, 19), printed: at 100") > 0
    assert hatched("(45, 10): at home") > 0
