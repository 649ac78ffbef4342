"""``--json`` and ``--csv``: one way for every verb, SI, all digits, nothing else on stdout."""

from __future__ import annotations

import csv
import inspect
import json
import math
import shlex
from pathlib import Path

import numpy as np
import pytest

from pkm_gym.__main__ import VERBS
from pkm_gym.core.names import imported
from pkm_gym.mechanisms import declaration, make_problem, problems
from pkm_gym.studies.cli.output import Output, flattened, plainly
from pkm_gym.studies.cli.words import evaluate_command
from pkm_gym.studies.comparison import compare, study
from pkm_gym.studies.dashboard.pictures import Pictures
from pkm_gym.studies.report.rows import (
    VERIFIED,
    Row,
    design_columns,
    regret_of,
    row_of,
)

# Verbs whose result is a file, a picture or a page, and what is on the screen only says where.
FILES = {
    "dashboard", "export", "figures", "movie", "new", "page", "picture", "restamp", "splits",
    "train",
}  # fmt: skip

TOLD = {
    "list": ("list",),
    "list of one": ("list", "diamond"),
    "evaluate": ("evaluate", "diamond", "--set", "task.h=100mm"),
    "a load": ("evaluate", "spr3", "--load", "fz=-20N"),
    "motors": ("motors", "diamond"),
    "round": ("round", "diamond", "--to", "5mm", "--points", 500),
    "tolerance": ("tolerance", "diamond", "--sigma", "0.1mm", "--samples", 64),
    "sensitivity": ("sensitivity", "diamond"),
    "grid": ("grid", "spr3", "--step", 0.1),
    "search": ("search", "spr3_cylinder", "--sampler", "qmc", "--trials", 4),
    "polish": ("polish", "spr3"),
    "compare": ("compare", "spr3", "--seeds", 2, "--evaluations", 4),
    "study": ("study", "diamond", "--trials", 4),
    "design": ("design", "diamond", "--set", "task.b=0.9"),
    "zoo": ("zoo",),
    "twin-check": ("twin-check", "diamond", "--designs", 0),
    "validate": ("validate", "diamond", "--designs", 3),
    "motion-eval": ("motion-eval", "PKM/DiamondMotion-v0"),
    "benchmark": ("benchmark", "diamond", "--method", "random", "--tasks", 2, "--evaluations", 4,
                  "--jobs", 1),
    "calibrate": ("calibrate", "spr3_cylinder", "-n", 1),
    "solve-tasks": ("solve-tasks", "diamond", "-n", 3),
}  # fmt: skip


@pytest.fixture(autouse=True)
def small(monkeypatch):
    """Draw nothing, and compare little."""
    whole = compare.compare
    monkeypatch.setattr(Pictures, "draw", lambda *_: [])
    monkeypatch.setattr("pkm_gym.studies.verbs.evaluate.draw", lambda *_: None)
    monkeypatch.setattr(study, "compare", lambda *a, **k: whole(*a, **k, evaluations=4, seeds=1))


def read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_every_verb_with_a_result_to_parse_has_both_flags():
    for verb, (function, _) in VERBS.items():
        parameters = inspect.signature(imported(function)).parameters
        assert {"as_json", "csv"} <= set(parameters) or verb in FILES, verb
        assert verb not in FILES or "csv" not in parameters, verb


@pytest.mark.parametrize("words", TOLD.values(), ids=TOLD)
def test_json_stands_alone_and_the_table_says_the_same_to_the_bit(run, words):
    result = run(*words, "--json", "--csv", "made/told.csv")
    assert result.exit_code == 0, result.output
    content = json.loads(result.stdout)  # and nothing else
    rows = content.get("rows", [content])
    lines = read(Path("made/told.csv"))
    assert len(lines) == len(rows) > 0
    units, seen = dict(flattened(content.get("units", {}))), 0
    for row, line in zip(rows, lines, strict=True):
        for name, value in flattened(row):
            if name.startswith("units.") or name == "rows":
                continue
            unit = units.get(name)
            cell = line[f"{name} [{unit}]" if unit else name]
            if isinstance(value, float):
                assert float(cell) == value, name
                seen += 1
            elif value is None:
                assert cell == ""
            elif isinstance(value, str):
                assert cell == value
            else:
                assert json.loads(cell) == value
    assert seen or words[0] == "list"


