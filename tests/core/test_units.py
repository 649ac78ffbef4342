"""Values with units: text in, SI inside, mm and degrees out."""

from __future__ import annotations

import math

import pytest

from pkm_gym.core.units import WRITTEN, converted, parse, show, shown


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("150mm", "m", 0.15),
        ("25 cm", "m", 0.25),
        ("0.8", "m", 0.8),
        (" 1e-3 m ", "m", 1e-3),
        ("45deg", "rad", math.pi / 4),
        ("-1.5", "rad", -1.5),
        ("1500g", "kg", 1.5),
        (".5", "", 0.5),
        ("+2.", "", 2.0),
        ("60rpm", "rad/s", 2 * math.pi),
        ("0.3 N m/(m/s^2)", "N m/(m/s^2)", 0.3),
    ],
)
def test_text_becomes_a_number_in_si(text, unit, value):
    assert parse(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit"),
    [("150kg", "m"), ("150mn", "m"), ("3mm", ""), ("2 deg", "m"), ("1MM", "m")],
)
def test_a_unit_of_another_kind_is_refused_with_those_allowed(text, unit):
    with pytest.raises(ValueError, match=r"^b is .* is no unit of it, it is") as refused:
        parse(text, unit, what="b")
    assert all(allowed in str(refused.value) for allowed in WRITTEN[unit])


@pytest.mark.parametrize("text", ["", "mm", "abc", "nan", "inf", "1e999", "--1", "1 2", "0x10"])
def test_what_is_no_finite_number_is_refused(text):
    with pytest.raises(ValueError, match=r"^payload is "):
        parse(text, "kg", what="payload")


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.15, "m", "150.0 mm"),
        (math.pi / 4, "rad", "45.00 deg"),
        (0.33909513, "N m/(m/s^2)", "0.3391 N m/(m/s^2)"),
        (1.49333, "", "1.493"),
        (math.nan, "rad", "undefined"),
    ],
)
def test_numbers_are_shown_as_people_read_them(value, unit, text):
    assert show(value, unit) == text


@pytest.mark.parametrize("unit", WRITTEN)
def test_what_is_shown_can_be_typed_again(unit):
    number, name = converted(0.123456, unit)
    assert parse(f"{number!r}{name}", unit) == pytest.approx(0.123456, rel=1e-14)
    assert shown(0.123456, unit)[1] == name
