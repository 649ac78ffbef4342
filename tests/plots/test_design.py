"""The picture of a design: whatever the design, it is drawn and it says what is wrong."""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib._pylab_helpers import Gcf
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

import pkm_gym
from pkm_gym import plots
from pkm_gym.core.limit import Limit


def texts(figure):
    """Everything that is written outside the axes, as one line."""
    return " ".join(" ".join(text.get_text().split()) for text in figure.texts)


def marks(axes, color):
    """Positions (n, 2), mm, of the marks of a colour."""
    return np.array([
        line.get_xydata()[0]
        for line in axes.lines
        if line.get_marker() not in ("None", "") and to_rgba(line.get_color()) == to_rgba(color)
    ])  # fmt: skip


def poses_at(machine, places):
    """Poses of the sampled workspace that are drawn at places (n, 2), mm."""
    grid = machine.workspace_grid(161, 33)
    grid = grid.reshape(-1, grid.shape[-1])
    away = np.linalg.norm(machine.drawn(grid) - 1e-3 * np.reshape(places, (-1, 1, 2)), axis=-1)
    assert (np.nanmin(away, axis=1) < 1e-12).all()
    return grid[np.nanargmin(away, axis=1)]


def test_every_kind_of_design_is_drawn(problem, designs, kind):
    figure = plots.design_figure(problem, designs[kind])
    assert isinstance(figure, Figure)
    pixels = plots.figure_to_array(figure)
    assert pixels.shape[1:] == (1000, 3)
    assert pixels.shape[0] >= 600  # more where there are many indices
    assert pixels.dtype == np.uint8
    # without a machine there are just words
    assert (pixels < 128).any(axis=2).mean() > (0.001 if kind == "no machine" else 0.005)
    assert len(figure.axes) == (0 if kind == "no machine" else 2)


def test_the_verdict_is_written(problem, designs, kind):
    written = texts(plots.design_figure(problem, designs[kind]))
    evaluation = problem.evaluate(designs[kind][None])
    assert bool(re.search(r"\bfeasible\b", written)) == (kind == "feasible")
    assert ("infeasible" in written) == (kind != "feasible")
    assert ("no machine to draw" in written) == (kind == "no machine")
    if kind != "feasible":
        sentences = evaluation.explain(0).split("\n")
        assert sentences[0] in written
        assert all(sentence.partition(":")[0] in written for sentence in sentences)


def test_limits_without_room_are_named(problem, design):
    fields = {field.name: field for field in problem.task_variables}
    task = {
        limit.bound: fields[limit.bound].legal_low
        if limit.side == "upper"
        else fields[limit.bound].legal_high
        for limit in problem.declared.constraints
        if isinstance(limit, Limit) and isinstance(limit.bound, str)
    }
    broken = problem.evaluate(design[None], problem.task_type.of(task)).explain(0)
    figure = plots.design_figure(problem, design, task)
    assert all(line.split(":")[0] in texts(figure) for line in broken.splitlines())
    assert min(text.get_position()[1] for text in figure.texts) > 0.0


def test_numbers_carry_their_units(problem, design):
    figure = plots.design_figure(problem, design)
    written = [text.get_text() for text in figure.texts]
    indices = problem.evaluate(design[None]).indices
    for index in problem.index_table:
        value, unit = plots.shown(indices[index.name][0], index.unit)
        at = written.index(index.name)
        assert float(written[at + 1].replace("−", "-")) == pytest.approx(value, rel=1e-3)
        assert not unit or written[at + 2] == unit
    for name, (length, unit) in problem.derived(design).items():
        at = written.index(name)
        assert float(written[at + 1]) == pytest.approx(plots.shown(length, unit)[0], rel=1e-3)


def test_no_words_touch(problem, designs, kind):
    task = problem.unpack(problem.draw_tasks(1, np.random.default_rng(8))[0])
    figure = plots.design_figure(problem, designs[kind], task)
    plots.figure_to_array(figure)
    boxes = [text.get_window_extent() for text in figure.texts]
    touching = [
        (figure.texts[i].get_text(), figure.texts[k].get_text())
        for i, one in enumerate(boxes)
        for k, other in enumerate(boxes[:i])
        if one.overlaps(other)
    ]
    assert touching == []
    assert max(box.x1 for box in boxes) < figure.bbox.x1


def test_the_machine_is_drawn_to_scale(problem, design):
    machine = problem.mechanism(design)
    axes = plots.design_figure(problem, design).axes[0]
    plots.figure_to_array(axes.figure)
    assert axes.get_aspect() == 1.0
    drawn = [line.get_xydata() for line in axes.lines]
    for pose in machine.sample_poses():
        for link in machine.links(pose):
            columns = ["xyz".index(name) for name in machine.drawn_axes]
            in_plane = link.points.shape[1] == 2
            points = 1e3 * (link.points if in_plane else link.points[:, columns])
            assert any(
                line.shape == points.shape and np.allclose(line, points, atol=1e-9)
                for line in drawn
            )
    low, high = axes.get_xlim(), axes.get_ylim()
    for points in (*drawn, 1e3 * machine.workspace()):
        assert ((points > (low[0], high[0])) & (points < (low[1], high[1]))).all()


