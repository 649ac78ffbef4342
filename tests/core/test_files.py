"""Files appear whole or not at all."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from pkm_gym.core.files import whole_file


def test_the_folder_is_made_and_the_file_whole(tmp_path):
    path = tmp_path / "a" / "b.txt"
    with whole_file(path) as part:
        part.write_text("whole")
        assert part.suffix == path.suffix
        assert not path.exists()
    assert path.read_text() == "whole"
    assert list(path.parent.iterdir()) == [path]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "b.txt"
    path.write_text("old")

    def fail():
        with whole_file(path) as part:
            part.write_text("half")
            raise RuntimeError("disk full")

    with pytest.raises(RuntimeError, match="disk full"):
        fail()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_names_the_file_that_was_asked_for(tmp_path):
    path = tmp_path / "taken"
    path.mkdir()

    def fail():
        with whole_file(path) as part:
            part.write_text("whole")

    with pytest.raises(OSError, match="taken") as caught:
        fail()
    assert caught.value.filename == str(path)
    assert list(tmp_path.iterdir()) == [path]


def test_threads_write_the_same_file_one_after_the_other(tmp_path):
    path = tmp_path / "b.txt"

    def write(k):
        with whole_file(path) as part:
            part.write_text(f"{k}" * 100_000)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(write, range(8)))
    assert path.read_text() in {f"{k}" * 100_000 for k in range(8)}
    assert list(tmp_path.iterdir()) == [path]
