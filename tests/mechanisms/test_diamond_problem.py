"""The Diamond's design problem against the printed numbers and an independent optimiser."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import differential_evolution

import pkm_gym
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.reference import Optimum, Reference, Value
from pkm_gym.core.solve import Solutions, solve_tasks
from pkm_gym.mechanisms.diamond import figures as diamond_figures
from pkm_gym.mechanisms.diamond.dynamics import INERTIA_NAMES, lumped_inertia
from pkm_gym.mechanisms.diamond.findings import INTERVALS
from pkm_gym.mechanisms.diamond.masses import numbers, presets
from pkm_gym.mechanisms.diamond.problem import SCAN

REFERENCE = Reference.load("pkm_gym.mechanisms.diamond")
PAGE = (Path(__file__).parents[2] / "docs" / "mechanisms" / "diamond.md").read_text()
OPTIMA = list(REFERENCE.optima.values())


def valued(kind: str) -> list[Value]:
    return [value for value in REFERENCE.values.values() if value.kind == kind]


def named(item: Any) -> str:
    return str(item.name)


@pytest.fixture(scope="module")
def diamond() -> DesignProblem:
    return pkm_gym.make_problem("diamond", cycle=True)


def problem_of(optimum: Optimum) -> DesignProblem:
    return pkm_gym.make_problem("diamond", objective=optimum.objective, fixed=optimum.fixed)


# Printed numbers ----------------------------------------------------------------------------------


def test_every_kind_of_value_is_checked_here() -> None:
    kinds = {value.kind for value in REFERENCE.values.values()}
    assert kinds == {"index", "dimension", "optimum", *INPUTS}


def task_numbers(problem: DesignProblem) -> dict[str, float]:
    task: Any = problem.task
    return {**vars_of(task), "h": task.h_ratio * task.b}


def vars_of(task: Any) -> dict[str, float]:
    return {name: getattr(task, name) for name in task.names()}


def family_numbers(problem: DesignProblem) -> dict[str, float]:
    ranges = {field.name: field for field in problem.task_variables}
    low, high = (getattr(ranges["h_ratio"], end) for end in ("low", "high"))
    return {"h_ratio_low": low, "h_ratio_high": high}


def scan_numbers(problem: DesignProblem) -> dict[str, float]:
    """What the figures draw."""
    del problem
    drawn = {"fig5_6": SCAN.fig5_6}
    rows = {"fig7": diamond_figures.PRINTED}
    rows |= {name: getattr(SCAN, name) for name in ("fig4", "b_l", "b_u")}
    return drawn | {f"{k}_{i}": x for k, row in rows.items() for i, x in enumerate(row, 1)}


def interval_numbers(problem: DesignProblem) -> dict[str, float]:
    wide = pkm_gym.make_problem(problem.name, fixed={"lam_e": SCAN.lam_e[-1]})
    rows = [wide.pack({"sigma_low": a, "sigma_high": b}) for a, b in INTERVALS]
    (at,) = np.flatnonzero(solve_tasks(wide, np.array(rows)).solvable)
    return dict(zip(("interval_low", "interval_high"), INTERVALS[at], strict=True))


def machine_numbers(problem: DesignProblem) -> dict[str, float]:
    machine: Any = problem.mechanism(problem.printed_design())
    return {"I_A": machine.I_A, "m": machine.m}


INPUTS = {
    "design": lambda problem: problem.named(problem.printed_design()),
    "task": task_numbers,
    "family": family_numbers,
    "inertia": lambda problem: REFERENCE.data["inertia"][problem.options.inertia],
    "scan": scan_numbers,
    "interval": interval_numbers,
    "machine": machine_numbers,
}


@pytest.mark.parametrize("kind", INPUTS)
def test_numbers_are_what_the_reference_says(diamond: DesignProblem, kind: str) -> None:
    ours = INPUTS[kind](diamond)
    for value in valued(kind):
        assert ours[value.name] == pytest.approx(value.ours, rel=value.tolerance), value.name


@pytest.mark.parametrize(
    ("I_A", "m", "tau_G"),
    [
        (0.0420, 0.795572, 0.3914),  # at the printed mass
        (0.0450, 0.751, 0.3914),  # if the optimum is to lie there too
        (0.02936850 + 0.2 * 0.25**2, 0.795572, 0.3911),  # m_d = 0.62
        (0.0450323, 0.752436, 0.3922),  # half the rod shares, 4/3 for the arm
    ],
)
def test_what_the_printed_torque_would_need(
    diamond: DesignProblem, I_A: float, m: float, tau_G: float
) -> None:
    machine = replace(diamond.mechanism(diamond.printed_design()), I_A=I_A, m=m)
    found = machine.local_indices(machine.workspace_grid(401, 41))["tau"].max()
    assert found == pytest.approx(tau_G, abs=3e-4)


def test_no_literal_reading_of_the_inertia_tables_gives_the_printed_torque(
    diamond: DesignProblem,
) -> None:
    machine: Any = diamond.mechanism(diamond.printed_design())
    printed = presets()["printed"]
    poses, found = machine.workspace_grid(101, 21), []
    for arm, elbow, platform in product(
        (1 / 12, 1 / 3), (2 / 9, 1 / 3, 2 / 3, 1.0, 4 / 3, 2.0), (2 / 3, 1.0, 4 / 3, 2.0)
    ):
        inertia = replace(printed, arm=arm, rod_elbow=elbow, rod_platform=platform)
        row = np.array(numbers(inertia, INERTIA_NAMES))
        I_A, m, _ = lumped_inertia(machine.l1, machine.l2, 0.0, row)
        found.append(replace(machine, I_A=I_A, m=m).local_indices(poses)["tau"].max())
    least, most = (f"{end(found):.3f}" for end in (min, max))
    said = f"all {len(found)} literal readings of the inertia tables give {least} to {most}"
    assert said in " ".join(PAGE.split())
    assert max(found) < 0.95 * REFERENCE.values["tau_G"].printed


@pytest.mark.parametrize(
    ("preset", "tau_G"), [("printed", 0.34440), ("uniform-arm", 0.35487), ("static", 0.36001)]
)
def test_torque_index_of_each_preset(preset: str, tau_G: float) -> None:
    problem = pkm_gym.make_problem("diamond", inertia=preset)
    found = problem.evaluate(problem.printed_design()[None]).indices["tau_G"][0]
    assert found == pytest.approx(tau_G, abs=5e-6)
    shown = f"| {tau_G:.5f} |"
    assert any(f"`{preset}`" in line and shown in line for line in PAGE.splitlines())


@pytest.mark.parametrize("value", valued("index"), ids=named)
def test_indices_of_the_printed_design(diamond: DesignProblem, value: Value) -> None:
    indices = diamond.evaluate(diamond.printed_design()[None]).indices
    assert indices[value.name][0] == pytest.approx(value.ours, rel=1e-7)


@pytest.mark.parametrize("value", valued("dimension"), ids=named)
def test_dimensions_of_the_printed_design(diamond: DesignProblem, value: Value) -> None:
    dimension = diamond.derived(diamond.printed_design())[value.name]
    assert dimension.unit == value.unit
    assert dimension.value == pytest.approx(value.ours, rel=1e-12)


@pytest.mark.parametrize("value", valued("optimum"), ids=named)
def test_coordinates_of_the_optimum_at_the_printed_spacing(value: Value) -> None:
    optimum = REFERENCE.optima["tau_G_at_printed_lam_e"]
    coordinates = {**optimum.design, "lam_H": optimum.design["lam_l"] - 1.0 + optimum.design["gap"]}
    assert coordinates[value.name] == pytest.approx(value.ours, rel=1e-7)


@pytest.mark.parametrize("value", [v for v in REFERENCE.values.values() if v.printed], ids=named)
def test_a_verdict_says_whether_the_printed_number_comes_out(value: Value) -> None:
    within = value.ours == pytest.approx(value.printed, rel=value.tolerance)
    assert within == value.verdict.startswith("reproduced")


def test_the_printed_design_is_feasible(diamond: DesignProblem) -> None:
    assert diamond.evaluate(diamond.printed_design()[None]).feasible[0]


def test_the_uniform_arm_preset_differs_in_inertia_alone(diamond: DesignProblem) -> None:
    uniform = pkm_gym.make_problem("diamond", cycle=True, inertia="uniform-arm")
    one, other = (p.evaluate(p.printed_design()[None]).indices for p in (diamond, uniform))
    for name in one:
        moved = name in ("tau_G", "tau_peak", "tau_rms", "power_peak")
        assert (one[name][0] != other[name][0]) == moved


@pytest.mark.parametrize("preset", REFERENCE.data["inertia"])
def test_the_torque_index_follows_from_the_inertia_tables(preset: str) -> None:
    problem = pkm_gym.make_problem("diamond", inertia=preset, task={"payload": 0.7})
    table = REFERENCE.data["inertia"][preset]
    machine: Any = problem.mechanism(problem.printed_design())
    l1, l2 = machine.l1, machine.l2
    elbow = table["m_d"] + table["rod_elbow"] * table["mu2"] * l2
    I_A = table["motor"] + table["arm"] * table["mu1"] * l1**3 + elbow * l1**2
    m = table["m_p"] + table["rod_platform"] * table["mu2"] * l2 + 0.7
    assert pytest.approx(I_A, rel=1e-12) == machine.I_A
    assert machine.m == pytest.approx(m, rel=1e-12)
    assert machine.mr_A == pytest.approx(0.5 * table["mu1"] * l1**2 + elbow * l1, rel=1e-12)
    # the torque matrix I_A J + m J^-T, row by row: eq. (9) without its lost factor's trouble
    J = machine.inverse_jacobian(machine.workspace_grid(401, 81))
    rows = np.linalg.norm(I_A * J + m * np.linalg.inv(J).swapaxes(-1, -2), axis=-1)
    found = problem.evaluate(problem.printed_design()[None]).indices["tau_G"][0]
    assert found == pytest.approx(rows.max(), rel=1e-3)


# Optima -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("optimum", OPTIMA, ids=named)
def test_stored_optima_are_solutions(optimum: Optimum) -> None:
    problem = problem_of(optimum)
    solutions = solve_tasks(problem, problem.pack(None)[None])
    assert solutions.certified[0]
    assert solutions.optima[0] == pytest.approx(optimum.value, rel=1e-7)
    active = np.array(problem.constraint_names)[solutions.active[0]]
    assert tuple(active) == optimum.active


@pytest.mark.parametrize("optimum", OPTIMA, ids=named)
def test_stored_optima_are_feasible_to_the_last_digit(optimum: Optimum) -> None:
    problem = problem_of(optimum)
    evaluation = problem.evaluate(problem.design(optimum.design)[None])
    assert evaluation.feasible[0]
    assert evaluation.objectives[0, 0] == pytest.approx(optimum.value, rel=1e-7)


@pytest.mark.parametrize("optimum", OPTIMA, ids=named)
def test_no_independent_optimiser_finds_a_better_design(optimum: Optimum) -> None:
    problem = problem_of(optimum)
    task: Any = problem.task
    minimised = problem.objectives[0].direction == "minimise"

    def penalised(columns: np.ndarray) -> np.ndarray:
        indices = problem.evaluate(columns.T).indices
        over = np.maximum(indices["sigma_max"] - task.sigma_high, 0.0)
        under = np.maximum(task.sigma_low - indices["sigma_min"], 0.0)
        value = indices[optimum.objective]
        value = (value if minimised else 1.0 / value) * (1.0 + 20.0 * (over + under))
        folded = (indices["alpha_min"] < 0.0) | np.isnan(value)
        return np.where(folded, 1e6, value)

    found = differential_evolution(
        penalised,
        list(zip(problem.low, problem.high, strict=True)),
        popsize=30, maxiter=400, tol=0.0, atol=1e-12, polish=False, vectorized=True,
        updating="deferred", rng=1,
    )  # fmt: skip
    best = optimum.value if minimised else 1.0 / optimum.value
    assert found.fun == pytest.approx(best, rel=1e-5)


def test_a_fine_sample_finds_the_same_optimum() -> None:
    optimum = REFERENCE.optima["tau_G"]
    fine = pkm_gym.make_problem("diamond", sampling=(61, 25))
    solutions = solve_tasks(fine, fine.pack(None)[None])
    assert solutions.optima[0] == pytest.approx(optimum.value, rel=1e-7)


def test_the_wide_spacing_is_feasible_in_one_interval_only() -> None:
    problem = pkm_gym.make_problem("diamond", fixed={"lam_e": SCAN.lam_e[-1]})
    lows = np.array([0.4, 0.5, 0.6, 0.7, 0.8, 0.9])
    tasks = np.stack([problem.pack({"sigma_low": low, "sigma_high": low + 0.9}) for low in lows])
    solutions = solve_tasks(problem, tasks)
    np.testing.assert_array_equal(solutions.solvable, lows == 0.7)
    mesh = np.meshgrid(*map(np.linspace, problem.low, problem.high, (601, 301)), indexing="ij")
    grid = np.stack([axis.ravel() for axis in mesh], axis=1)
    for low, task in zip(lows, tasks, strict=True):
        assert problem.evaluate(grid, task[None]).feasible.any() == (low == 0.7)


def test_the_optimum_falls_with_the_spacing_up_to_the_best_one() -> None:
    values = []
    for lam_e in (0.3, 0.43, 0.51, REFERENCE.optima["tau_G"].design["lam_e"]):
        problem = pkm_gym.make_problem("diamond", fixed={"lam_e": lam_e})
        values.append(solve_tasks(problem, problem.pack(None)[None]).optima[0])
    assert values == sorted(values, reverse=True)
    assert values[-1] == pytest.approx(REFERENCE.optima["tau_G"].value, rel=1e-6)


@pytest.mark.parametrize("problem", ["diamond"], indirect=True)
def test_each_limit_of_the_family_holds_back_a_tenth_of_its_optima(family: Solutions) -> None:
    shares = dict(
        zip(
            pkm_gym.make_problem("diamond").constraint_names,
            family.active.mean(axis=0),
            strict=True,
        )
    )
    for name in ("sigma_max", "sigma_min", "alpha", "beta"):
        assert shares[name] >= 0.1, shares


# The grid and the derived dimensions --------------------------------------------------------------


def test_the_grid_has_steps_of_a_fiftieth_in_both_ratios(diamond: DesignProblem) -> None:
    grid = diamond.grid()
    assert grid is not None
    lam_e, lam_l, gap = (np.unique(column) for column in grid.T)
    np.testing.assert_allclose(lam_e, SCAN.lam_e)
    np.testing.assert_allclose(np.diff(lam_l), 0.02)
    np.testing.assert_allclose(np.diff(gap), 0.02)
    assert len(grid) == len(lam_e) * len(lam_l) * len(gap)
    np.testing.assert_allclose((lam_l[0], lam_l[-1]), (diamond.low[1], diamond.high[1]))


def test_the_grid_follows_bounds_and_fixed_variables() -> None:
    problem = pkm_gym.make_problem("diamond", fixed={"lam_e": 0.6}, bounds={"lam_l": (2.0, 2.2)})
    grid = problem.grid()
    assert grid is not None
    assert grid.shape[1] == 2
    np.testing.assert_allclose(np.unique(grid[:, 0]), np.arange(2.0, 2.21, 0.02))
    assert len(pkm_gym.make_problem("diamond", fixed={"lam_e": 0.61}).grid()) == 0  # type: ignore[arg-type]  # a grid


def test_four_lengths_set_the_ratios_and_delta(diamond: DesignProblem) -> None:
    lengths = {"e": 0.12, "l1": 0.25, "l2": 0.64, "H": 0.5}
    ratios, changed = diamond.from_dimensions(lengths, diamond.task)
    task = diamond.task.replace(**changed)
    derived = diamond.derived(diamond.design(ratios), task)
    for name, value in lengths.items():
        assert derived[name].value == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("dimensions", "match"),
    [
        ({"e": 0.1, "l1": 0.2}, "lacks l2, H"),
        ({"e": 0.1, "l1": 0.2, "l2": 0.4, "H": 0.3, "lam_l": 2.0}, "also has lam_l"),
        ({"e": 0.1, "l1": 0.0, "l2": 0.4, "H": 0.3}, "all must be finite and > 0"),
        ({"e": 0.1, "l1": float("nan"), "l2": 0.4, "H": 0.3}, "all must be finite and > 0"),
        ({"lam_e": 0.6, "lam_H": 1.9}, "lam_H needs lam_l"),
        ({"lam_e": 0.6, "lam_H": 1.9, "gap": 0.4, "lam_l": 2.5}, "no gap"),
    ],
)
def test_lengths_that_make_no_design_are_refused(
    diamond: DesignProblem, dimensions: dict[str, float], match: str
) -> None:
    with pytest.raises(ValueError, match=match):
        diamond.from_dimensions(dimensions, diamond.task)
