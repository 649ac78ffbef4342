"""Rows: what is declared is found by name, and kernels read and write it by name."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import numpy as np
import pytest

from pkm_gym.core.compile import kernel
from pkm_gym.core.merit import write
from pkm_gym.core.rows import Index, Own, declared, index, own, record, undefined, variable
from pkm_gym.core.task import Variable


class Indices(NamedTuple):
    size: Annotated[float, index("m", "size")]
    slope: Annotated[float, index("rad", "slope", reported=False)]


class Careless(NamedTuple):
    dimensions: Annotated[float, own("make a machine")]
    reach: float


class Mixed(NamedTuple):
    size: Annotated[float, own("a limit among indices")]


class Design(NamedTuple):
    arm: Annotated[float, variable(0.1, 1.0, "m", "arm")]
    rod: Annotated[float, variable(0.2, 2.0, "m", "rod", default="arm", searched=False, step=0.1)]


def test_declared_fields_carry_their_name() -> None:
    assert declared(Indices, Index) == (
        Index("size", "m", "size"), Index("slope", "rad", "slope", reported=False)
    )  # fmt: skip
    assert declared(Design, Variable)[1] == Variable(
        "rod", 0.2, 2.0, "m", "rod", default="arm", searched=False, step=0.1
    )


def test_a_field_that_declares_nothing_or_something_else_is_refused() -> None:
    with pytest.raises(TypeError, match=r"Careless\.reach is not annotated with a Own"):
        declared(Careless, Own)
    with pytest.raises(TypeError, match=r"Mixed\.size is not annotated with a Index"):
        declared(Mixed, Index)


def test_a_record_reads_packed_rows_by_name(slider: Any) -> None:
    assert record(Design).names == ("arm", "rod")
    task = slider.task_type(way=0.7)
    packed = task.pack().view(record(slider.task_type))[0]
    assert (packed["way"], packed["slope_max"]) == (0.7, 0.9)
    rows = np.array([[0.3, 0.4], [0.5, 0.6]]).view(record(Design))
    assert rows.shape == (2, 1)
    assert rows[1, 0]["rod"] == 0.6


def test_undefined_is_nan_throughout() -> None:
    row = undefined(Indices)
    assert isinstance(row, Indices)
    assert np.isnan(row).all()


# A name that is forgotten or unknown fails when the kernel is compiled, and writes nowhere.


@kernel
def complete(row: np.ndarray) -> None:
    write(row, Indices(size=1.0, slope=2.0))


@kernel
def forgetful(row: np.ndarray) -> None:
    write(row, Indices(size=1.0))  # type: ignore[call-arg]  # on purpose


@kernel
def inventive(row: np.ndarray) -> None:
    write(row, Indices(size=1.0, slope=2.0, mass=3.0))  # type: ignore[call-arg]  # on purpose


@kernel
def misreading(design: Any) -> float:
    return design.arm + design.rood


def test_a_kernel_writes_its_row_in_order() -> None:
    row = np.zeros(2)
    complete(row)
    assert row.tolist() == [1.0, 2.0]


@pytest.mark.parametrize(("wrong", "name"), [(forgetful, "slope"), (inventive, "mass")])
def test_a_forgotten_or_unknown_field_fails_when_it_is_compiled(wrong: Any, name: str) -> None:
    row = np.zeros(2)
    with pytest.raises(TypeError, match=f"argument.* '{name}'"):
        wrong(row)
    assert row.tolist() == [0.0, 0.0]


def test_an_unknown_field_that_is_read_fails_when_it_is_compiled() -> None:
    with pytest.raises(KeyError, match="rood"):
        misreading(np.ones(2).view(record(Design))[0])