@pytest.mark.parametrize("which", ["infeasible", "unreachable"])
def test_the_worst_pose_of_each_broken_limit_is_marked(problem, designs, which):
    if which not in designs:
        pytest.skip(f"no design found is {which}")
    design = designs[which]
    evaluation = problem.evaluate(design[None])
    machine = problem.mechanism(design)
    axes = plots.design_figure(problem, design).axes[1]
    found = marks(axes, plots.STYLE["bad"])
    at_marks = problem.local_violations(machine, poses_at(machine, found), problem.task)
    grid = problem.local_violations(machine, machine.workspace_grid(161, 33), problem.task)
    broken = [
        name
        for name, value in zip(problem.constraint_names, evaluation.constraints[0], strict=True)
        if value > 0.0 and name in grid and np.nanmax(grid[name], initial=0.0) > 0.0
    ]
    if not broken:
        pytest.skip("what it breaks is no matter of a pose")
    assert len(found) == len(broken)
    for name in broken:
        # rounding of mm to m may carry a mark at the edge of the reach past it
        assert np.nanmax(at_marks[name]) == pytest.approx(np.nanmax(grid[name]), rel=1e-9)


def test_the_worst_pose_of_the_index_is_marked(problem, design):
    machine = problem.mechanism(design)
    for name, index in problem.drawn_maps(machine, machine.workspace_grid(161, 33)).items():
        axes = plots.index_map_figure(problem, design, index=name).axes[0]
        if index.kind == "mean":
            assert len(marks(axes, plots.STYLE["ink"])) == 0
            continue
        (pose,) = poses_at(machine, marks(axes, plots.STYLE["ink"]))
        worst = index.values.max() if index.kind == "max" else index.values.min()
        assert problem.drawn_maps(machine, pose)[name].values == pytest.approx(worst, rel=1e-9)


def test_what_breaks_a_limit_is_hatched(problem, designs):
    design = designs["infeasible"]
    machine = problem.mechanism(design)
    broken = problem.evaluate(design[None]).constraints[0] > 0.0
    names = set(np.array(problem.constraint_names)[broken])
    grid = machine.workspace_grid(53, 17)
    maps = problem.index_maps(machine, grid)
    drawn = {
        limit.name
        for limit in problem.declared.constraints
        if isinstance(limit, Limit) and limit.quantity in maps and maps[limit.quantity].drawn
    }
    names &= drawn
    local = problem.local_violations(machine, grid, problem.task)
    if not names & set(local):
        pytest.skip("what it breaks is no matter of a pose that is drawn")
    worst = np.max([values for name, values in local.items() if name in names], axis=0).ravel()
    axes = plots.design_figure(problem, design).axes[1]
    (area,) = (c for c in axes.collections if any(getattr(c, "hatches", ())))
    inside = area.get_paths()[0].contains_points(1e3 * machine.drawn(grid).reshape(-1, 2))
    clear = abs(worst) > 0.05 * worst.max()
    interior = np.zeros(grid.shape[:2], dtype=bool)
    interior[1:-1, 1:-1] = True
    clear &= interior.ravel()
    assert (worst[clear] > 0.0).any()
    np.testing.assert_array_equal(inside[clear], worst[clear] > 0.0)


def test_a_feasible_design_carries_no_mark_of_a_broken_limit(problem, paper):
    """At the optimum a finer sample exceeds the bound by the sampling error: still no mark."""
    design = paper.designs[0]
    axes = plots.design_figure(problem, design).axes[1]
    assert len(marks(axes, plots.STYLE["bad"])) == 0
    machine = problem.mechanism(design)
    maps = problem.drawn_maps(machine, machine.sample_poses())
    shown = maps.get(problem.objectives[0].name, next(iter(maps.values())))
    assert len(marks(axes, plots.STYLE["ink"])) == (shown.kind != "mean")


@pytest.mark.parametrize("count", [0, 1])
def test_fixed_variables_are_drawn(problem, count, design):
    names = [variable.name for variable in problem.all_variables][: len(problem.variables) - 1]
    values = problem.named(design)
    fixed = {name: values[name] for name in names[: count + 1]}
    reduced = pkm_gym.make_problem(problem.name, fixed=fixed)
    figure = plots.design_figure(reduced, reduced.reduced(problem.complete(design[None]))[0])
    whole = plots.design_figure(problem, design)
    np.testing.assert_array_equal(plots.figure_to_array(figure), plots.figure_to_array(whole))


def test_every_objective_has_a_picture(problem, designs):
    for objective in problem.all_objectives:
        other = pkm_gym.make_problem(problem.name, objective=objective.name)
        figure = plots.design_figure(other, designs["feasible"])
        bold = [t.get_text() for t in figure.texts if t.get_fontweight() == "bold"]
        value = other.evaluate(designs["feasible"][None]).objectives[0, 0]
        shown, _ = plots.shown(value, objective.unit)
        assert float(bold[-1]) == pytest.approx(shown, rel=1e-3)
        assert plots.figure_to_array(figure).std() > 10


