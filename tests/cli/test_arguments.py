"""From words to a problem and a design, or to one sentence that says what is wrong."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Annotated, NamedTuple

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.rows import variable
from pkm_gym.mechanisms import declaration, problems
from pkm_gym.mechanisms.diamond.declared import DIAMOND
from pkm_gym.mechanisms.diamond.problem import DiamondProblem
from pkm_gym.studies.cli import arguments
from pkm_gym.studies.cli.arguments import design_from, problem_from
from pkm_gym.studies.cli.design_file import write_design

LENGTHS = ["e=150mm", "l1=0.25", "l2=64cm", "H=493 mm"]


def given(*settings: str, **arguments):
    design = design_from("diamond", settings, **arguments)
    return design.problem, design


class HeldDesign(NamedTuple):
    """The Diamond's, with a gap that isn't searched unless it is named."""

    lam_e: Annotated[float, variable(0.2, 0.75, "", "e / l1")]
    lam_l: Annotated[float, variable(1.2, 3.6, "", "l2 / l1")]
    gap: Annotated[float, variable(0.1, 0.7, "", "the gap", default=0.41, searched=False)]


class HeldProblem(DiamondProblem):
    declared = replace(DIAMOND, design=HeldDesign)


@pytest.fixture
def held(monkeypatch):
    monkeypatch.setattr(arguments, "problem_type", lambda _: HeldProblem)


@pytest.mark.usefixtures("held")
def test_free_names_what_is_searched():
    assert problem_from("held").variable_names == ("lam_e", "lam_l")
    assert problem_from("held", free=["all"]).variable_names == ("lam_e", "lam_l", "gap")
    problem = problem_from("held", free=["gap"])
    assert problem.variable_names == ("gap",)
    assert problem.fixed == {"lam_e": 0.6, "lam_l": 2.56}
    with pytest.raises(ValueError, match="unknown variable 'gab'; did you mean 'gap'"):
        problem_from("held", free=["gab"])


@pytest.mark.usefixtures("held")
def test_a_design_may_give_what_is_not_searched():
    design = design_from("held", ["lam_e=0.5", "gap=0.3"])
    assert design.problem.variable_names == ("lam_e", "lam_l")
    assert design.problem.named(design.design) == {"lam_e": 0.5, "lam_l": 2.56, "gap": 0.3}
    searched = design_from("held", ["lam_e=0.5", "gap=0.3"], free=["all"])
    assert searched.problem.named(searched.design) == design.problem.named(design.design)


def test_no_words_make_the_problem_as_it_comes():
    problem, design = given()
    assert problem.hash() == pkm_gym.make_problem("diamond").hash()
    assert np.array_equal(design.design, problem.printed_design())
    assert design.notes == design.names == ()


def test_words_reach_task_options_fixed_values_bounds_and_objectives():
    problem = problem_from(
        "diamond",
        ["task.payload=1500g", "task.alpha_low=30deg", "inertia=uniform-arm", "sampling=30x11"],
        ["lam_e=0.6"],
        ["lam_l=2:3"],
        ["tau_peak", "condition"],
    )
    same = pkm_gym.make_problem(
        "diamond",
        task={"payload": 1.5, "alpha_low": math.radians(30.0)},
        inertia="uniform-arm",
        sampling=(30, 11),
        fixed={"lam_e": 0.6},
        bounds={"lam_l": (2.0, 3.0)},
        objective=("tau_peak", "condition"),
    )
    assert problem.hash() == same.hash()
    assert problem.task.payload == same.task.payload
    assert problem.task.alpha_low == pytest.approx(same.task.alpha_low, rel=1e-14)


@pytest.mark.parametrize(("text", "value"), [("true", True), ("YES", True), ("off", False)])
def test_a_switch_is_said_in_words(text, value):
    assert problem_from("diamond", [f"cycle={text}"]).options.cycle is value


@pytest.mark.parametrize(
    ("text", "value"),
    [("m_arm=1200g", 1.2), ("arm_section=4cm^2", 4e-4), ("speed_max=120rpm", 4.0 * math.pi),
     ("motor=30 kg cm^2", 3e-3), ("power_max=0.5kW", 500.0), ("torque_max=none", None)],
)  # fmt: skip
def test_an_option_may_have_a_unit(text, value):
    name = text.partition("=")[0]
    more = ["arm_density=2.7g/cm^3"] if name == "arm_section" else []
    assert getattr(problem_from("diamond", [text, *more]).options, name) == pytest.approx(value)


def test_a_setting_takes_back_what_a_file_says(tmp_path):
    limited = pkm_gym.make_problem("diamond", torque_max=25.0, m_arm=0.3)
    path = write_design(
        tmp_path / "design.toml", limited.evaluate(limited.printed_design()[None]), "a command"
    )
    assert problem_from("diamond", file=path).hash() == limited.hash()
    freed = design_from("diamond", ["torque_max=none"], file=path).problem
    assert freed.options.torque_max is None
    assert freed.options.m_arm == 0.3


def test_what_is_set_goes_before_what_a_verb_asks_for():
    assert problem_from("diamond", cycle=True).options.cycle
    assert not problem_from("diamond", ["cycle=false"], cycle=True).options.cycle


def test_four_lengths_make_a_design_of_those_lengths():
    problem, design = given(*LENGTHS, "task.b=700mm")
    machine = problem.mechanism(design.design, design.task)
    assert [machine.e, machine.l1, machine.l2, machine.H] == pytest.approx(
        [0.15, 0.25, 0.64, 0.493], rel=1e-12
    )
    assert machine.b == pytest.approx(0.7)
    assert design.task.delta == pytest.approx(0.7 / (2 * (0.15 + 0.25)), rel=1e-12)
    assert design.notes == ("e, l1, l2, H set task.delta = 0.875 (b / (2 (e + l1)))",)


def test_lengths_agree_with_the_delta_that_they_set():
    assert given(*LENGTHS, "task.delta=1")[1].task.delta == pytest.approx(1.0)


def test_ratios_may_come_with_the_height_and_with_what_is_printed():
    problem, design = given("lam_l=2.4", "lam_H=1.8")
    assert problem.named(design.design) == pytest.approx(
        {**problem.reference.design, "lam_l": 2.4, "gap": 0.4}
    )
    assert design.notes == ("lam_e as printed in the paper",)


def test_a_fixed_value_stands_in_the_design():
    problem, design = given("lam_l=2.4", fix=["lam_e=0.5"])
    assert problem.named(design.design)["lam_e"] == 0.5


@pytest.mark.parametrize(
    ("settings", "sentence"),
    [
        (["lame=0.6"], "unknown setting 'lame'; did you mean 'lam_e'?"),
        (["payload=1kg"], "unknown setting 'payload'; did you mean 'task.payload'?"),
        (["task.payloda=1kg"], "unknown task field 'payloda'; did you mean 'payload'?"),
        (["m_arm=1m"], "m_arm is '1m': 'm' is no unit of it, it is measured in kg, g"),
        (["torque_max=-1Nm"], "torque_max is -1.0: it must be a number from 0.001 to 100000 N m"),
        (["inertia=unifrm"], "unknown inertia 'unifrm'; did you mean 'uniform-arm'?"),
        (["lam_e"], "--set lam_e says no value: write --set lam_e=VALUE"),
        (["lam_e="], "--set lam_e= says no value: write --set lam_e=VALUE"),
        (["=1"], "--set =1 says no value: write --set NAME=VALUE"),
        (["gap=1", "gap=2"], "--set gives gap twice: 1 and 2"),
        (["gap=wide"], "gap is 'wide': it must be a finite number, such as 0.25"),
        (
            ["task.payload=1mm"],
            "task.payload is '1mm': 'mm' is no unit of it, it is measured in kg, g",
        ),
        (["task.payload=11kg"], "task.payload is 11.0: it must be a number from 0 to 10 kg"),
        (["sampling=24"], "sampling is (24,): it must be 2 whole numbers, each from 2 to 10000"),
        (["sampling=a"], "sampling is 'a': write it like sampling=16x7"),
        (["cycle=perhaps"], "cycle is 'perhaps': it must be true or false"),
        (
            [*LENGTHS, "task.delta=1.1"],
            (
                "task.delta = 1.1 disagrees with e, l1, l2, H, which set it to 1 "
                "(b / (2 (e + l1))): leave one out"
            ),
        ),
        (LENGTHS[:3], "a design in lengths (m) needs just e, l1, l2 and H: it lacks H"),
        (
            [*LENGTHS, "gap=1"],
            "a design in lengths (m) needs just e, l1, l2 and H: it also has gap",
        ),
        (["lam_H=2"], "lam_H needs lam_l beside it, and no gap"),
    ],
)
def test_a_mistake_in_a_setting_is_one_sentence(settings, sentence):
    with pytest.raises(ValueError, match=f"^{re.escape(sentence)}$"):
        given(*settings)


def test_lengths_in_millimetres_without_the_unit_are_refused_with_a_hint():
    with pytest.raises(ValueError, match=r"e, l1, l2, H set it \(without a unit they are in m\)"):
        given("e=150", "l1=250", "l2=640", "H=493")


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"fix": ["lam=1"]}, "unknown variable 'lam'; did you mean 'lam_l'?"),
        ({"fix": ["lam_e=1kg"]}, "'kg' is no unit of it"),
        ({"range_": ["lam_l=2"]}, "--range lam_l=2 is no range: write lam_l=LOW:HIGH"),
        ({"range_": ["lam_l=:3"]}, "low lam_l is '': it must be a finite number"),
        ({"range_": ["lam_l=3:2"]}, "the low one must be the smaller"),
        (
            {"fix": ["lam_e=0.6"], "range_": ["lam_e=0.5:0.7"]},
            "lam_e has both --fix 0.6 and --range 0.5:0.7: choose one",
        ),
        ({"objective": ["tau_g"]}, "unknown objective 'tau_g'; did you mean 'tau_G'?"),
        ({"set_": ["lam_e=0.6"]}, "keep a variable at a value with --fix"),
    ],
)
def test_a_mistake_in_another_argument_is_one_sentence(arguments, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)) as refused:
        problem_from("diamond", **arguments)
    assert "\n" not in str(refused.value)


PRODUCTS = [(name, product) for name in problems() for product in declaration(name).products]


@pytest.mark.parametrize(("name", "product"), PRODUCTS)
def test_a_task_takes_a_product_of_its_fields_in_place_of_the_ratio(name, product):
    """Such as the workspace's height, of which a task holds the share of its width."""
    item, usual = declaration(name).products[product], declaration(name).task()
    ratio, unit = item.ratio, item.unit
    legal = {v.name: (v.legal_low, v.legal_high) for v in usual.variables()}[ratio]
    wanted = 0.98 * getattr(usual, ratio) or 0.5 * legal[1]  # one of 0 has no size
    value = wanted * item.factor
    for field, power in item.powers.items():
        value *= getattr(usual, field) ** power
    written = f"{1e3 * value!r}{ {'m': 'mm', 's': 'ms'}[unit] }" if unit in "ms" else repr(value)
    task = problem_from(name, [f"task.{product}={written}"]).task
    assert getattr(task, ratio) == pytest.approx(wanted, rel=1e-12)
    assert item.value(task) == pytest.approx(value, rel=1e-12)
    assert task == usual.replace(**{ratio: getattr(task, ratio)})
    other = next(field for field in item.powers if not field.endswith("_ratio"))
    length = 1.01 * getattr(usual, other)
    both = [f"task.{product}={value!r}", f"task.{other}={length!r}"]
    share = wanted * 1.01 ** -item.powers[other]
    assert getattr(problem_from(name, both).task, ratio) == pytest.approx(share)
    for sentence, words in {
        "say the same thing: leave one out": [f"task.{product}=0.1", f"task.{ratio}=1.3"],
        "it must be from ": [f"task.{product}=100000"],
        "it must be a finite number": [f"task.{product}=x"],
    }.items():
        with pytest.raises(ValueError, match=f"^task.{product} .*{sentence}"):
            problem_from(name, words)


def test_a_product_goes_before_the_ratio_of_a_file(tmp_path):
    problem = problem_from("diamond", ["task.h_ratio=0.2"])
    best = problem.evaluate(problem.printed_design()[None])
    path = write_design(tmp_path / "design.toml", best, "")
    assert problem_from("diamond", file=path).task.h_ratio == 0.2
    assert problem_from("diamond", ["task.h=80mm"], file=path).task.h_ratio == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("word", "sentence"),
    [
        ("h=0.1", "unknown setting 'h'; did you mean 'task.h'?"),
        ("task.paylod=1", "unknown task field 'paylod'; did you mean 'payload'?"),
        ("task.q=1", "unknown task field 'q'; known: .*h, h_ratio.*"),
    ],
)
def test_an_unknown_field_is_answered_with_those_there_are(word, sentence):
    with pytest.raises(ValueError, match=f"^{sentence.replace('?', '[?]')}$"):
        problem_from("diamond", [word])