def test_logs_are_scored_for_programs_as_for_people(run):
    words = ("--method", "random", "--tasks", 2, "--evaluations", 4, "--jobs", 1)
    made = json.loads(run("benchmark", "diamond", *words, "--json").stdout)
    (log,) = Path("runs/diamond/benchmark/val").glob("*.npz")
    scored = json.loads(run("score", log, "--json", "--csv", "a.csv").stdout)
    assert scored["rows"] == made["rows"]
    assert "log(value / optimum)" in scored["regret"]
    (line,) = read(Path("a.csv"))
    (row,) = scored["rows"]
    assert float(line["score.value"]) == row["score"]["value"]
    (kept,) = read(Path("runs/diamond/benchmark/val/table.csv"))
    assert kept["score"] == f"{row['score']['value']:.4f}"
    assert kept["median_4"] == f"{row['after']['4']['median'] or math.inf:.4g}"


def test_what_a_family_draws_is_not_set(refused):
    said = refused("solve-tasks", "diamond", "-n", 2, "--set", "task.b=0.9", "task.h=160mm")
    assert said.startswith("task.b is set to 900.0 mm, and the Family draws it from 400.0 mm to ")


def test_without_json_the_table_goes_with_what_people_read(run):
    told = run("polish", "diamond", "--csv", "a.csv").stdout
    assert "verified optimum" in told
    assert told.endswith("table: a.csv\n")
    assert "l1 [m]" not in told
    assert "derived.l1 [m]" in read(Path("a.csv"))[0]


def test_a_table_of_another_name_is_refused_before_anything_is_done(refused, tmp_path):
    said = refused("search", "diamond", "--csv", "a.txt")
    assert said == "can't write 'a.txt': its name must end in .csv"
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "a.csv").mkdir()
    assert "a.csv: Is a directory" in refused("search", "diamond", "--csv", "a.csv")


@pytest.mark.parametrize("name", problems())
def test_a_design_read_back_from_json_evaluates_to_the_same_bits(run, name):
    content = json.loads(run("evaluate", name, "--json").stdout)
    words = [f"{key}={value!r}" for key, value in content["design"].items()]
    words += [f"task.{key}={value!r}" for key, value in content["task"].items()]
    again = json.loads(run("evaluate", name, "--json", "--set", *words).stdout)
    for part in ("design", "derived", "task", "task_derived", "indices", "constraints", "merit"):
        assert again[part] == content[part], part
    problem = make_problem(name, **declaration(name).reporting)
    evaluation = problem.evaluate(problem.design(content["design"])[None])
    indices = {k: x for k, x in content["indices"].items() if x is not None}
    assert indices == {k: evaluation.indices[k][0] for k in indices}


@pytest.mark.parametrize("name", problems())
def test_every_number_of_a_design_has_its_unit_stated(run, name):
    content = json.loads(run("evaluate", name, "--json").stdout)
    for part in ("design", "derived", "task", "task_derived", "indices"):
        assert set(content["units"][part]) == set(content[part]), part


def test_what_is_no_number_of_json_becomes_null(capsys, tmp_path):
    content = {"rows": [{"a": math.nan, "b": np.float64(0.1), "c": [np.inf, 1], "d": True}]}
    Output(as_json=True, table=tmp_path / "a.csv").give(content)
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert rows == [{"a": None, "b": 0.1, "c": [None, 1], "d": True}]
    assert read(tmp_path / "a.csv") == [{"a": "", "b": "0.1", "c": "[null, 1]", "d": "true"}]
    assert plainly(Path("a")) == "a"


# Dimensions beside ratios -------------------------------------------------------------------------


@pytest.mark.parametrize("name", problems())
def test_tables_show_every_length_and_angle_of_a_design_in_mm_and_deg(name):
    problem = make_problem(name)
    design = problem.printed_design()
    row = row_of("x", problem.evaluate(design[None]), 0, None)
    shown = dict(design_columns(problem, [row]))
    assert {name for name, unit in problem.derived_units.items() if unit} <= set(shown)
    machine = problem.mechanism(design)
    units = {name: unit for name, unit in machine.units().items() if unit and name in shown}
    assert "m" in units.values()
    for dimension, unit in units.items():
        factor, half = {"m": (1e3, 0.05), "rad": (180.0 / math.pi, 0.005)}[unit]
        wanted = factor * getattr(machine, dimension)
        assert float(shown[dimension]) == pytest.approx(wanted, abs=1.01 * half)


