"""``round``, ``tolerance``, ``sensitivity`` and ``search --robust`` as they are typed."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from pkm_gym import make_problem
from pkm_gym.studies.buildable.tolerance import SAMPLES

BEST = make_problem("diamond").reference.optima["tau_G"].design
OPTIMUM = ("--set", *(f"{name}={value}" for name, value in BEST.items()))


def test_a_rounded_design_is_a_file_that_evaluates_feasible(run):
    done = run("round", "diamond", "--to", "1mm")
    assert done.exit_code == 0, done.output
    assert "feasible: every limit holds" in done.stdout
    assert "rounded from the verified optimum (recorded)" in done.stdout
    assert "sigma_max" in done.stdout.partition("Limits that it touches")[2]
    path = "runs/diamond/round_1mm.toml"
    assert f"design: {path}" in done.stdout
    again = json.loads(run("evaluate", "diamond", "--design", path, "--json").stdout)
    assert again["feasible"]
    for name in ("e", "l1", "l2", "H"):
        millimetres = 1e3 * again["derived"][name]
        assert millimetres == pytest.approx(round(millimetres), abs=1e-9)
    command = next(x for x in done.stdout.splitlines() if x.startswith("pkm-gym evaluate "))
    typed = json.loads(run(*command.split()[1:], "--json").stdout)
    assert typed["design"] == again["design"]


def test_round_prints_json_and_writes_where_it_is_told(run):
    done = run("round", "diamond", *OPTIMUM, "--stock", "l1=240mm,260mm", "--json", "-o", "a.toml")
    told = json.loads(done.stdout)
    assert told["built"]["feasible"]
    built = {row["dimension"]: row for row in told["rows"]}
    assert (built["l1"]["built"], built["l1"]["unit"], built["l1"]["on"]) == (0.26, "m", True)
    assert not built["e"]["on"]
    assert told["cost"] > 0.0
    written = tomllib.loads(Path(told["design_file"]).read_text())
    assert written["design"] == told["built"]["design"]
    assert Path(told["design_file"]) == Path("a.toml")


def test_a_task_that_its_dimensions_settle_is_said_and_written(run):
    done = run("round", "diamond", *OPTIMUM, "task.b=801mm", "--to", "1mm")
    assert "the dimensions set task.delta = " in done.stdout
    (path,) = Path("runs/diamond").glob("*/round_1mm.toml")
    again = json.loads(run("evaluate", "diamond", "--design", str(path), "--json").stdout)
    assert again["feasible"]
    assert again["task"]["b"] == 0.801
    assert again["task"]["delta"] != 1.0


def test_nothing_feasible_on_a_lattice_is_said(run):
    stock = ("e=150mm", "l1=250mm", "l2=350mm", "H=175mm,180mm")
    done = run("round", "diamond", *OPTIMUM, *(w for x in stock for w in ("--stock", x)))
    assert done.exit_code == 0
    assert "none of them is feasible" in done.stdout
    assert "none of them is feasible" not in run("round", "diamond", "--to", "1mm").stdout


def test_tolerances_say_the_yield_and_what_would_help(run):
    done = run("tolerance", "diamond", "--sigma", "0.1mm", "H=0.2mm", "--samples", "256")
    assert done.exit_code == 0, done.output
    assert "yield " in done.stdout
    assert Path("runs/diamond/tolerance.png").stat().st_size > 10_000
    assert Path("runs/diamond/tolerance.toml").is_file()
    (command,) = (x for x in done.stdout.splitlines() if x.startswith("pkm-gym search "))
    searched = run(*command.split()[1:], "--trials", "3")
    assert searched.exit_code == 0, searched.output
    assert "of 95 %" in searched.stdout


def test_tolerances_as_json(run):
    words = ("tolerance", "diamond", *OPTIMUM, "--sigma", "l1=0.1mm", "e=0.1mm", "--json")
    told = json.loads(run(*words).stdout)
    assert told["machines"] == 2 * SAMPLES
    assert told["evaluations"] == 4 * SAMPLES
    assert 0.0 < told["yield"] < 0.6
    assert told["distribution"]["total"].keys() == {"e", "l1"}
    assert {row["dimension"] for row in told["rows"]} == {"e", "l1"}
    assert json.loads(run(*words).stdout) == told


def test_sensitivity_in_words_and_as_json(run):
    done = run("sensitivity", "diamond")
    assert done.exit_code == 0, done.output
    assert "bound of the active limit" in done.stdout
    told = json.loads(run("sensitivity", "diamond", *OPTIMUM, "--json").stdout)
    assert told["optimal"]
    assert told["prices"]["limits"]["sigma_max"]["share"] < 0.0
    assert len(told["hessian"]) == len(told["rows"]) == 4


def test_a_design_that_is_no_optimum_has_no_prices(run):
    done = run("sensitivity", "diamond", "--set", "lam_e=0.6")
    assert done.exit_code == 0
    assert "no prices: they hold at an optimum" in done.stdout
    assert "bound of the active limit" not in done.stdout


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("round", "diamond"), "nothing is said of the lattice"),
        (("round", "diamond", "--to", "1deg"), "there is no angle among e, l1, l2, H"),
        (("round", "diamond", "--to", "lam_e=0.1"), "unknown dimension 'lam_e'"),
        (("tolerance", "diamond"), "tolerances need a standard deviation"),
        (("tolerance", "diamond", "--sigma", "0.1mm", "--samples", "5"), "must be a power of 2"),
        (("search", "diamond", "--sigma", "0.1mm"), "--sigma needs --robust"),
        (("search", "diamond", "--robust", "0.9"), "a robust search needs --sigma"),
        (
            ("search", "diamond", "--robust", "2", "--sigma", "0.1mm"),
            "--robust is 2: it must be a share of machines",
        ),
        (
            ("search", "diamond", "--robust", "0.9", "--sigma", "1mm", "--sampler", "designer"),
            "the sampler designer knows nothing of errors",
        ),
    ],
)
def test_what_is_not_possible_is_refused_in_a_sentence(refused, words, sentence):
    assert sentence in refused(*words)
    assert not list(Path("runs").rglob("*.toml"))
