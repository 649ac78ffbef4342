"""The figures of each mechanism, as its ``figures.py`` draws them."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym import plots
from pkm_gym.core.trajectory import duration_345
from pkm_gym.mechanisms.diamond import figures as diamond
from pkm_gym.mechanisms.spr3 import twin
from pkm_gym.mechanisms.spr3.claims import driven
from pkm_gym.mechanisms.spr3.path import motion
from pkm_gym.mechanisms.spr3.workspace import border_curves
from pkm_gym.mechanisms.stroke_leg.figures.motion import travel
from pkm_gym.mechanisms.stroke_leg.step import TROT, Step
from pkm_gym.studies.verbs.figures import figures_of


def pictures_of(name):
    return figures_of(name)[0]


@pytest.fixture
def model():
    return pkm_gym.make_problem("diamond")


@pytest.fixture(scope="module")
def spr3():
    return pkm_gym.make_problem("spr3")


@pytest.mark.parametrize(
    ("mechanism", "name"),
    [
        (mechanism, name)
        for mechanism in pkm_gym.problems()
        for name in sorted(set(pictures_of(mechanism)) - {"fig7_intervals"})
    ],
)
def test_each_figure_is_drawn(mechanism, name):
    problem = pkm_gym.make_problem(mechanism)
    pixels = plots.figure_to_array(pictures_of(mechanism)[name].draw(problem))
    assert (pixels < 128).any(axis=2).mean() > 0.01


def test_the_intervals_show_the_optima_and_the_active_bound(model, monkeypatch):
    optima = model.reference.optima
    monkeypatch.setattr(diamond, "SWEPT", np.array([0.2, 0.6, 0.7]))
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
    rings = [line.get_xdata() for line in printed.lines if line.get_marker() == "o"]
    cut = np.concatenate(rings)
    assert len(cut) == 4  # the search box cuts the curves at their left end
    assert set(cut) == {0.2}


def test_the_region_is_drawn_for_any_design(model):
    figure = diamond.region(model, np.array([0.3, 1.6, 0.65]))
    axes = figure.axes[0]
    words = {text.get_text() for text in axes.texts}
    assert {"$P_1$", "$P_2$", "$Q_1$", "$Q_2$", "$B_1'$", "$B_2''$"} <= words
    assert "1.25" in figure.texts[1].get_text()
    for design, said in (
        ([0.3, 1.6], "design"),
        ([0.6, 2.56, -0.3], "top edge comes .* too near to a drive"),
        ([0.6, 1.2, 1.5], "beyond the limb"),
    ):
        with pytest.raises(ValueError, match=said):
            diamond.region(model, np.array(design))


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


def curves(axes):
    """The legs' curves (n, 3) of a panel, and their times (n,)."""
    lines = [line for line in axes.lines if line.get_label().startswith("leg")]
    return lines[0].get_xdata(), np.stack([line.get_ydata() for line in lines], axis=-1)


def test_the_legs_stay_in_range_along_the_largest_path(spr3):
    figure = pictures_of("spr3")["path_lengths"].draw(spr3)
    machine = spr3.mechanism(spr3.printed_design())
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert [title.split("= ")[1] for title in titles] == [
        "0 deg, legs 1 and 2 alike", "30 deg", "60 deg, legs 1 and 3 alike", "90 deg"
    ]  # fmt: skip
    ends = np.array([(curves(a)[1].min(), curves(a)[1].max()) for a in figure.axes])
    assert ends.min() == pytest.approx(1e3 * machine.q_min, rel=1e-6)
    assert ends.max() == pytest.approx(1e3 * machine.q_max, rel=1e-6)
    note = figure.texts[1].get_text()
    assert "0.26 to 0.99 m" in note
    assert "does not fit" in note
    assert f"R {1e3 * spr3.reference['path_R'].ours:.1f} mm" in note
    time, reference = curves(figure.axes[0])[0][-1], spr3.reference
    limits = reference["speed"].printed, reference["acceleration"].printed
    radius, height = reference["path_R"].ours, reference["path_h"].ours
    expected = 2.0 * duration_345(height, *limits) + duration_345(2.0 * radius, *limits)
    assert time == pytest.approx(expected, rel=1e-6)


