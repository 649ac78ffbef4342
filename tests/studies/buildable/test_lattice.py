"""Lattices: what words mean, and values that are those of what is typed."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pkm_gym.core.units import parse
from pkm_gym.studies.buildable.lattice import Axis, by_dimension, lattice

UNITS = {"e": "m", "l1": "m", "phi": "rad", "lam": ""}


def test_steps_are_of_all_lengths_or_angles_or_of_one_dimension():
    axes = lattice(UNITS, ["1mm", "l1=0.1mm", "lam=0.01"], ["phi=10deg, 12deg,10deg"])
    assert {name: axis.words for name, axis in axes.items()} == {
        "e": "1 mm", "l1": "0.1 mm", "lam": "0.01", "phi": "10.00 deg, 12.00 deg"
    }  # fmt: skip
    assert by_dimension(UNITS, ["0.5deg"], "--to") == {"phi": parse("0.5deg", "rad")}


@pytest.mark.parametrize(("unit", "step", "word"), [("m", 0.1, "mm"), ("rad", 0.5, "deg")])
def test_a_value_is_the_one_that_is_typed(unit, step, word):
    axis = Axis(unit, step)
    for number in range(1, 3000):
        typed = parse(f"{number * step:.12g}{word}", unit)
        assert axis.value(number) == pytest.approx(typed, rel=1e-15, abs=0.0)
        assert axis.holds(typed)
        assert not axis.holds(typed + 0.01 * axis.pitch)


@pytest.mark.parametrize("axis", [Axis("m", 5.0), Axis("m", stock=(0.1, 0.105, 0.11, 0.115, 0.12))])
def test_near_values_stand_on_both_sides(axis):
    def near(value, reach):
        return [round(1e3 * axis.value(int(i))) for i in axis.near(value, reach)]

    assert near(0.112, 1) == [110, 115]
    assert near(0.110, 1) == [105, 110, 115]
    assert near(0.112, 2) == [105, 110, 115, 120]


def test_a_stock_ends():
    axis = Axis("m", stock=(0.1, 0.2))
    assert axis.near(0.7, 5).tolist() == [0, 1]
    assert axis.near(0.01, 1).tolist() == [0, 1]
    assert axis.pitch == pytest.approx(0.1)
    assert Axis("m", stock=(0.1,)).pitch == 0.0
    assert np.isclose(axis.place(0.15), 0.5)


@pytest.mark.parametrize(
    ("to", "stock", "sentence"),
    [
        ([], [], "nothing is said of the lattice"),
        (["1"], [], "--to 1 is neither a length nor an angle"),
        (["1kg"], [], "--to 1kg is neither a length nor an angle"),
        (["1mm", "2mm"], [], "two numbers in m, cm, mm"),
        (["0mm"], [], "--to is 0mm: it must be more than 0"),
        (["l1=-1mm"], [], "--to l1 is -1mm: it must be more than 0"),
        (["l1=1mm", "l1=2mm"], [], "--to gives l1 twice"),
        (["l9=1mm"], [], "unknown dimension 'l9'; did you mean 'l1'"),
        (["l1=1deg"], [], "'deg' is no unit of it"),
        ([], ["300mm"], "--stock 300mm names no dimension"),
        ([], ["l1=300mm,"], "stock of l1 is ''"),
        ([], ["l1=1mm", "l1=2mm"], "--stock gives l1 twice"),
    ],
)
def test_what_says_no_lattice_is_refused(to, stock, sentence):
    with pytest.raises(ValueError, match=re.escape(sentence)):
        lattice(UNITS, to, stock)


def test_an_angle_without_angles_is_refused():
    with pytest.raises(ValueError, match="there is no angle among e"):
        lattice({"e": "m"}, ["1deg"])