def test_the_task_is_drawn(problem, designs):
    task = problem.unpack(problem.draw_tasks(1, np.random.default_rng(3))[0])
    figure = plots.design_figure(problem, designs["feasible"], task)
    machine = problem.mechanism(designs["feasible"], task)
    outline = next(p for p in figure.axes[0].patches if not p.get_fill()).get_xy()
    np.testing.assert_allclose(outline, 1e3 * machine.workspace(), atol=1e-9)


def test_index_maps_show_all_or_the_one_named(problem, designs, kind):
    figure = plots.index_map_figure(problem, designs[kind])
    if kind == "no machine":
        assert "dimensions" in texts(figure)
        return
    machine = problem.mechanism(designs[kind])
    maps = problem.drawn_maps(machine, machine.sample_poses())
    assert len(figure.axes) == len(maps)
    titles = [axes.get_title(loc="left") or axes.get_title() for axes in figure.axes]
    assert [title.lower() for title in titles] == [one.doc.lower() for one in maps.values()]
    one = plots.index_map_figure(problem, designs[kind], index=list(maps)[-1])
    assert len(one.axes) == 1
    assert plots.figure_to_array(one).std() > 10


def test_a_map_s_title_says_what_is_drawn_at_a_pose(problem):
    """Never the design's extreme or mean over the workspace."""
    machine = problem.mechanism(problem.printed_design())
    docs = {index.name: index.doc for index in problem.index_table}
    for name, one in problem.drawn_maps(machine, machine.sample_poses()).items():
        assert one.doc, name
        assert "worst" not in one.doc
        assert "mean" not in one.doc
        if one.kind != "mean" and name not in ("force", "thrust", "rate", "tau_G"):
            assert one.doc != docs[name]


def test_the_map_shows_the_local_indices(problem, design):
    machine = problem.mechanism(design)
    for name, index in problem.drawn_maps(machine, machine.workspace_grid(161, 33)).items():
        axes = plots.index_map_figure(problem, design, index=name).axes[0]
        values, unit = plots.shown(index.values, index.unit)
        bands = max(axes.collections, key=lambda c: len(getattr(c, "levels", ())))
        assert bands.levels[0] == pytest.approx(values.min())
        top = 3 * np.median(values) if values.min() > 1e-9 else np.inf
        assert bands.levels[-1] == pytest.approx(min(values.max(), top))
        edges = np.concatenate([path.vertices for path in bands.get_paths()])
        x, y = (1e3 * machine.workspace()).T
        assert edges[:, 0].min() == pytest.approx(x.min())
        assert edges[:, 1].max() == pytest.approx(y.max())
        assert unit in axes.child_axes[0].get_ylabel()


def test_a_pole_does_not_wash_out_the_colours(problem, designs):
    """Near the edge of the reach an index has a pole: colours end at three times its median."""
    if "unreachable" not in designs:
        pytest.skip("every design reaches its workspace")
    machine = problem.mechanism(designs["unreachable"])
    index = next(iter(problem.drawn_maps(machine, machine.workspace_grid(161, 33)).values()))
    known = index.values[np.isfinite(index.values)]
    if not len(known) or known.max() <= 3.0 * np.median(known):
        pytest.skip("its first index has no pole")
    if known.min() <= 1e-6 * np.median(known):
        pytest.skip("its first index is 0 somewhere, which stretches the colours")
    values, _ = plots.shown(index.values, index.unit)
    axes = plots.design_figure(problem, designs["unreachable"]).axes[1]
    bands = max(axes.collections, key=lambda c: len(getattr(c, "levels", ())))
    top = 3.0 * np.nanmedian(values)
    assert np.nanmax(values) > top
    assert bands.levels[-1] == pytest.approx(top)
    assert bands.extend == "max"


def test_mistakes_get_one_sentence(problem, designs):
    with pytest.raises(ValueError, match="shape"):
        plots.design_figure(problem, designs["feasible"][:-1])
    with pytest.raises(ValueError, match="task field"):
        plots.design_figure(problem, designs["feasible"], {"no_such_field": 1.0})
    machine = problem.mechanism(designs["feasible"])
    name = next(iter(problem.drawn_maps(machine, machine.sample_poses())))
    with pytest.raises(ValueError, match=f"did you mean '{name}'"):
        plots.index_map_figure(problem, designs["feasible"], index=name + "x")


def test_pictures_leave_no_global_state(problem, designs):
    before = dict(mpl.rcParams)
    plots.figure_to_array(plots.design_figure(problem, designs["infeasible"]))
    plots.figure_to_array(plots.index_map_figure(problem, designs["infeasible"]))
    assert Gcf.get_all_fig_managers() == []
    assert dict(mpl.rcParams) == before


def test_threads_draw_what_one_thread_draws(problem, designs):
    def frame(design):
        return plots.figure_to_array(plots.design_figure(problem, design))

    drawn = [designs[kind] for kind in ("feasible", "infeasible")]
    alone = [frame(design) for design in drawn]
    with ThreadPoolExecutor(2) as pool:
        together = list(pool.map(frame, 2 * drawn))
    for one, other in zip(2 * alone, together, strict=True):
        np.testing.assert_array_equal(one, other)
