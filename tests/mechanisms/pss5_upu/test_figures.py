"""The 5-PSS/UPU's figures: what they mark, count and say."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym import plots
from pkm_gym.mechanisms.pss5_upu.atlas import NAMES, own_composites, space_grid, to_plane
from pkm_gym.mechanisms.pss5_upu.facts import table_5
from pkm_gym.mechanisms.pss5_upu.figures.common import BEST, skew, space
from pkm_gym.mechanisms.pss5_upu.figures.machine import limb_axes
from pkm_gym.studies.verbs.figures import figures_of


@pytest.fixture(scope="module")
def problem():
    return pkm_gym.make_problem("pss5_upu")


def draw(name, problem):
    return figures_of("pss5_upu")[0][name].draw(problem)


def words(figure):
    """Everything that is written in a figure and its axes."""
    texts = [*figure.texts, *(text for axes in figure.axes for text in axes.texts)]
    return "\n".join(text.get_text() for text in texts)


def titled(figure):
    """The panels that have a title, by it."""
    named = {axes.get_title(loc="left"): axes for axes in figure.axes}
    return {title: axes for title, axes in named.items() if title}


def marked(axes, begins):
    (line,) = (line for line in axes.lines if str(line.get_label()).startswith(begins))
    return line.get_xydata()


def test_there_is_a_figure_for_each_of_the_papers():
    names = set(figures_of("pss5_upu")[0])
    assert {f"fig{number}" for number in range(1, 8)} <= names
    assert {"printed", "singular", "weights"} <= names


def test_the_space_model_shows_the_sizes_of_table_5(problem):
    axes = draw("fig4", problem).axes[1]
    places = {text.get_text(): text.xy for text in axes.texts if text.get_text().startswith("row")}
    for k, machine in enumerate(table_5(problem), 1):
        expected = to_plane([machine.R / machine.n, machine.L / machine.n])
        np.testing.assert_allclose(places[f"row {k}"], expected)


@pytest.mark.parametrize(("figure", "panels"), [("fig5", 4), ("fig6", 2)])
def test_an_atlas_marks_the_papers_optimum_and_ours(problem, figure, panels):
    found = titled(draw(figure, problem))
    assert len(found) == panels
    optimum = problem.reference.optima["F"].design
    ours = to_plane([optimum["n2"], optimum["n3"]])
    for axes in found.values():
        np.testing.assert_allclose(marked(axes, "paper's"), [(2.13, 1.1)])
        np.testing.assert_allclose(marked(axes, "our optimum"), [ours])
        assert any("////" in (c.hatches or ()) for c in axes.collections)


def test_the_atlas_is_the_problems(problem):
    at = (40, 20)
    design = np.array([[0.5 * (np.sqrt(3.0) * space().X[at] - space().Y[at]), space().Y[at]]])
    found = problem.evaluate(design)
    for name in (*NAMES, "F"):
        assert space().index(name)[at] == pytest.approx(found.indices[name][0], rel=1e-9)
    assert space().violation()[at] == pytest.approx(found.constraints.max(), rel=1e-9)


def test_the_composites_weights_are_told(problem):
    feasible = own_composites(problem.evaluate(space_grid()))[0].weights
    titles = list(titled(draw("fig6", problem)))
    assert "1.06 $K_1$ + 0.88 $K_2$ + 0.91 $K_3$ + 1.80 $K_4$" in titles[0]
    assert f"{feasible[0]:.2f} $Z_1$ − {-feasible[1]:.2f} $Z_2$" in titles[1]
    assert "− 0.00" not in titles[1]


def test_the_composite_rises_to_the_centre_where_two_indices_vanish(problem):
    axes = titled(draw("fig7", problem))["row 1, along x"]
    curves = {line.get_label(): np.abs(line.get_xydata()) for line in axes.lines}

    def near_and_far(name):
        x, y = curves[name].T
        return y[x.argmin()], y[x.argmax()]

    near, far = near_and_far("F")
    assert near > 1.1 * far
    for name in ("K_v", "K_eta"):
        near, far = near_and_far(plots.symbol(name))
        assert near < 0.05 * far


def test_the_sizes_of_fig_7_are_those_of_table_5(problem):
    titles = list(titled(draw("fig7", problem)))
    assert titles[:3] == [
        "row 1: r 303, R 646, L 551", "row 2: r 300, R 661, L 734", "row 3: r 161, R 600, L 380",
    ]  # fmt: skip


def test_the_singular_values_show_what_vanishes_at_home(problem):
    figure = draw("singular", problem)
    lines = [axes for axes in figure.axes if axes.get_yscale() == "log"]
    for axes, lost in zip(lines, (2, 0), strict=True):
        least = [line.get_ydata().min() for line in axes.lines]
        assert sum(value < 1e-9 for value in least) == lost
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles.count("paper's: rank 4 of 6 at home") == 2
    assert titles.count("skew: rank 6 of 6 at home") == 2


def test_the_skew_layout_keeps_every_limit():
    asked = pkm_gym.make_problem("pss5_upu_skew")
    found = asked.evaluate(asked.design(BEST)[None])
    assert found.feasible[0], found.explain(0)
    assert found.indices["gti"][0] == pytest.approx(0.8176, abs=2e-3)
    assert skew().rcond(skew().home) > 0.1


def test_the_frames_are_mirrored_as_printed(problem):
    machine = problem.mechanism(problem.printed_design())
    rails = machine.rails()
    along = rails[:, 1] - rails[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    right, as_printed = limb_axes(machine.theta, 1.0), limb_axes(machine.theta, -1.0)
    np.testing.assert_allclose(right, along, atol=1e-12)
    np.testing.assert_allclose(as_printed[:, 2], -right[:, 2])
    assert (right[:, 2] > 0.0).all()
    feet = rails[:, 0, :2] / machine.R
    azimuths = np.degrees(np.arctan2(*as_printed[:, 1::-1].T))
    np.testing.assert_allclose(azimuths, -np.degrees(np.arctan2(*feet[:, ::-1].T)), atol=1e-9)
    assert "pass the axis at 614 mm" in words(draw("fig2", problem))


def test_the_screws_give_the_transmission(problem):
    said = words(draw("fig3", problem))
    machine = problem.mechanism(problem.printed_design())
    lam, eta = machine.transmission(machine.in_box(np.array([0.6, 0.4, 0.2, 0.6, -0.5])))[0]
    assert f"{lam:.3f}" in said
    assert f"{eta:.3f}" in said


def test_the_weights_are_doubtful_and_say_so(problem):
    said = words(draw("weights", problem))
    for composite in own_composites(problem.evaluate(space_grid())):
        for weight in composite.weights:
            assert f"{weight:.2f}".replace("-", "−") in said
    assert said.count("is a coin toss") == 3
    assert said.count("punishes") == 4
