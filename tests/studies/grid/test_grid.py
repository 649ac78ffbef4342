"""The paper's grid or ours: the atlas holds what ``evaluate`` says, the study its best designs."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray
from optuna_dashboard import get_note

import pkm_gym
from pkm_gym.studies.cli.tasks import task_folder
from pkm_gym.studies.grid.atlas import atlas, save_atlas
from pkm_gym.studies.grid.designs import (
    LARGEST,
    grid_designs,
    grid_in_words,
    grid_name,
    steps_in_words,
)
from pkm_gym.studies.grid.grid import LOGGED, evaluate_grid, grid
from pkm_gym.studies.storage.storages import default_storage, open_storage
from pkm_gym.studies.storage.studies import finished, load_study

pytestmark = pytest.mark.usefixtures("undrawn")


def stored(name="diamond-grid"):
    return load_study(open_storage(default_storage("diamond")), name)


def test_a_cell_of_the_atlas_is_what_evaluate_says_of_its_design(diamond, rng):
    grid(diamond, command="pkm-gym grid diamond")
    with xarray.open_dataset("runs/diamond/grid.nc") as dataset:
        dataset.load()
    assert dataset.sizes["lam_e"] * dataset.sizes["lam_l"] * dataset.sizes["gap"] == len(
        diamond.grid()
    )
    for design in diamond.grid()[rng.integers(0, len(diamond.grid()), 50)]:
        cell = dataset.sel(dict(zip(diamond.variable_names, design, strict=True)))
        alone = diamond.evaluate(design[None])
        for name, values in alone.indices.items():
            np.testing.assert_allclose(cell[name], values[0], rtol=1e-12)
        for name, value in zip(diamond.constraint_names, alone.constraints[0], strict=True):
            limit = cell["constraints"].sel(constraint=name)
            np.testing.assert_allclose(limit, value, rtol=1e-12, atol=1e-15)
        assert bool(cell["feasible"]) == alone.feasible[0]
        np.testing.assert_allclose(cell["merit"], alone.merit[0], rtol=1e-12)


def test_the_atlas_says_what_it_is(diamond):
    dataset = atlas(evaluate_grid(diamond), "pkm-gym grid diamond")
    assert dataset.attrs["hash"] == diamond.hash()
    assert diamond.task_type(**json.loads(dataset.attrs["task"])) == diamond.task
    assert dataset.attrs["command"] == "pkm-gym grid diamond"
    assert dataset["tau_G"].attrs["units"] == "N m/(m/s^2)"
    assert dataset["sigma_max"].attrs["units"] == "1"
    assert dataset["feasible"].dtype == bool
    assert int(dataset["feasible"].sum()) == int(evaluate_grid(diamond).feasible.sum())


def test_a_grid_with_a_hole_has_nan_there(diamond):
    designs = np.array([[0.6, 2.5, 0.4], [0.6, 2.6, 0.4], [0.7, 2.5, 0.4]])
    dataset = atlas(diamond.evaluate(designs))
    hole = dataset.sel(lam_e=0.7, lam_l=2.6, gap=0.4)
    assert np.isnan(hole["tau_G"])
    assert np.isnan(hole["merit"])
    assert not hole["feasible"]


def test_a_fixed_variable_is_no_dimension():
    problem = pkm_gym.make_problem("diamond", fixed={"lam_e": 0.6})
    dataset = atlas(evaluate_grid(problem))
    assert set(dataset.sizes) == {"lam_l", "gap", "constraint"}
    assert json.loads(dataset.attrs["fixed"]) == {"lam_e": 0.6}


def test_the_study_gets_the_best_feasible_designs_once(diamond):
    evaluation = grid(diamond)
    grid(diamond)
    trials = finished(stored())
    feasible = np.flatnonzero(evaluation.feasible)
    best = np.sort(evaluation.objectives[feasible, 0])[:LOGGED]
    np.testing.assert_array_equal([t.value for t in trials], best)
    assert stored().best_value == best[0]
    for trial in trials[:5]:
        alone = diamond.evaluate(np.array([list(trial.params.values())]))
        assert alone.objectives[0, 0] == pytest.approx(trial.value, rel=1e-12)
        assert all(value <= 0.0 for value in trial.constraints.values())
        assert trial.user_attrs["feasible"] is True
    assert "best of our grid" in get_note(stored())


def test_a_study_that_was_cut_short_is_completed(diamond, monkeypatch):
    with monkeypatch.context() as short:
        short.setattr("pkm_gym.studies.grid.grid.LOGGED", 57)
        grid(diamond)
    first = [(t.number, t.params) for t in finished(stored())]
    assert len(first) == 57
    evaluation = grid(diamond)
    trials = finished(stored())
    assert [(t.number, t.params) for t in trials][:57] == first
    best = np.sort(evaluation.objectives[evaluation.feasible, 0])[:LOGGED]
    np.testing.assert_array_equal([t.value for t in trials], best)


def test_without_a_feasible_design_the_atlas_is_written_and_the_study_empty():
    problem = pkm_gym.make_problem("diamond", task={"sigma_low": 1.2, "sigma_high": 1.2})
    assert not grid(problem).feasible.any()
    assert (task_folder(problem) / "grid.nc").exists()
    assert finished(stored()) == []


def test_a_study_of_another_task_is_refused_and_the_atlas_kept(diamond):
    grid(diamond)
    before = Path("runs/diamond/grid.nc").read_bytes()
    with pytest.raises(ValueError, match="stands for another problem"):
        grid(pkm_gym.make_problem("diamond", task={"payload": 1.0}))
    assert Path("runs/diamond/grid.nc").read_bytes() == before


def test_a_space_without_grid_designs_is_refused():
    problem = pkm_gym.make_problem("diamond", fixed={"lam_e": 0.55})
    with pytest.raises(ValueError, match=r"no design of our grid .* lam_e = 0\.55"):
        grid(problem)


def test_where_the_paper_has_no_grid_ours_spans_the_bounds(problem):
    if problem.grid() is not None:
        pytest.skip("there is a grid over the paper's ranges")
    assert grid_name(problem) == "our grid"
    parts = 8.5 if len(problem.variables) < 8 else 2.5
    step = float((problem.high - problem.low).max() / parts)
    designs = grid_designs(problem, step)
    axes = [np.unique(column) for column in designs.T]
    assert len(designs) == np.prod([len(axis) for axis in axes])
    for axis, low, high in zip(axes, problem.low, problem.high, strict=True):
        np.testing.assert_allclose(np.diff(axis), step, rtol=1e-9)
        assert axis[0] == low
        assert high - step < axis[-1] <= high
    dataset = atlas(evaluate_grid(problem, step))
    shape = tuple(len(axis) for axis in axes)
    assert dataset[problem.objectives[0].name].shape == shape


def test_the_grid_of_a_study_can_be_evaluated(problem):
    assert 1 < len(grid_designs(problem)) <= LARGEST


def test_the_steps_that_no_paper_prints_are_the_declared_ones(problem):
    designs = problem.grid()
    if designs is None:
        assert not any(variable.scanned for variable in problem.all_variables)
        return
    for variable, column in zip(problem.variables, designs.T, strict=True):
        values = np.unique(column.round(9))
        assert variable.scanned or np.allclose(np.diff(values), variable.step, rtol=1e-6)


def test_a_grid_is_the_papers_as_far_as_it_prints_it(diamond):
    said = "our grid (the paper's values of lam_e, a step of lam_l 0.02, gap 0.02)"
    assert grid_in_words(diamond) == said
    assert grid_in_words(pkm_gym.make_problem("pus6")) == "the paper's grid"
    assert grid_in_words(diamond, 0.1) == "our grid (a step of 0.1 over the bounds)"
    leg = pkm_gym.make_problem("stroke_leg", free=("l3", "th3", "gamma"))  # gamma has no range
    said = "our grid (a step of l3 10.0 mm, th3 5.00 deg over the paper's ranges)"
    assert grid_in_words(leg) == said


def test_a_step_replaces_the_papers_grid(diamond):
    assert grid_name(diamond) == "our grid"
    assert grid_name(pkm_gym.make_problem("pus6")) == "the paper's grid"
    assert grid_name(diamond, 0.1) == "our grid"
    assert len(grid_designs(diamond, 0.1)) == 6 * 25 * 7


@pytest.mark.parametrize(
    ("step", "said"),
    [
        (0.0, "step is 0: it must be finite and > 0"),
        (-1.0, "step is -1: it must"),
        (np.nan, "step is nan: it must"),
        (1e-4, "makes 45,513,501 designs: choose a larger one, for at most 1,000,000"),
    ],
)
def test_a_step_that_makes_no_grid_is_refused(step, said):
    with pytest.raises(ValueError, match=said):
        grid_designs(pkm_gym.make_problem("spr3"), step)


def test_the_grid_of_another_step_is_another_study():
    problem = pkm_gym.make_problem("spr3")
    for step in (0.05, 0.1):
        evaluation = grid(problem, step=step)
        storage = open_storage(default_storage("spr3"))
        study = load_study(storage, f"spr3-grid-{step}")
        feasible = evaluation.objectives[evaluation.feasible, 0]
        assert study.best_value == feasible.max()
        assert [t.value for t in finished(study)] == sorted(feasible, reverse=True)[:LOGGED]
        assert "best of our grid" in get_note(study)


def test_an_atlas_that_cannot_be_written_leaves_the_old_one(diamond, monkeypatch, tmp_path):
    path = tmp_path / "old.nc"
    path.write_bytes(b"old")
    dataset = atlas(diamond.evaluate(diamond.grid()[:1]))

    def fail(*_, **__):
        raise OSError("disk full")

    monkeypatch.setattr(xarray.Dataset, "to_netcdf", fail)
    with pytest.raises(OSError, match="disk full"):
        save_atlas(dataset, path)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir() if "old" in p.name] == ["old.nc"]


def test_each_variable_has_its_own_step_unless_one_is_given():
    problem = pkm_gym.make_problem("spr3", bounds={"r1": (0.2, 0.4), "r3": (1.2, 1.4)})
    steps = {"r1": 0.1, "r3": 0.05}
    problem.variables = tuple(replace(v, step=steps[v.name]) for v in problem.variables)
    r1, r3 = (np.unique(column) for column in grid_designs(problem).T)
    np.testing.assert_allclose(r1, [0.2, 0.3, 0.4])
    np.testing.assert_allclose(r3, [1.2, 1.25, 1.3, 1.35, 1.4])
    assert steps_in_words(problem) == "r1 0.1, r3 0.05"
    assert len(grid_designs(problem, 0.2)) == 4
    assert steps_in_words(problem, 0.2) == "0.2"
