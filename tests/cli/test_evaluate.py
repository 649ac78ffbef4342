"""``pkm-gym evaluate``: a design in numbers, words, a picture and JSON."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.units import shown
from pkm_gym.mechanisms import declaration


@pytest.fixture
def evaluated(run):
    """Return what ``evaluate --json`` prints."""

    def evaluate(*words):
        result = run("evaluate", "diamond", "--json", *words)
        assert result.exit_code == 0, result.output
        return json.loads(result.stdout)

    return evaluate


def test_json_of_the_printed_design_has_the_reference_s_numbers(evaluated):
    reference = pkm_gym.make_problem("diamond").reference
    content = evaluated()
    numbers = content["indices"] | content["derived"]
    for value in reference.values.values():
        if value.kind in ("index", "dimension"):
            assert numbers[value.name] == pytest.approx(value.ours, rel=value.tolerance)
            printed = content["paper"].get(value.name, {"printed": None})
            assert printed["printed"] == value.printed
    assert content["design"] == reference.design
    assert content["feasible"] is True


def test_json_of_a_design_equals_what_the_problem_says(evaluated):
    words = ["lam_e=0.5", "lam_l=2", "gap=0.3", "task.payload=1kg", "inertia=uniform-arm"]
    content = evaluated("--set", *words, "--objective", "condition")
    problem = pkm_gym.make_problem(
        "diamond", task={"payload": 1.0}, objective="condition", inertia="uniform-arm", cycle=True
    )
    evaluation = problem.evaluate(np.array([[0.5, 2.0, 0.3]]))
    assert content["merit"] == pytest.approx(evaluation.merit[0], rel=1e-12)
    assert content["indices"] == pytest.approx({k: v[0] for k, v in evaluation.indices.items()})
    assert list(content["constraints"].values()) == pytest.approx(list(evaluation.constraints[0]))
    assert content["explain"] == evaluation.explain(0).splitlines()
    assert content["task"]["payload"] == 1.0
    assert content["hash"] == problem.hash()
    assert content["paper"] == {}


def test_json_is_valid_where_nothing_can_be_evaluated(evaluated, tmp_path):
    content = evaluated("--set", "lam_l=0")
    assert set(content["indices"].values()) == {None}
    assert content["derived"] == {}
    assert content["feasible"] is False
    assert content["constraints"]["dimensions"] > 0.0
    assert list(tmp_path.iterdir()) == []


def test_text_shows_indices_and_dimensions_with_units(run):
    problem = pkm_gym.make_problem("diamond", cycle=True)
    evaluation = problem.evaluate(problem.printed_design()[None])
    rows = [row.split() for row in run("evaluate", "diamond").stdout.splitlines()]
    for index in problem.index_table:
        number, unit = shown(evaluation.indices[index.name][0], index.unit)
        assert any(row[:2] == [index.name, number] and unit in " ".join(row) for row in rows)
    words = [word for row in rows for word in row]
    for name, length in (("e", "150.0"), ("l1", "250.0"), ("l2", "640.0"), ("H", "492.5")):
        at = words.index(name)
        assert words[at : at + 3] == [name, length, "mm"]
    assert "feasible: every limit holds" in " ".join(words)


def test_printed_numbers_stand_beside_ours_with_their_verdict(run):
    text = " ".join(run("evaluate", "diamond").stdout.split())
    value = pkm_gym.make_problem("diamond").reference["tau_G"]
    assert f"tau_G {value.printed:.4g} {value.ours:.4g} {value.unit} {value.verdict}" in text
    assert f"tau_G: {value.note}" in text


@pytest.mark.parametrize("word", ["lam_e=0.61", "task.payload=1kg"])
def test_printed_numbers_are_left_out_of_another_design_or_task(run, word):
    assert "What the paper prints" not in run("evaluate", "diamond", "--set", word).stdout


def test_a_verdict_is_left_out_where_an_option_changes_the_number(run):
    text = run("evaluate", "diamond", "--set", "inertia=uniform-arm").stdout
    paper = text.partition("What the paper prints")[2]
    assert "sigma_max" in paper
    assert "tau_G" not in paper


def test_lengths_say_which_delta_they_set(run):
    words = ["e=150mm", "l1=250mm", "l2=640mm", "H=493mm", "task.b=0.9"]
    text = run("evaluate", "diamond", "--set", *words).stdout
    assert "e, l1, l2, H set task.delta = 1.125 (b / (2 (e + l1)))" in text


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_each_problem_shows_and_draws_its_printed_design(run, tmp_path, name):
    problem = pkm_gym.make_problem(name, **declaration(name).reporting)
    evaluation = problem.evaluate(problem.printed_design()[None])
    result = run("evaluate", name)
    assert result.exit_code == 0, result.output
    whose = "the design that the paper prints" if problem.reference else "the default design"
    assert result.stdout.startswith(f"{name}: {whose}\n")
    words = " ".join(result.stdout.split())
    assert " ".join(evaluation.explain(0).split()) in words
    assert ("feasible: every limit holds" in words) == evaluation.feasible[0]
    assert (tmp_path / f"runs/{name}/evaluate.png").read_bytes().startswith(b"\x89PNG")


def test_lengths_of_the_3_spr_set_its_size_and_stroke(run):
    words = ["a=210mm", "b=0.455", "q_min=500mm", "q_max=0.8"]
    text = " ".join(run("evaluate", "spr3", "--set", *words).stdout.split())
    q_c = (0.5 + 0.8) / 2
    problem = pkm_gym.make_problem("spr3")
    D = (0.21 + 0.455 + q_c) / 3
    assert f"set task.D = {1e3 * D:.1f} mm" in text
    evaluation = problem.evaluate(
        np.array([[0.21 / D, q_c / D]]), problem.task.replace(D=D, lam=0.15 / q_c)
    )
    assert f"gci {evaluation.indices['gci'][0]:.4g} mean" in text


def test_a_broken_limit_is_said_in_words_with_its_margin(run):
    text = run("evaluate", "diamond", "--set", "gap=0.5", "task.sigma_low=0.75").stdout
    problem = pkm_gym.make_problem("diamond", task={"sigma_low": 0.75})
    evaluation = problem.evaluate(problem.design({**problem.reference.design, "gap": 0.5})[None])
    words = " ".join(text.split())
    for name, value in zip(problem.constraint_names, evaluation.constraints[0], strict=True):
        verdict = "broken" if value > 0.0 else "holds"
        assert f"{name} {verdict} {abs(value):.4f}" in words
    assert not evaluation.feasible[0]
    assert " ".join(evaluation.explain(0).split()) in words


def test_limits_that_cannot_be_evaluated_are_called_undefined(run):
    words = run("evaluate", "diamond", "--set", "gap=0.9").stdout.split()
    verdicts = {name: words[words.index(name, words.index("Limits")) + 1] for name in
                ("reach_outer", "sigma_max", "alpha", "spacing")}  # fmt: skip
    assert verdicts == {
        "reach_outer": "broken",
        "sigma_max": "undefined",
        "alpha": "undefined",
        "spacing": "holds",
    }


def test_the_picture_is_written_where_asked_or_under_runs(run, tmp_path):
    assert "picture: runs/diamond/evaluate.png" in run("evaluate", "diamond").stdout
    run("evaluate", "diamond", "--picture", "deep/er/mine.svg")
    assert (tmp_path / "runs/diamond/evaluate.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (tmp_path / "deep/er/mine.svg").read_text()


def test_a_picture_of_unknown_kind_is_refused(refused):
    assert "'a.doc'" in refused("evaluate", "diamond", "--picture", "a.doc")


def test_a_picture_that_cannot_be_written_is_named(refused, tmp_path):
    (tmp_path / "file").touch()
    assert "file" in refused("evaluate", "diamond", "--picture", "file/mine.png")


def test_a_task_field_that_disagrees_with_the_lengths_is_refused(refused):
    words = ["e=150mm", "l1=250mm", "l2=640mm", "H=493mm", "task.delta=1.2"]
    sentence = refused("evaluate", "diamond", "--set", *words)
    assert sentence.startswith("task.delta = 1.2 disagrees with e, l1, l2, H")


def test_angles_are_typed_and_shown_in_degrees(evaluated, run):
    content = evaluated("--set", "task.alpha_low=30deg")
    assert content["task"]["alpha_low"] == pytest.approx(math.radians(30.0))
    text = run("evaluate", "diamond", "--set", "task.alpha_low=30deg").stdout
    assert "alpha_low 30.00 deg" in text