def test_the_rates_are_the_slopes_of_the_lengths(spr3):
    lengths = pictures_of("spr3")["path_lengths"].draw(spr3).axes
    rates = pictures_of("spr3")["path_rates"].draw(spr3).axes
    for one, other in zip(lengths, rates, strict=True):
        time, values = curves(one)
        slopes = np.gradient(values, time, axis=0)[1:-1]
        np.testing.assert_allclose(curves(other)[1][1:-1], slopes, atol=0.02)


def test_the_atlas_marks_the_printed_design_and_the_optimum(spr3):
    axes = pictures_of("spr3")["atlas"].draw(spr3).axes[0]
    marked = {line.get_label(): line.get_xydata()[0] for line in axes.lines}
    reference = spr3.reference
    optimum = reference.optima["gci"]
    for name, design in (("paper", reference.design), ("polished", optimum.design)):
        x, y = next(point for text, point in marked.items() if text.startswith(name))
        r3, r2 = y, 0.5 * (np.sqrt(3.0) * x - y)
        assert (3.0 - r2 - r3, r3) == pytest.approx((design["r1"], design["r3"]), rel=1e-9)
    values = {name.split()[0]: float(name.split()[1]) for name in marked}
    assert values["paper"] == pytest.approx(reference["gci"].ours, abs=1e-3)
    assert values["polished"] == pytest.approx(optimum.value, abs=5e-5)


def test_the_surface_and_its_sections_have_the_extent_of_the_workspace(spr3):
    surface = pictures_of("spr3")["fig6_envelope"].draw(spr3)
    sections = pictures_of("spr3")["sections"].draw(spr3)
    machine = spr3.mechanism(spr3.printed_design())
    low, high = (1e3 * end for end in (machine.workspace().min(0), machine.workspace().max(0)))
    for axes in surface.axes:
        assert axes.get_xlim()[1] == pytest.approx(high[0])
        assert axes.get_zlim() == pytest.approx((low[1], high[1]))
    upright = sections.axes[1].collections[0]
    points = np.concatenate([path.vertices for path in upright.get_paths()])
    np.testing.assert_allclose(points.min(axis=0), low, atol=0.2)
    np.testing.assert_allclose(points.max(axis=0), high, atol=0.2)


def test_the_path_is_drawn_as_printed_and_as_it_fits(spr3):
    plane = pictures_of("spr3")["fig2_path"].draw(spr3).axes[0]
    drawn = {line.get_label(): line.get_xydata() for line in plane.lines}
    R, h = (1e3 * spr3.reference[name].printed for name in ("path_R", "path_h"))
    for name, shape in (("printed", (2.0 * R, h)), ("largest that fits", (262.2085, 131.1042 / 2))):
        assert np.ptp(drawn[name], axis=0) == pytest.approx(shape, rel=1e-5)
    assert [text.get_text() for text in plane.texts] == [f"$P_{k}$" for k in (1, 2, 3, 4)]


def test_simulated_legs_and_platform_are_drawn_on_the_theory(spr3):
    run = driven(spr3.mechanism(spr3.printed_design()))
    plane = pictures_of("spr3")["fig3_trajectory"].draw(spr3).axes[0]
    (theory, simulation) = (line.get_xydata() for line in plane.lines)
    np.testing.assert_allclose(simulation, 1e3 * run.positions[::5, [0, 2]])
    across = simulation[np.abs(simulation[:, 0]) < 0.99 * np.abs(theory[:, 0]).max()]
    np.testing.assert_allclose(across[:, 1], theory[:, 1].min(), atol=0.005)
    axes = pictures_of("spr3")["fig4_speeds"].draw(spr3).axes[0]
    lines = {line.get_label(): line for line in axes.lines}
    for leg in (1, 2, 3):
        theory, simulation = (lines[f"leg {leg}, {kind}"] for kind in ("theory", "simulation"))
        expected = np.interp(simulation.get_xdata(), *theory.get_xydata().T)
        np.testing.assert_allclose(simulation.get_ydata(), expected, atol=1e-3)