# Regret -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", problems())
def test_regret_is_the_share_lost_or_paid_more(name):
    """Of every objective whose optimum is known, at a feasible design that is worse."""
    seen = 0
    for objective in declaration(name).objectives:
        problem = make_problem(name, objective=objective.name)
        known = problem.reference.optima.get(objective.name)
        if known is None:
            continue
        optimum = Row(VERIFIED, known.value, known.design)
        best = problem.design(known.design)
        near = best + 0.03 * (problem.high - problem.low) * np.random.default_rng(3).uniform(
            -1.0, 1.0, (400, len(best))
        )
        evaluation = problem.evaluate(np.clip(near, problem.low, problem.high))
        value_of_best = problem.evaluate(best[None]).objectives[0, 0]
        for i in np.flatnonzero(evaluation.feasible)[:5]:
            share = evaluation.objectives[i, 0] / value_of_best
            wanted = 1.0 - share if objective.direction == "maximise" else share - 1.0
            regret = regret_of(problem, evaluation.designs[i], optimum)
            assert regret == pytest.approx(wanted, rel=1e-9, abs=1e-12)
            assert regret < 1.0 or objective.direction == "minimise"
            seen += 1
    assert seen > 0


def test_tables_say_which_regret_they_show(run):
    assert "regret: 1 - value / optimum" in " ".join(run("polish", "spr3").stdout.split())
    assert "regret: value / optimum - 1" in " ".join(run("polish", "diamond").stdout.split())


# Heights and times --------------------------------------------------------------------------------

PRODUCTS = [(name, product) for name in problems() for product in declaration(name).products]


@pytest.mark.parametrize(("name", "product"), PRODUCTS)
def test_a_height_is_typed_shown_and_printed_as_one(run, name, product):
    item, problem = declaration(name).products[product], make_problem(name)
    low, high = item.legal({v.name: v for v in problem.task_variables})
    wanted = float(f"{0.97 * item.value(problem.task) or 0.5 * (low + high) + 0.1 * high:.3g}")
    typed = f"task.{product}={wanted!r}"
    told = json.loads(run("evaluate", name, "--set", typed, "--json").stdout)
    assert told["task_derived"][product] == pytest.approx(wanted, rel=1e-12)
    assert told["units"]["task_derived"][product] == item.unit
    text = run("evaluate", name, "--set", typed).stdout
    assert f"\n{product} " in text or f" {product} " in text
    best = problem.with_task({item.ratio: told["task"][item.ratio]})
    command = evaluate_command(best, best.printed_design())
    assert typed in shlex.split(command)
    again = json.loads(run(*shlex.split(command)[1:], "--json").stdout)
    assert again["task"] == told["task"]


def test_a_height_is_that_of_the_size_which_lengths_settle(run):
    lengths = ("a=210mm", "b=455mm", "q_min=500mm", "q_max=800mm")
    words = ("evaluate", "spr3", "--json", "--set", *lengths, "task.offset=20mm")
    told = json.loads(run(*words).stdout)
    assert told["task"]["D"] != declaration("spr3").task().D
    assert told["task_derived"]["offset"] == pytest.approx(0.020, rel=1e-12)


def test_the_cycle_time_is_the_kernel_s():
    from pkm_gym.mechanisms.diamond.problem import cycle_path, packed_task

    problem = make_problem("diamond")
    task = problem.task.replace(b=1.1, cycle_time_ratio=1.3, cycle_width_ratio=0.5)
    told = declaration("diamond").products_of(task)
    width, lift, seconds, _ = cycle_path(packed_task(task))
    assert told["cycle_width"].value == pytest.approx(width, rel=1e-15)
    assert told["cycle_lift"].value == pytest.approx(lift, rel=1e-15)
    assert told["cycle_time"] == (pytest.approx(seconds, rel=1e-15), "s")
