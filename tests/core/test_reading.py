"""Files read as what they should be: every type, every complaint, and none but files."""

from __future__ import annotations

import json
import os
import re
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pkm_gym.core.files import append_lines, read_bytes, whole_file
from pkm_gym.core.reading import check_arrays, read_json, read_npz, read_text, read_toml, shaped


@dataclass(frozen=True)
class Inner:
    """A part."""

    size: float
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class Outer:
    """A whole."""

    name: str
    count: int
    inner: Inner
    flag: bool = False
    maybe: float | None = None
    table: Mapping[str, float] = field(default_factory=dict)
    rows: list[list[float]] = field(default_factory=list)
    any: Any = None


GOOD: dict[str, Any] = {"name": "a", "count": 2, "inner": {"size": 1, "words": ["x"]}}


def test_content_becomes_what_its_type_says():
    made = shaped(Outer, {**GOOD, "maybe": None, "table": {"k": 2}, "rows": [[1, 2.5]], "any": {}})
    assert made == Outer("a", 2, Inner(1.0, ("x",)), table={"k": 2.0}, rows=[[1.0, 2.5]], any={})
    assert isinstance(made.inner.size, float)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"name": 1}, "name is 1: it must be a text"),
        ({"count": 2.0}, "count is 2.0: it must be a whole number"),
        ({"count": True}, "count is True: it must be a whole number"),
        ({"flag": 1}, "flag is 1: it must be true or false"),
        ({"inner": {"size": True}}, "inner.size is True: it must be a finite number"),
        ({"inner": {"size": float("nan")}}, "inner.size is nan: it must be a finite number"),
        ({"inner": {"size": 10**400}}, "inner.size is 1000"),
        ({"inner": {}}, "it lacks inner.size"),
        ({"inner": []}, "inner is []: it must be a table"),
        ({"inner": {"size": 1, "words": "x"}}, "inner.words is 'x': it must be a list"),
        ({"inner": {"size": 1, "words": [2]}}, "inner.words[0] is 2: it must be a text"),
        ({"inner": {"sise": 1}}, "unknown key of inner 'sise'; did you mean 'size'?"),
        ({"maybe": "x"}, "maybe is 'x': it must be a finite number"),
        ({"table": {"k": "x"}}, "table.k is 'x': it must be a finite number"),
        ({"rows": [[1], [None]]}, "rows[1][0] is None: it must be a finite number"),
        ({"nam": 1}, "unknown key 'nam'; did you mean 'name'?"),
    ],
)
def test_what_is_of_another_type_is_refused_by_its_place(changes, sentence):
    with pytest.raises(ValueError, match="^" + re.escape(sentence)):
        shaped(Outer, GOOD | changes)


@pytest.mark.parametrize(
    ("arrays", "sentence"),
    [
        ({}, "it lacks a, b"),
        ({"a": np.zeros(3), "b": np.zeros((2, 2))}, "b is float64 of shape (2, 2): it must be"),
        ({"a": np.zeros(3, int), "b": np.zeros((3, 2))}, "a is int64 of shape (3,): it must be"),
        ({"a": np.zeros(3), "b": np.zeros(3)}, "b is float64 of shape (3,)"),
        ({"a": np.zeros(()), "b": np.zeros(3)}, "a is float64 of shape ()"),
        ({"a": np.zeros(3), "b": np.zeros((3, 2), np.float32)}, "b is float32"),
    ],
)
def test_arrays_that_do_not_fit_are_refused(arrays, sentence):
    wanted = {"a": ("f", ("n",)), "b": ("f8", ("n", 2))}
    check_arrays({"a": np.zeros(3), "b": np.zeros((3, 2))}, wanted)
    with pytest.raises(ValueError, match="^" + re.escape(sentence)):
        check_arrays(arrays, wanted)


@pytest.mark.parametrize("content", [b"\xff\xfe", b"a = ", b"a = [" * 5000, b"a = 1\na = 2"])
def test_what_is_no_toml_is_refused_by_name(tmp_path, content):
    path = tmp_path / "a.toml"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"^'{path}' is no thing: ") as refused:
        read_toml(path, "thing")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("content", [b"", b"{", b"[" * 100_000, b"1" * 5000])
def test_what_is_no_json_is_refused_by_name(tmp_path, content):
    path = tmp_path / "a.json"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=f"^'{path}' is damaged: it is no JSON file$"):
        read_json(path, "thing")


# What is no file ----------------------------------------------------------------------------------


@pytest.fixture(params=["pipe", "socket", "device", "folder"])
def special(request, tmp_path):
    """Something that has a place among files and is none."""
    path = tmp_path / "special"
    if request.param == "pipe":
        os.mkfifo(path)
    elif request.param == "folder":
        path.mkdir()
    elif request.param == "device":
        path.symlink_to("/dev/zero")
    else:
        with socket.socket(socket.AF_UNIX) as bound:
            bound.bind(str(path))
    return path


def test_what_is_no_file_is_refused_at_once(special):
    for read in (read_bytes, lambda path: append_lines(path, "a\n")):
        with pytest.raises(OSError, match=r"not a file|Is a directory") as refused:
            read(special)
        assert refused.value.filename == str(special)
    for read in (read_text, read_toml, read_json, read_npz):
        with pytest.raises(ValueError, match=re.escape(f"'{special}'")):
            read(special, "thing")
    with pytest.raises(OSError, match=r"not a file|Is a directory"), whole_file(special):
        pytest.fail("there is something to write to")
    assert not special.is_file()


def test_a_missing_file_is_said_to_be_missing(tmp_path):
    with pytest.raises(ValueError, match=r"can't read the thing '.*a.json': No such file"):
        read_json(tmp_path / "a.json", "thing")
    path = Path(tmp_path / "b.json")
    path.write_text(json.dumps({"a": 1}))
    assert read_json(path, "thing") == {"a": 1}