def test_the_limbs_turn_as_the_jacobians_say_along_the_path(spr3):
    machine = spr3.mechanism(spr3.printed_design())
    path, speed, acceleration = twin.planned_path(machine)
    moved = motion(machine, path, speed, acceleration)
    pose = machine.pose_at(moved.positions)
    omega = np.einsum("nkij,nj->nki", machine.limb_jacobians(pose), moved.velocities)
    squares = (omega**2).sum(axis=-1)
    np.testing.assert_allclose(moved.swings**2 + moved.spins**2, squares, atol=1e-16)
    for name, values in (("limb_swings", moved.swings), ("limb_spins", moved.spins)):
        shown = curves(pictures_of("spr3")[name].draw(spr3).axes[0])[1]
        np.testing.assert_allclose(shown, np.degrees(values), atol=1e-3)


def test_border_curves_have_a_leg_at_an_end_and_one_that_runs(spr3):
    machine = spr3.mechanism(spr3.printed_design())
    curves = border_curves(machine, 0.025)
    assert curves.shape == (6, 11, 51, 3)
    legs = machine.leg_lengths(machine.pose_at(curves))
    for family, (held, stepped, running) in enumerate(
        ((0, 1, 2), (0, 1, 2), (1, 0, 2), (1, 0, 2), (2, 1, 0), (2, 1, 0))
    ):
        end = (machine.q_min, machine.q_max)[family % 2]
        np.testing.assert_allclose(legs[family, ..., held], end, rtol=1e-12)
        np.testing.assert_allclose(np.diff(legs[family, :, 0, stepped]), 0.025, rtol=1e-9)
        np.testing.assert_allclose(np.diff(legs[family, ..., running], axis=-1), 0.005, rtol=1e-9)
    drawn = pictures_of("spr3")["fig5_borders"].draw(spr3).axes[0]
    assert [len(lines._segments3d) for lines in drawn.collections] == 6 * [11]


def test_the_leg_reads_its_peak_speeds_and_the_extent_of_its_crown():
    problem = pkm_gym.make_problem("stroke_leg")
    drawn = pictures_of("stroke_leg")
    words = [text.get_text() for text in drawn["fig7_speeds"].draw(problem).axes[0].texts]
    assert {"88.8 mm/s", "94.9 mm/s"} <= set(words)
    assert "1004.56 mm by 771.45 mm" in drawn["fig3_workspace"].draw(problem).texts[1].get_text()
    assert "2.6 % of the crown" in drawn["fig4_condition"].draw(problem).texts[1].get_text()


def test_the_sweeps_of_the_mean_have_the_printed_trends():
    problem = pkm_gym.make_problem("stroke_leg")
    axes = pictures_of("stroke_leg")["fig5_sweeps"].draw(problem).axes[::3]
    for panel, rises in zip(axes, (False, False, True, True, False), strict=True):  # (a) to (e)
        mean = panel.lines[0].get_ydata()
        slopes = np.diff(mean[np.isfinite(mean)])
        assert len(slopes) > 40
        assert (slopes > 0.0).all() if rises else (slopes < 0.0).all()


def test_feet_that_stand_stay_where_they_are():
    step = Step()
    times = np.linspace(0.0, 0.99, 34)
    feet = step.motion(times, TROT[1]).position[:, 0]  # right front, on the ground at first
    moved = np.array([travel(step, time) for time in times.tolist()])
    np.testing.assert_allclose(feet + moved, feet[0], atol=1e-12)


def test_least_thrust_falls_where_pistons_may_be_faster():
    problem = pkm_gym.make_problem("stroke_leg_gait")
    line = pictures_of("stroke_leg_gait")["thrust_rate"].draw(problem).axes[0].lines[0]
    assert (np.diff(line.get_ydata()) < -0.3).all()
