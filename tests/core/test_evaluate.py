"""Properties of ``evaluate`` that hold for every problem."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from pkm_gym.core import compile as compiling
from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.limit import Limit
from pkm_gym.core.merit import NO_MACHINE, TOLERANCE
from pkm_gym.core.problem import DesignProblem


def assert_same(one: Any, other: Any, rtol: float = 0.0) -> None:
    for name in one.indices:
        np.testing.assert_array_equal(one.indices[name], other.indices[name], err_msg=name)
    np.testing.assert_array_equal(one.constraints, other.constraints)
    np.testing.assert_allclose(one.log_merit, other.log_merit, rtol=rtol)


def test_evaluate_is_deterministic(
    problem: DesignProblem, spread: Any, rng: np.random.Generator
) -> None:
    designs, tasks = spread(problem, rng, 500)
    assert_same(problem.evaluate(designs, tasks), problem.evaluate(designs, tasks))


def test_evaluate_leaves_its_arguments_alone(
    problem: DesignProblem, spread: Any, rng: np.random.Generator
) -> None:
    designs, tasks = spread(problem, rng, 20)
    before = designs.copy(), tasks.copy()
    problem.evaluate(designs, tasks)
    np.testing.assert_array_equal(designs, before[0])
    np.testing.assert_array_equal(tasks, before[1])


def test_serial_and_parallel_kernels_agree(
    problem: DesignProblem,
    spread: Any,
    rng: np.random.Generator,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    designs, tasks = spread(problem, rng, 300)
    monkeypatch.setattr(compiling, "SERIAL_WORK", np.inf)
    serial = problem.evaluate(designs, tasks)
    monkeypatch.setattr(compiling, "SERIAL_WORK", 0.0)
    parallel = problem.evaluate(designs, tasks)
    assert_same(serial, parallel, rtol=1e-14)  # penalties may be added in another order


def test_a_batch_of_designs_equals_single_designs(
    problem: DesignProblem, spread: Any, rng: np.random.Generator
) -> None:
    designs, tasks = spread(problem, rng, 200)
    batch = problem.evaluate(designs, tasks)
    for i in range(len(designs)):
        single = problem.evaluate(designs[i : i + 1], tasks[i : i + 1])
        for name, values in single.indices.items():
            assert values[0] == pytest.approx(
                batch.indices[name][i], rel=1e-15, abs=0.0, nan_ok=True
            )
        np.testing.assert_allclose(single.constraints[0], batch.constraints[i], rtol=1e-15)
        np.testing.assert_allclose(single.log_merit[0], batch.log_merit[i], rtol=1e-14)


def test_one_task_for_all_equals_its_rows(
    problem: DesignProblem, spread: Any, rng: np.random.Generator
) -> None:
    designs, tasks = spread(problem, rng, 50)
    task = problem.unpack(tasks[0])
    for given in (task, problem.pack(task)[None], np.repeat(tasks[:1], 50, axis=0)):
        assert_same(problem.evaluate(designs, tasks[:1]), problem.evaluate(designs, given))


def test_what_is_out_of_reach_is_undefined_and_its_constraints_say_by_how_much(
    problem: DesignProblem, spread: Any, rng: np.random.Generator
) -> None:
    designs, tasks = spread(problem, rng, 5000)
    designs[2500:] *= rng.uniform(0.05, 3.0, (2500, designs.shape[1]))  # and all around the box
    evaluation = problem.evaluate(designs, tasks)
    outside = (evaluation.unreached > 0.0) & (evaluation.unreached < NO_MACHINE)
    assert 10 < outside.sum() < 4750
    np.testing.assert_array_equal(np.isnan(evaluation.objectives[:, 0]), evaluation.unreached > 0.0)
    for objective in problem.all_objectives:
        assert np.isnan(evaluation.quantity(objective.name)[outside]).all(), objective.name
    missing = 1.0 + evaluation.unreached[outside] - TOLERANCE
    for column, limit in enumerate(problem.declared.constraints):
        if isinstance(limit, Limit) and limit.quantity not in problem.variable_names:
            undefined = np.isnan(evaluation.quantity(limit.quantity)[outside])
            np.testing.assert_array_equal(~evaluation.defined[outside, column], undefined)
            told = evaluation.constraints[outside, column]
            np.testing.assert_array_equal(told[undefined], missing[undefined])
    worst = evaluation.constraints[outside].max(axis=1)
    assert ((worst > 0.0) | (evaluation.unreached[outside] < 1e-5)).all()


def test_dimensionless_indices_keep_their_value_in_another_size(
    family_problem: DesignProblem, usable: Evaluation, broken: Evaluation
) -> None:
    whole = type(family_problem)(free="all")
    designs = family_problem.complete(np.concatenate([usable.designs, broken.designs]))
    tasks = np.concatenate([usable.tasks, broken.tasks])
    sizes = [
        np.array([1.1 if item.unit == "m" else 1.0 for item in items])
        for items in (whole.variables, whole.task_variables)
    ]
    legal = np.array([item.legal_high for item in whole.task_variables])
    kept = (tasks * sizes[1] <= legal).all(axis=1)
    assert kept.sum() > 20
    one = whole.evaluate(designs[kept], tasks[kept])
    other = whole.evaluate(designs[kept] * sizes[0], tasks[kept] * sizes[1])
    for index in whole.index_table:
        if index.unit in ("", "rad") and not index.compared:
            np.testing.assert_allclose(
                one.indices[index.name], other.indices[index.name], rtol=1e-12, err_msg=index.name
            )


def test_indices_are_the_extremes_of_their_maps_or_means_within_them(
    family_problem: DesignProblem, usable: Evaluation
) -> None:
    for i in range(20):
        machine = family_problem.mechanism(usable.designs[i], usable.task(i))
        maps = family_problem.drawn_maps(machine, machine.workspace_grid(201, 81))
        for name, index in maps.items():
            value, low, high = usable.indices[name][i], index.values.min(), index.values.max()
            if index.kind == "mean":
                section = len(machine.pose_names) > 3  # of a workspace that it says too little of
                assert section or low < value < high, name
            else:
                assert value == pytest.approx(high if index.kind == "max" else low, rel=2e-3), name


def test_local_violations_say_where_a_constraint_is_broken(
    family_problem: DesignProblem, broken: Evaluation
) -> None:
    for i in np.flatnonzero(broken.unreached == 0.0)[:20]:
        task = broken.task(i)
        machine = family_problem.mechanism(broken.designs[i], task)
        poses = machine.workspace_grid(201, 81)
        maps = family_problem.index_maps(machine, poses)
        drawn = {
            limit.name
            for limit in family_problem.declared.constraints
            if isinstance(limit, Limit) and limit.quantity in maps and maps[limit.quantity].drawn
        }
        local = family_problem.local_violations(machine, poses, task)
        assert drawn <= set(local)
        for name, values in local.items():
            constraint = broken.constraints[i, family_problem.constraint_names.index(name)]
            if name in drawn:
                assert constraint == pytest.approx(values.max(), abs=3e-3), name
            else:
                assert values.max() <= constraint + 2e-6, name


def test_every_index_objective_and_task_field_is_documented(problem: DesignProblem) -> None:
    for item in (*problem.index_table, *problem.task_variables, *problem.all_variables):
        assert item.doc
    assert {objective.name for objective in problem.objectives} <= set(problem.index_names)


def test_the_grid_lies_in_the_box(problem: DesignProblem) -> None:
    grid = problem.grid()
    if grid is None:
        pytest.skip("the paper has no grid")
    assert grid.shape[1] == len(problem.variables)
    assert ((grid >= problem.low) & (grid <= problem.high)).all()
    assert len(np.unique(grid, axis=0)) == len(grid)


def test_the_mechanism_has_the_derived_dimensions(
    problem: DesignProblem, spread: Any, rng: np.random.Generator
) -> None:
    designs, tasks = spread(problem, rng, 40)
    machines = problem.evaluate(designs, tasks).unreached < NO_MACHINE
    for design, row in zip(designs[machines], tasks[machines], strict=True):
        task = problem.unpack(row)
        derived = problem.derived(design, task)
        assert tuple(derived) == tuple(problem.declared.dimensions)
        machine = problem.mechanism(design, task)
        for name, (value, _) in derived.items():
            assert value == pytest.approx(getattr(machine, name, value), rel=1e-15)


def test_derived_dimensions_lead_back_to_the_design(
    problem: DesignProblem, spread: Any, rng: np.random.Generator
) -> None:
    designs, tasks = spread(problem, rng, 40)
    machines = problem.evaluate(designs, tasks).unreached < NO_MACHINE
    assert machines.sum() > 5
    for design, row in zip(designs[machines], tasks[machines], strict=True):
        task = problem.unpack(row)
        named = problem.named(design)
        lengths = {
            name: value for name, (value, unit) in problem.derived(design, task).items() if unit
        } or named
        values, changed = problem.from_dimensions(lengths, task)
        assert len(values) + len(changed) == len(lengths)  # of others, angles, they say nothing
        np.testing.assert_allclose(problem.design({**named, **values}), design, rtol=1e-12)
        for name, value in changed.items():
            assert value == pytest.approx(getattr(task, name), rel=1e-12)
