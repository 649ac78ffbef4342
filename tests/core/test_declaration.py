"""Declarations: contradictions are refused, and what isn't said follows."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.calibration import PENALTY_WEIGHT, SCALE, WORST
from pkm_gym.core.declaration import Declaration, Objective, environment_name
from pkm_gym.core.limit import Limit
from pkm_gym.core.rows import own
from pkm_gym.mechanisms import declaration


class Late(NamedTuple):
    reach: Annotated[float, own("first, where the dimensions should be")]
    dimensions: Annotated[float, own("too late")]


FIRST = ("dimensions", "reach")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"objectives": (Objective("sizes", "minimise"),)}, "the objective 'sizes' is no index"),
        ({"objectives": (Objective("rod", "minimise"),)}, "the objective 'rod' is no index"),
        ({"limits": Late}, "the first limit must be the mechanism's own 'dimensions'"),
        ({"constraints": ("reach", "dimensions")}, "the first limit must be the mechanism's own"),
        ({"constraints": ()}, "the first limit must be the mechanism's own 'dimensions'"),
        ({"constraints": ("dimensions",)}, "own limits .* and constraints .* must be the same"),
        ({"constraints": (*FIRST, "assembly")}, "own limits .* must be the same"),
        ({"constraints": (*FIRST, "reach")}, "own limits .* must be the same"),
        ({"constraints": (*FIRST, Limit("sizes", "upper", 1.0))}, "sizes limits 'sizes', no index"),
        (
            {"constraints": (*FIRST, Limit("size", "upper", 1.0, of="sizes"))},
            "size limits 'sizes', no index or variable",
        ),
        (
            {"constraints": (*FIRST, Limit("size", "upper", "size_min"))},
            "the bound 'size_min' of size is no task field",
        ),
        (
            {"constraints": (*FIRST, Limit("size", "upper", "size_max", times=("wey", 1)))},
            "the bound 'wey' of size is no task field",
        ),
        (
            {"constraints": (*FIRST, Limit("margin", "lower", 0.0))},
            "margin is relative to its bound, which may be 0",
        ),
        (
            {"constraints": (*FIRST, Limit("slope", "upper", "slope_max", scale="relative"))},
            "slope is relative to its bound, which may be 0",
        ),
        (
            {"family": {"fre": ("arm",)}},
            "its Family .* unknown argument 'fre'; did you mean 'free'",
        ),
        ({"family": {"task": {"way": 1.0}}}, "its Family can't be made: unknown argument 'task'"),
        (
            {"family": {"free": ("arn",)}},
            "its Family .* unknown variable 'arn'; did you mean 'arm'",
        ),
        ({"family": {"bounds": {"gap": (0.1, 0.2)}}}, "its Family .* unknown variable 'gap'"),
        (
            {"family": {"bounds": {"arm": (2.0, 1.0)}}},
            "its Family .* the low one must be the small",
        ),
        ({"family": {"free": ("arm",), "fixed": {"arm": 1.0}}}, "arm is both free and fixed"),
        (
            {"option_limits": (Limit("heavy", "upper", "samples", of="mass"),)},
            "the bound 'samples' of heavy is no option whose default is None",
        ),
        (
            {"option_limits": (Limit("heavy", "upper", 3.0, of="mass"),)},
            "the bound 3.0 of heavy is no option",
        ),
        (
            {"option_limits": (Limit("size", "upper", "mass_max", of="mass"),)},
            "two limits are called size",
        ),
        ({"family": {"samples": "many"}}, "its Family can't be made: samples is 'many'"),
    ],
)
def test_what_contradicts_itself_is_refused(
    said: dict[str, Any], changes: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(TypeError, match=f"^slider: .*{sentence}") as refused:
        Declaration(**{**said, **changes})
    assert "\n" not in str(refused.value)


def test_what_is_not_said_follows(said: dict[str, Any]) -> None:
    made = Declaration(**said)
    assert made.environment == "Slider"
    assert made.constraint_names == ("dimensions", "reach", "size", "slope", "margin", "short")
    assert [(o.unit, o.scale, o.worst) for o in made.objectives] == [
        ("m", SCALE, WORST), ("kg", SCALE, WORST)
    ]  # fmt: skip
    assert made.penalty_weight == PENALTY_WEIGHT
    assert made.reporting == {"full": True}
    assert made.side_of("size_max") == "upper"
    assert made.side_of("way") == ""
    assert [v.name for v in made.variables] == ["arm", "rod", "tail", "gap"]
    most = Declaration(**{**said, "objectives": (Objective("size", "maximise"),)})
    assert most.objectives[0].worst == -WORST
    assert most.objectives[0].sign == -1.0


def test_a_family_is_kept_as_json_and_given_arguments_go_before_it(said: dict[str, Any]) -> None:
    family = {"free": ("arm", "gap"), "bounds": {"gap": (np.float64(0.05), 0.2)}, "samples": 7}
    made = Declaration(**said, family=family)
    kept = {"free": ["arm", "gap"], "bounds": {"gap": [0.05, 0.2]}, "samples": 7}
    assert made.family == kept
    assert made.family_words == "free arm, gap; gap from 50 to 200 mm; samples = 7"
    assert made.family_arguments({}) == {**kept, "fixed": {}}
    assert made.family_arguments({"samples": 9, "free": None})["samples"] == 9
    # an environment is given what its id declares, and what its user says
    again = made.family_arguments({**kept, "fixed": {"gap": 0.1}})
    assert again == {"free": ["arm"], "bounds": {}, "samples": 7, "fixed": {"gap": 0.1}}
    freed = made.family_arguments({**kept, "free": ("arm", "rod"), "bounds": {"arm": (0.2, 0.4)}})
    assert freed["bounds"] == {"arm": [0.2, 0.4]}
    fixed = Declaration(**said, family={"fixed": {"gap": 0.1}})
    assert fixed.family_arguments({"free": ("gap",)})["fixed"] == {}


@pytest.mark.parametrize(
    ("name", "environment"),
    [
        ("diamond", "Diamond"), ("spr3", "SPR3"), ("spr3_cylinder", "SPR3Cylinder"),
        ("stroke_leg", "StrokeLeg"), ("pss5_upu", "PSS5Upu"),
    ],
)  # fmt: skip
def test_environments_are_named_after_problems(name: str, environment: str) -> None:
    assert environment_name(name) == environment


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_each_registered_declaration_is_complete(name: str) -> None:
    made = declaration(name)
    assert made.name == name
    assert made.title
    assert made.notes == tuple(made.notes)
    for item in (*made.variables, *made.index_table, *made.own_limits, *made.task.variables()):
        assert item.doc, item.name
    for item in made.options.table():
        assert item.doc, item.name
    for v in made.variables:
        assert v.low < v.high
        assert v.step > 0.0
    for field in made.task.variables():
        assert field.legal_low <= field.low <= field.high <= field.legal_high
        assert field.legal_low <= field.default <= field.legal_high
    for objective in made.objectives:
        assert np.isfinite([objective.worst, objective.scale, made.penalty_weight]).all()
    assert set(made.splits) in ({"train", "val", "test", "ood"}, set())
