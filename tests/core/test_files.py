"""Files appear whole or not at all, or grow by whole lines."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from pkm_gym.core.files import append_lines, whole_file


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


def test_a_library_that_fails_on_a_full_disk_is_not_what_is_told(tmp_path, limited):
    path = tmp_path / "b.txt"

    def fail():
        with whole_file(path) as part:
            try:
                part.write_bytes(bytes(5000))
            except OSError:
                raise RuntimeError("unexpected pos 576") from None

    with limited(1000), pytest.raises(OSError, match="File too large") as caught:
        fail()
    assert caught.value.filename == str(path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("left", range(13))
def test_of_lines_that_do_not_fit_the_whole_ones_stay(tmp_path, limited, left):
    path = tmp_path / "lines"
    append_lines(path, "zero\n")
    with limited(5 + left), pytest.raises(OSError, match="File too large") as caught:
        append_lines(path, "first\nsecond\n")
    assert caught.value.filename == str(path)
    assert path.read_text() == ("zero\nfirst\n" if left >= 6 else "zero\n")
    append_lines(path, "third\n")
    assert path.read_text().splitlines()[-1] == "third"


@pytest.mark.parametrize("half", ["hal", "zero\none\nhal", "zero\n"])
def test_half_a_line_is_cut_off_before_the_next_one(tmp_path, half):
    path = tmp_path / "lines"
    path.write_text(half)
    append_lines(path, "next\n", sync=True)
    assert path.read_text() == half.removesuffix("hal") + "next\n"
