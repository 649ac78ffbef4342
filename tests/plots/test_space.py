"""Maps of the design space."""

from __future__ import annotations

import numpy as np
import pytest

import pkm_gym
from pkm_gym import plots


@pytest.fixture
def cut(problem, design):
    x, y, *held = problem.variables
    named = problem.named(design)
    values = {v.name: named[v.name] for v in held}
    return plots.Slice.of(
        problem, (x.name, x.low, x.high), (y.name, y.low, y.high), values, columns=23, rows=17
    )


def test_a_slice_holds_what_evaluate_says(problem, design, cut, rng):
    for _ in range(10):
        row, column = rng.integers(17), rng.integers(23)
        values = dict(zip(problem.variable_names, design, strict=True))
        values |= {cut.x: cut.x_values[column], cut.y: cut.y_values[row]}
        alone = problem.evaluate(problem.design(values)[None])
        for index in problem.index_names:
            assert cut.index(index)[row, column] == pytest.approx(
                alone.indices[index][0], rel=1e-12, nan_ok=True
            )
        assert cut.violation()[row, column] == pytest.approx(alone.constraints.max(), rel=1e-12)


def test_a_slice_may_run_over_a_derived_dimension():
    problem = pkm_gym.make_problem("diamond", task={"payload": 1.0})
    cut = plots.Slice.of(
        problem, ("lam_l", 1.4, 2.8), ("lam_H", 0.8, 2.2), {"lam_e": 0.3}, columns=5, rows=4
    )
    design = problem.design({"lam_e": 0.3, "lam_l": 2.1, "gap": cut.y_values[2] - 2.1 + 1.0})
    expected = problem.evaluate(design[None]).indices["tau_G"][0]
    assert cut.index("tau_G")[2, 2] == pytest.approx(expected, rel=1e-12)


def test_a_slice_that_makes_no_design_is_refused(problem):
    x, y = problem.variables[:2]
    with pytest.raises(ValueError, match="unknown variable"):
        plots.Slice.of(problem, ("no_such", 0, 1), (y.name, 0, 1), {}, columns=2, rows=2)
    if len(problem.variables) > 2:
        with pytest.raises(ValueError, match="lacks"):
            plots.Slice.of(problem, (x.name, 0, 1), (y.name, 0, 1), {}, columns=2, rows=2)


def test_everything_is_drawn_on_one_panel(problem, cut):
    figure = plots.new_figure(5.0, 4.0)
    axes = plots.panel(figure, (0.15, 0.15, 0.6, 0.7), x=cut.x, y=cut.y)
    index = problem.objectives[0].name
    values, _ = plots.shown(cut.index(index), cut.unit(index))
    low, high = np.nanquantile(values, [0.05, 0.8])
    plots.draw_slice(axes, cut, index, levels=np.linspace(low, high, 9).tolist())
    plots.draw_infeasible(axes, cut)
    plots.draw_valley(axes, cut, index)
    plots.draw_bounds(axes, cut, index, np.linspace(low, high, 4)[1:3].tolist())
    plots.mark(axes, {"paper 1": (cut.x_values[3], cut.y_values[5]), "mine": (0.0, 0.0)})
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels[-2:] == ["paper 1", "mine"]
    assert len(labels) == 4
    assert plots.figure_to_array(figure).std() > 10


def test_a_bound_runs_where_the_index_has_its_value():
    cut = plots.Slice.of(
        pkm_gym.make_problem("diamond"), ("lam_l", 1.4, 2.6), ("lam_H", 0.9, 2.2), {"lam_e": 0.3},
        columns=121, rows=121,
    )  # fmt: skip
    axes = plots.new_figure(3.0, 3.0).add_subplot()
    plots.draw_bounds(axes, cut, "sigma_max", [1.7])
    points = np.concatenate([path.vertices for path in axes.collections[0].get_paths()])
    diamond = cut.evaluation.problem
    designs = np.column_stack(
        [np.full(len(points), 0.3), points[:, 0], points[:, 1] - points[:, 0] + 1.0]
    )
    found = diamond.evaluate(designs).indices["sigma_max"]
    np.testing.assert_allclose(found, 1.7, atol=0.01)


def test_the_valley_is_the_least_of_each_column(cut, problem):
    axes = plots.new_figure(3.0, 3.0).add_subplot()
    index = problem.objectives[0].name
    plots.draw_valley(axes, cut, index)
    x, y = axes.lines[0].get_data()
    values = cut.index(index)
    for u, v in zip(x, y, strict=True):
        column, row = np.argmin(abs(cut.x_values - u)), np.argmin(abs(cut.y_values - v))
        assert values[row, column] == np.nanmin(values[:, column])
