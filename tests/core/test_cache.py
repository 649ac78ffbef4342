"""The kernel cache: a key of what a kernel is compiled from, and a folder of our own."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

Run = Callable[..., subprocess.CompletedProcess[str]]

PACKAGE = {
    "__init__.py": "",
    "rows.py": """
from typing import NamedTuple
import numpy as np
class Pair(NamedTuple):
    low: float
    high: float
ROW = np.dtype({"names": ["payload", "time"], "formats": ["f8", "f8"]})
""",
    "constants.py": "GAIN = 2.0\nUNUSED = 1.0\n",
    "helper.py": """
from pkm_gym.core.compile import kernel
from outside import constants
from outside.rows import Pair
@kernel
def helper(x):
    return Pair(low=x, high=constants.GAIN * x)
""",
    "kernels.py": """
import numba
from pkm_gym.core.compile import batch_kernel, kernel
from outside.helper import helper
from outside.rows import ROW
@batch_kernel
def fill(tasks, out):
    for i in numba.prange(out.shape[0]):
        task = tasks[i]
        pair = helper(tasks.view(ROW)[i, 0].payload)
        out[i] = 100.0 * pair[0] + pair[1] + task[1]
def twice(inner):
    @kernel
    def closed(x):
        return inner(inner(x).high).high
    return closed
