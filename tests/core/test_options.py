"""Options: each is checked against what is declared of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import pkm_gym
from pkm_gym.core.options import Options, option
from pkm_gym.mechanisms import declaration


@dataclass(frozen=True)
class Sampling(Options):
    nodes: int = option(3, "nodes", low=2, high=64)
    grid: tuple[int, int] = option((32, 9), "columns and rows", low=2, high=100)
    speed: float = option(1.5, "speed", unit="m/s", low=0.0, high=10.0)
    cycle: bool = option(False, "whether")
    preset: str = option("printed", "which", choices=lambda: ["printed", "uniform"])
    mass: float | None = option(None, "mass, if known", unit="kg", low=0.1, high=5.0)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"nodes": 1}, "nodes is 1: it must be a whole number from 2 to 64"),
        ({"nodes": 65}, "nodes is 65: it must"),
        ({"nodes": 3.0}, "nodes is 3.0: it must be a whole number"),
        ({"nodes": True}, "nodes is True: it must be a whole number"),
        ({"nodes": None}, "nodes is None"),
        ({"nodes": "3"}, "nodes is '3'"),
        ({"grid": (1, 9)}, r"grid is \(1, 9\): it must be 2 whole numbers, each from 2 to 100"),
        ({"grid": (9,)}, r"grid is \(9,\)"),
        ({"grid": (9, 9, 9)}, "grid is"),
        ({"grid": (9, True)}, "grid is"),
        ({"grid": 9}, "grid is 9"),
        ({"grid": "99"}, "grid is '99'"),
        ({"speed": 10.1}, "speed is 10.1: it must be a number from 0 to 10 m/s"),
        ({"speed": float("nan")}, "speed is nan"),
        ({"speed": float("inf")}, "speed is inf"),
        ({"speed": False}, "speed is False"),
        ({"cycle": 1}, "cycle is 1: it must be true or false"),
        ({"cycle": "no"}, "cycle is 'no'"),
        ({"preset": "uniforn"}, "unknown preset 'uniforn'; did you mean 'uniform'"),
        ({"preset": 3}, "unknown preset 3; known: printed, uniform"),
        ({"mass": 0.0}, "mass is 0.0: it must be a number from 0.1 to 5 kg"),
        ({"mass": True}, "mass is True"),
        ({"mass": "1"}, "mass is '1'"),
        ({"nods": 3}, "unknown option 'nods'; did you mean 'nodes'"),
    ],
)
def test_an_illegal_option_is_refused_in_one_sentence(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence) as refused:
        Sampling.of(given)
    assert "\n" not in str(refused.value)


def test_a_legal_option_becomes_the_defaults_type() -> None:
    made = Sampling.of(
        {"grid": [4, 5], "speed": 2, "nodes": 64, "cycle": True, "preset": "uniform"}
    )
    assert made == Sampling(64, (4, 5), 2.0, True, "uniform")
    assert isinstance(made.speed, float)
    assert isinstance(made.grid, tuple)


def test_a_number_that_needs_not_be_given_is_none_or_a_number() -> None:
    assert Sampling().mass is None
    assert Sampling.of({"mass": None}).changed() == {}
    made = Sampling.of({"mass": 2})
    assert made.changed() == {"mass": 2.0}
    assert isinstance(made.mass, float)


def test_what_is_at_its_default_has_not_changed() -> None:
    assert Sampling().changed() == Sampling.of({"nodes": 3, "grid": [32, 9]}).changed() == {}
    assert Sampling(nodes=4, cycle=True).changed() == {"nodes": 4, "cycle": True}
    assert Options.of({}).changed() == {}


def test_what_is_allowed_is_said_in_words() -> None:
    assert {item.name: item.allowed for item in Sampling.table()} == {
        "nodes": "a whole number from 2 to 64",
        "grid": "2 whole numbers, each from 2 to 100",
        "speed": "a number from 0 to 10 m/s",
        "cycle": "true or false",
        "preset": "printed or uniform",
        "mass": "a number from 0.1 to 5 kg",
    }


@pytest.mark.parametrize("name", pkm_gym.problems())
def test_the_defaults_of_each_problem_are_legal(name: str) -> None:
    for item in declaration(name).options.table():
        assert item.checked(item.default) == item.default
        assert item.allowed


def test_an_option_of_numpys_is_taken_or_refused_in_words() -> None:
    assert Sampling(speed=np.float64(2.0)).speed == 2.0
    with pytest.raises(ValueError, match="nodes is"):
        Sampling(nodes=np.float64(3.0))  # type: ignore[arg-type]  # on purpose
