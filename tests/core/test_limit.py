"""Limit: one object says the violation, the compiled record and the words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pkm_gym.core.compile import kernel
from pkm_gym.core.limit import LIMIT, Limit, packed
from pkm_gym.core.merit import violation_of
from pkm_gym.core.task import Task, quantity


@dataclass(frozen=True)
class Lifting(Task):
    force: float = quantity(10.0, "N", "largest force", legal=(1.0, 100.0))
    angle: float = quantity(0.5, "rad", "smallest angle", legal=(0.0, 1.5))
    way: float = quantity(0.3, "m", "how far", legal=(0.1, 2.0))


UNITS = {"F": "N", "alpha": "rad", "sigma": "", "l1": "m"}

LIMITS = st.builds(
    Limit,
    name=st.just("limit"),
    side=st.sampled_from(["lower", "upper"]),
    bound=st.one_of(st.sampled_from(Lifting.names()), st.floats(0.1, 10.0)),
    of=st.sampled_from(list(UNITS)),
    times=st.one_of(st.none(), st.tuples(st.sampled_from(["force", "way"]), st.integers(-2, 3))),
    scale=st.sampled_from(["", "absolute", "relative"]),
)
TASKS = st.builds(
    Lifting, force=st.floats(1.0, 100.0), angle=st.floats(0.1, 1.5), way=st.floats(0.1, 2.0)
)


@kernel
def compiled(limits: np.ndarray, value: float, task: np.ndarray) -> float:
    return violation_of(limits.view(LIMIT)[0, 0], value, task, 0)


def rows(limit: Limit) -> np.ndarray:
    indices = {name: UNITS[name] for name in ("F", "alpha", "sigma")}
    return packed([limit], ["dimensions"], indices, {"l1": "m"}, Lifting.names())


@given(limit=LIMITS, task=TASKS, value=st.floats(-1e3, 1e3))
def test_the_compiled_violation_is_that_of_python(
    limit: Limit, task: Lifting, value: float
) -> None:
    unit = UNITS[limit.quantity]
    expected = limit.violation(np.array([value]), task, unit)[0]
    bound = limit.bound_of(task)
    room = 1e-14 * (abs(value) + bound) / (bound if limit.relative(unit) else 1.0)
    assert compiled(rows(limit), value, task.pack()[None]) == pytest.approx(
        expected, rel=0, abs=room
    )


@given(limit=LIMITS, task=TASKS, share=st.floats(0.01, 2.0))
def test_beyond_the_bound_is_broken_and_within_is_not(
    limit: Limit, task: Lifting, share: float
) -> None:
    bound, unit = limit.bound_of(task), UNITS[limit.quantity]
    for way in (1.0, -1.0):
        violation = limit.violation(np.array([bound * (1.0 + way * share)]), task, unit)[0]
        assert (violation > 0.0) == ((way > 0.0) == (limit.side == "upper"))
        amount = share if limit.relative(unit) else share * bound
        assert abs(violation) == pytest.approx(amount, rel=1e-9)
    assert limit.violation(np.array([bound]), task, unit)[0] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("unit", "relative"),
    [("", False), ("rad", False), ("m", True), ("N", True), ("m^3", True), ("rad/s", True)],
)
def test_angles_and_pure_numbers_are_absolute_unless_it_is_said(unit: str, relative: bool) -> None:
    assert Limit("x", "upper", 1.0).relative(unit) == relative
    assert Limit("x", "upper", 1.0, scale="relative").relative(unit)
    assert not Limit("x", "upper", 1.0, scale="absolute").relative(unit)


def test_the_bound_is_a_number_or_a_field_times_a_power_of_another() -> None:
    task = Lifting(force=8.0, way=0.5)
    assert Limit("F", "upper", 3.0).bound_of(task) == 3.0
    assert Limit("F", "upper", "force").bound_of(task) == 8.0
    assert Limit("F", "upper", "force", times=("way", 3)).bound_of(task) == 1.0
    assert Limit("F", "upper", 3.0, times=("way", -1)).bound_of(task) == 6.0


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        (Limit("F", "upper", "force"), "at most task.force"),
        (Limit("F", "lower", 0.25), "at least 0.25"),
        (Limit("F", "upper", "force", times=("way", 1)), "at most task.force task.way"),
        (Limit("F", "upper", "force", times=("way", 3)), "at most task.force task.way^3"),
        (Limit("F", "upper", 2.0, times=("way", -1)), "at most 2 task.way^-1"),
    ],
)
def test_the_bound_is_said_as_it_is_declared(limit: Limit, words: str) -> None:
    assert f"{limit.side_words} {limit.bound_words}" == words
    assert f"{limit.side_words} {limit.bound_shown('')}" == words


@pytest.mark.parametrize(
    ("bound", "unit", "words"),
    [(0.25 * np.pi, "rad", "45 deg"), (0.06, "m", "60 mm"), ("angle", "rad", "task.angle")],
)
def test_the_bound_is_shown_in_the_units_that_people_read(
    bound: float | str, unit: str, words: str
) -> None:
    assert Limit("F", "upper", bound).bound_shown(unit) == words


@pytest.mark.parametrize(
    ("limit", "value", "unit", "sentence"),
    [
        (
            Limit("force", "upper", "force", of="F"), 12.5, "N",
            "force: the force is 12.5 N at the top, 2.5 N too large; it must be at most 10 N",
        ),
        (
            Limit("alpha", "lower", "angle"), 0.25, "rad",
            "alpha: it is 14.32 deg at the top, 14.32 deg too small; it must be at least 28.65 deg",
        ),
        (
            Limit("size", "upper", 2.0, of="l1", times=("way", 1), words="the arm"), 0.7, "m",
            "size: the arm is 700 mm at the top, 100 mm too large; it must be at most 600 mm",
        ),
    ],
)  # fmt: skip
def test_a_sentence_says_what_where_by_how_much_and_what_is_allowed(
    limit: Limit, value: float, unit: str, sentence: str
) -> None:
    task, words = Lifting(), "the force" if unit == "N" else "it"
    assert limit.sentence(value, task, unit, words, "at the top") == sentence
    nowhere = limit.sentence(value, task, unit, words, "")
    assert nowhere == sentence.replace(" at the top", "")


def test_limits_are_packed_by_name() -> None:
    limits = [
        "reach",
        Limit("alpha", "lower", "angle"),
        Limit("l1", "upper", 1.4, times=("way", 2)),
    ]
    table = packed(limits, ["dimensions", "reach"], {"F": "N", "alpha": "rad"}, {"l1": "m"},
                   Lifting.names()).view(LIMIT)[:, 0]  # fmt: skip
    assert table["source"].tolist() == [0, 1, 2]
    assert table["column"].tolist() == [1, 1, 0]
    assert table["sign"].tolist() == [0, -1, 1]
    assert table["field"].tolist() == [0, 1, -1]
    assert table["factor"].tolist() == [0, -1, 2]
    assert table["relative"].tolist() == [0, 0, 1]


def test_judge_and_pictures_agree_on_every_limit(
    family_problem: Any, usable: Any, broken: Any
) -> None:
    for evaluation in (usable, broken):
        for j, limit in enumerate(family_problem.declared.constraints):
            if isinstance(limit, str):
                continue
            values, unit = evaluation.quantity(limit.quantity), family_problem.unit(limit.quantity)
            for i in np.flatnonzero(evaluation.defined[:, j])[:10]:
                expected = limit.violation(values[i : i + 1], evaluation.task(i), unit)[0] - 1e-6
                assert evaluation.constraints[i, j] == pytest.approx(expected, rel=0, abs=1e-13)