""",
}

CALL = """
import sys
sys.path.append(sys.argv[1])
import numpy as np
from outside.helper import helper
from outside.kernels import fill, twice
tasks, out = np.array([[1.0, 10.0], [3.0, 20.0]]), np.empty((2, 2))
fill(0.0, tasks, out[0])
fill(1e9, tasks, out[1])
assert (out[0] == out[1]).all()
print(*out[0], twice(helper)(1.0))
"""

# What is changed: file, from, to, and what is then printed.
CHANGES = {
    "helper": ("helper.py", "GAIN * x", "GAIN * x + 1.0", "113.0 327.0 7.0"),
    "constant": ("constants.py", "GAIN = 2.0", "GAIN = 5.0", "115.0 335.0 25.0"),
    "class": ("rows.py", "low: float\n    high: f", "high: float\n    low: f", "211.0 623.0 4.0"),
    "record": ("rows.py", '"payload", "time"', '"time", "payload"', "1030.0 2060.0 4.0"),
}


@pytest.fixture
def call(run: Run, tmp_path: Path) -> Callable[[], subprocess.CompletedProcess[str]]:
    """Call a small outside package in a new process with a cache folder of its own."""
    for name, text in PACKAGE.items():
        path = tmp_path / "outside" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return lambda: run(CALL, str(tmp_path), NUMBA_CACHE_DIR=str(tmp_path / "cache"))


Call = Callable[[], subprocess.CompletedProcess[str]]


def compiled(done: subprocess.CompletedProcess[str]) -> bool:
    return "compiling kernels (once per machine)" in done.stderr


def files(tmp_path: Path) -> set[Path]:
    return set((tmp_path / "cache" / "kernels").iterdir())


def test_an_outside_package_is_compiled_once(call: Call, tmp_path: Path) -> None:
    first = call()
    assert first.stdout.split() == ["112.0", "326.0", "4.0"]
    assert compiled(first)
    kept = files(tmp_path)
    again = call()
    assert (again.stdout, again.stderr) == (first.stdout, "")
    assert files(tmp_path) == kept


@pytest.mark.parametrize("change", CHANGES)
def test_what_a_kernel_reads_of_other_files_is_in_its_key(
    call: Call, tmp_path: Path, change: str
) -> None:
    before = call().stdout
    name, old, new, expected = CHANGES[change]
    path = tmp_path / "outside" / name
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace(old, new), encoding="utf-8")
    changed = call()
    assert compiled(changed)
    assert changed.stdout.strip() == expected
    path.write_text(text, encoding="utf-8")  # two checkouts don't take each other's place
    back = call()
    assert (back.stdout, back.stderr) == (before, "")


def test_what_no_kernel_reads_is_not_in_the_key(call: Call, tmp_path: Path) -> None:
    call()
    path = tmp_path / "outside" / "constants.py"
    path.write_text("# moved\n\nGAIN = 2.0\nUNUSED = 7.0\n", encoding="utf-8")
    assert call().stderr == ""


def test_damaged_files_are_made_anew(call: Call, tmp_path: Path) -> None:
    expected = call().stdout
    for k, path in enumerate(sorted(files(tmp_path))):
        content = path.read_bytes()
        path.write_bytes([b"", content[: len(content) // 2], b"x" * len(content)][k % 3])
    mended = call()
    assert mended.stdout == expected
    assert mended.stderr.count("damaged files in") == 1
    assert mended.stderr.count("\n") == 2  # that, and that kernels are compiled
    assert call().stderr == ""


def test_a_folder_that_others_may_write_to_is_not_used(call: Call, tmp_path: Path) -> None:
    expected = call().stdout
    folder = tmp_path / "cache" / "kernels"
    assert folder.stat().st_mode & 0o777 == 0o700
    for mode in (0o770, 0o757):
        folder.chmod(mode)
        done = call()
        assert done.stdout == expected
        assert f"{folder} is not used: others may write there" in done.stderr
        assert "at every start" in done.stderr


def test_a_file_in_the_place_of_the_folder_is_done_without(call: Call, tmp_path: Path) -> None:
    expected = call().stdout
    folder = tmp_path / "cache" / "kernels"
    shutil.rmtree(folder)
    folder.write_text("in the way")
    for _ in range(2):
        done = call()
        assert done.stdout == expected
        assert "no writable cache folder: at every start" in done.stderr
        assert done.stderr.count("\n") == 1


def test_a_full_disk_is_done_without(call: Call, tmp_path: Path, limited: Callable) -> None:
    with limited(1000):
        done = call()
    assert done.stdout.split() == ["112.0", "326.0", "4.0"]
    assert done.stderr.count("compiled kernels can't be kept in") == 1
    assert done.stderr.count("\n") == 2  # that, and that kernels are compiled
    assert files(tmp_path) == set()


def test_a_folder_of_somebody_else_is_not_used(call: Call, tmp_path: Path) -> None:
    if os.getuid() != 0:
        pytest.skip("only root can give a folder away")
    call()
    folder = tmp_path / "cache" / "kernels"
    os.chown(folder, 12345, 12345)
    assert f"{folder} is not used" in call().stderr


def test_a_file_of_somebody_else_is_made_anew(call: Call, tmp_path: Path) -> None:
    if os.getuid() != 0:
        pytest.skip("only root can give a file away")
    expected = call().stdout
    planted = files(tmp_path)
    for path in planted:
        os.chown(path, 12345, 12345)
    mended = call()
    assert mended.stdout == expected
    assert mended.stderr.count("damaged files in") == 1
    assert 0 in {path.stat().st_uid for path in planted}
    assert call().stderr == ""


def test_what_nobody_uses_is_removed(call: Call, tmp_path: Path) -> None:
    call()
    used, unused = sorted(files(tmp_path))[:2]
    folders = [tmp_path / "cache" / name for name in ("kernels-0123456789abcdef", "somebody's")]
    for folder in folders:
        folder.mkdir()
    long_ago = time.time() - 31 * 86400.0
    for path in (unused, *folders):
        os.utime(path, (long_ago, long_ago))
    (tmp_path / "outside" / "constants.py").write_text("GAIN = 3.0\n", encoding="utf-8")
    assert compiled(call())
    assert used.exists()
    assert not unused.exists()
    assert [folder.exists() for folder in folders] == [False, True]


def test_reading_a_file_keeps_it(call: Call, tmp_path: Path) -> None:
    call()
    long_ago = time.time() - 31 * 86400.0
    for path in files(tmp_path):
        os.utime(path, (long_ago, long_ago))
    assert call().stderr == ""
    assert any(time.time() - path.stat().st_mtime < 3600.0 for path in files(tmp_path))


NAMESAKE = """
from typing import NamedTuple
from pkm_gym.core.compile import kernel
from pkm_gym.core.merit import write
class Limits(NamedTuple):
    {}: float
    x: float
@kernel
def fill(row):
    write(row, Limits(1.0, 2.0))
"""

FILL_BOTH = """
import sys
sys.path.append(sys.argv[1])
import numpy as np
for name in ("first", "second"):
    row = np.empty(2)
    __import__(name).fill(row)
    print(*row)
"""


def test_row_classes_of_one_name_and_length_are_told_apart(run: Run, tmp_path: Path) -> None:
    for name in ("first", "second"):
        (tmp_path / f"{name}.py").write_text(NAMESAKE.format(name))
    for _ in range(2):
        done = run(FILL_BOTH, str(tmp_path), NUMBA_CACHE_DIR=str(tmp_path))
        assert done.stdout.splitlines() == ["1.0 2.0", "1.0 2.0"]
