"""Rounding: on the lattice, feasible, and none better beside it."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.solve import solve_tasks
from pkm_gym.core.units import WRITTEN, converted
from pkm_gym.studies.buildable.dimensions import Dimensions, settled_by
from pkm_gym.studies.buildable.lattice import lattice
from pkm_gym.studies.buildable.rounding import round_design
from pkm_gym.studies.cli.arguments import design_from
from pkm_gym.studies.cli.design_file import write_design

STEPS = {"m": "1mm", "rad": "0.5deg"}
POINTS = 600


@pytest.fixture(scope="session")
def axes(problem, optimum):
    """A lattice of what is built of each problem, of its other variables where that is nothing."""
    dimensions = Dimensions(problem, optimum)
    units = dimensions.units
    steps = [STEPS[unit] for unit in sorted({*units.values()} & {*STEPS})]
    if not {"m", "rad"} & {units[name] for name in dimensions.searched}:
        steps += [f"{name}=0.01" for name in dimensions.searched]
    return lattice(units, steps)


@pytest.fixture(scope="session")
def found(problem, optimum, axes):
    return round_design(problem, optimum, axes, points=POINTS)


def coordinates(found):
    """What a shop reads off the answer: derived dimensions and variables."""
    problem, design = found.best.problem, found.best.designs[0]
    derived = {name: value for name, (value, _) in problem.derived(design).items()}
    return problem.named(design) | derived


def test_the_answer_lies_on_the_lattice(found, axes):
    built = coordinates(found)
    for name in found.lattice:
        axis = axes[name]
        number, unit = converted(built[name], axis.unit)
        nearest = round(number / axis.step) * axis.step / WRITTEN.get(axis.unit, {}).get(unit, 1.0)
        assert built[name] == pytest.approx(nearest, rel=1e-12, abs=1e-15)
        assert built[name] == pytest.approx(found.dimensions[name][1], rel=1e-12, abs=1e-15)


def test_the_answer_is_feasible_and_read_back_as_it_is(problem, found, tmp_path):
    assert found.best.feasible[0]
    path = write_design(tmp_path / "design.toml", found.best, "")
    given = design_from(problem.name, file=path)
    again = given.problem.evaluate(given.design[None], given.task)
    assert again.feasible[0]
    assert again.objectives[0, 0] == found.best.objectives[0, 0]


def test_no_neighbour_is_feasible_and_better(problem, optimum, found, axes):
    """By brute force, a step of one dimension and of two, for the same task."""
    dimensions = Dimensions(problem, optimum)
    moved = [n for n in found.lattice if n in dimensions.searched]
    ways = [(n, way) for n in moved for way in (-1, 1)]
    built = coordinates(found)
    rows = []
    for steps in [[w] for w in ways] + [list(pair) for pair in combinations(ways, 2)]:
        point = {name: built[name] for name in dimensions.names}
        for name, way in steps:
            point[name] += way * axes[name].pitch
        for name, source in problem.following.items():
            point[name] = point[source]
        rows.append([point[name] for name in dimensions.names])
    evaluation = dimensions.evaluate(np.array(rows))
    span = problem.high - problem.low
    designs = problem.reduced(evaluation.designs)
    inside = ((designs > problem.low - 1e-6 * span) & (designs < problem.high + 1e-6 * span)).all(1)
    same = np.isclose(evaluation.tasks, problem.pack(found.best.problem.task), rtol=1e-9).all(1)
    sign = problem.objectives[0].sign
    better = sign * evaluation.objectives[:, 0] < sign * found.best.objectives[0, 0] - 1e-12
    assert not (better & evaluation.feasible & inside & same).any()


def test_the_cost_is_that_of_the_objective(problem, found):
    before, after = found.start.objectives[0, 0], found.best.objectives[0, 0]
    worse = (
        after / before - 1.0
        if problem.objectives[0].direction == "minimise"
        else 1.0 - after / before
    )
    assert found.cost == pytest.approx(worse, abs=1e-12)
    assert found.examined <= 2 * POINTS


def test_limits_that_are_touched_break_by_that_step(problem, optimum, found, axes):
    dimensions = Dimensions(problem, optimum)
    built = coordinates(found)
    for limit, steps in found.touched.items():
        for name, way in steps:
            point = built | {name: built[name] + way * axes[name].pitch}
            point |= {k: point[source] for k, source in problem.following.items()}
            row = np.array([[point[k] for k in dimensions.names]])
            at = problem.constraint_names.index(limit)
            assert dimensions.evaluate(row).constraints[0, at] > 0.0


@pytest.fixture(scope="module")
def best():
    """The recorded optimum of a problem whose variables are ratios."""
    problem = pkm_gym.make_problem("diamond")
    return problem, problem.design(problem.reference.optima["tau_G"].design)


def test_the_window_is_searched_as_by_brute_force(best):
    problem, design = best
    found = round_design(
        problem, design, lattice({**dict.fromkeys(("e", "l1", "l2", "H"), "m")}, ["1mm"])
    )
    before = {name: 1e3 * pair[0] for name, pair in found.dimensions.items()}
    ranges = [
        range(
            int(np.floor(before[n])) + 1 - found.reach, int(np.floor(before[n])) + 1 + found.reach
        )
        for n in ("e", "l2", "H")
    ]
    e, l2, H = np.array(list(product(*ranges))).T * 1e-3
    l1 = 0.4 - e  # the task's delta
    kept = (1e3 * l1 > before["l1"] - found.reach) & (1e3 * l1 < before["l1"] + found.reach)
    designs = np.stack([e / l1, l2 / l1, (H - l2) / l1 + 1.0], axis=1)[kept]
    evaluation = problem.evaluate(designs)
    assert kept.sum() == found.window
    brute = evaluation.objectives[evaluation.feasible, 0].min()
    assert found.best.objectives[0, 0] <= brute * (1.0 + 1e-12)
    assert found.best.objectives[0, 0] >= found.start.objectives[0, 0]


def test_a_task_whose_size_is_off_the_lattice_is_met_within_half_a_step():
    problem = pkm_gym.make_problem("diamond", task={"b": 0.801})  # e + l1 = 400.5 mm
    design = problem.design(pkm_gym.make_problem("diamond").reference.optima["tau_G"].design)
    found = round_design(
        problem, design, lattice(dict.fromkeys(("e", "l1", "l2", "H"), "m"), ["1mm"])
    )
    (asked, built) = settled_by(problem, found.best.problem.task)["delta"]
    assert asked == 1.0
    assert built != 1.0
    assert found.dimensions["e"][1] + found.dimensions["l1"][1] == pytest.approx(
        0.4005, abs=0.00051
    )
    assert found.best.feasible[0]


def test_values_in_stock_move_the_others(best):
    problem, design = best
    axes = lattice(dict.fromkeys(("e", "l1", "l2", "H"), "m"), ["1mm"], ["l1=240mm,260mm,300mm"])
    found = round_design(problem, design, axes)
    assert found.best.feasible[0]
    assert found.dimensions["l1"][1] == 0.26
    # no worse than the best with the ratio that this length means
    held = pkm_gym.make_problem("diamond", fixed={"lam_e": 0.14 / 0.26})
    least = solve_tasks(held, held.pack(None)[None]).optima[0]
    assert least <= found.best.objectives[0, 0] <= 1.002 * least


def test_what_is_no_machine_or_no_dimension_is_refused(best):
    problem, design = best
    axes = lattice({"l1": "m"}, ["1mm"])
    with pytest.raises(ValueError, match="make no machine"):
        round_design(problem, -design, axes)
    with pytest.raises(ValueError, match="unknown dimension 'l9'"):
        round_design(problem, design, {"l9": axes["l1"]})
    with pytest.raises(ValueError, match="choose finer steps"):
        round_design(
            problem, design, lattice(dict.fromkeys(("e", "l1"), "m"), [], ["e=1m", "l1=2m"])
        )


def test_a_lattice_without_a_feasible_point_says_what_its_best_breaks(best):
    problem, design = best
    units = dict.fromkeys(("e", "l1", "l2", "H"), "m")
    axes = lattice(units, [], ["e=150mm", "l1=250mm", "l2=350mm", "H=175mm,180mm"])
    found = round_design(problem, design, axes)
    assert not found.best.feasible[0]
    assert found.best.explain(0)
    assert found.examined == 2
